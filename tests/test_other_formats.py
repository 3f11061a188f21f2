"""Other log formats (GPX, IGC, RTKLIB, ArduPilot, KML): one straight track is read from each, also after damage."""

import datetime
import json
import math
import struct

import numpy as np
import pytest
from numpy.testing import assert_allclose

from steerway.core import InputError
from steerway.formats.testing import gpx, read, survey
from tests.messages import HEAD, POINT, POINTS, WHOLE, document
from tests.sentences import only

START = 1532858400.0  # 2018-07-29 10:00:00
COUNT = 30
LATITUDE, LONGITUDE = 45.1 + 1e-4 * np.arange(COUNT), -9.1 + 2e-4 * np.arange(COUNT)


WEEK, OF_WEEK = divmod(START + 18.0 - 315964800.0, 604800.0)
CIRCLE = 2**31 / 180.0
DATE = "%Y-%m-%d %H:%M:%S"
ISO = "%Y-%m-%dT%H:%M:%SZ"


def of_week(k):
    """Milliseconds of the GPS week at second k, as text."""
    return f"{1e3 * (OF_WEEK + k):.0f}"


def clock(k, form="%Y/%m/%d %H:%M:%S"):
    return datetime.datetime.fromtimestamp(START + k, datetime.UTC).strftime(form)


def minutes(degrees, width):
    whole, part = divmod(round(abs(degrees) * 60000), 60000)
    return f"{whole:0{width}d}{part:05d}"


def lines(row, head=""):
    """A line per fix, written by `row(second, latitude, longitude)`."""
    return head + "".join(f"{row(k, a, o)}\n" for k, (a, o) in enumerate(zip(LATITUDE, LONGITUDE, strict=True)))


def igc():
    return lines(
        lambda k, a, o: f"B{clock(k, '%H%M%S')}{minutes(a, 2)}N{minutes(o, 3)}W{'V' if k == 3 else 'A'}0010000100\r",
        "AXXX001\r\nHFDTE290718\r\n",
    )


def rtklib(system="GPST", ahead=18):
    head = (
        f"% program : RTKPOST\n%  {system}   latitude(deg) longitude(deg) height(m) Q ns sdn(m) sde(m) sdu(m) sdne(m)\n"
    )
    return lines(
        lambda k, a, o: f"{clock(k + ahead)}.000 {a:.9f} {o:.9f} 100.0 {1 + k % 2} 9 0.0300 0.0400 0.05 0.0", head
    )


def dataflash():
    head = "FMT, 130, 50, GPS, QBIHBcLLefffB, TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,U\n"

    def row(k, a, o):
        return (
            f"GPS, {k}, {3 if k != 3 else 1}, {of_week(k)}, {WEEK:.0f}, 14, 0.8, {a:.7f}, {o:.7f}, 12.3, 1.500, 270.00,"
            " 0.01, 1"
        )

    return lines(row, head) + "GPS, broken"


def tcx():
    def row(k, a, o):
        return (
            f"<Trackpoint><Time>{clock(k, ISO)}</Time><Position><LatitudeDegrees>{a}</LatitudeDegrees>"
            f"<LongitudeDegrees>{o}</LongitudeDegrees></Position>"
            "<Extensions><ns3:TPX><ns3:Speed>1.5</ns3:Speed></ns3:TPX></Extensions></Trackpoint>"
        )

    head = '<?xml version="1.0"?><TrainingCenterDatabase xmlns:ns3="x"><Track>'
    return f"{lines(row, head)}</Track></TrainingCenterDatabase>"


def kml(row):
    return f'<kml xmlns="x" xmlns:gx="y"><Document>{lines(row)}</Document></kml>'


def kml_placemarks():
    return kml(
        lambda k, a, o: (
            f"<Placemark><TimeStamp><when>{clock(k, ISO)}</when></TimeStamp><Point><coordinates>{o},{a},0</coordinates>"
            "</Point></Placemark>"
        )
    )


def kml_track():
    whens, places = (
        lines(lambda k, *_: f"<when>{clock(k, ISO)}</when>"),
        lines(lambda k, a, o: f"<gx:coord>{o} {a} 0</gx:coord>"),
    )
    return kml(lambda k, *_: f"<Placemark><gx:Track>{whens}{places}</gx:Track></Placemark>" if k == 0 else "")


def geojson_line(properties=lambda times: {"coordTimes": times}):
    line = [[o, a] for a, o in zip(LATITUDE, LONGITUDE, strict=True)]
    feature = {"type": "Feature", "geometry": {"type": "LineString", "coordinates": line}}
    feature["properties"] = properties([clock(k, ISO) for k in range(COUNT)])
    return json.dumps({"type": "FeatureCollection", "features": [feature]})


def geojson_of_coordinate_properties():
    return geojson_line(lambda times: {"coordinateProperties": {"times": times}})


def old_dataflash():
    head = "FMT, 130, 45, GPS, BIHBcLLeeEefI, Status,TimeMS,Week,NSats,HDop,Lat,Lng,RelAlt,Alt,Spd,GCrs,VZ,T\n"
    return lines(
        lambda k, a, o: f"GPS, 3, {1e3 * (OF_WEEK + k):.0f}, {WEEK:.0f}, 9, 1.1, {a}, {o}, 0, 1, 4, 45, 0, 1", head
    )


def dumped_dataflash():
    def row(k, a, o):
        return (
            f"{clock(k, DATE)}.00: GPS {{TimeUS : {k}, I : 0, Status : 3, GMS : {of_week(k)}, "
            f"GWk : {WEEK:.0f}, HDop : 1.1, Lat : {a:.7f}, Lng : {o:.7f}, Spd : 4.0, GCrs : 45.0, U : 1}}"
        )

    return lines(row)


def fit_messages():
    head = "Type,Local Number,Message,Field 1,Value 1,Units 1,Field 2,Value 2,Units 2\n"

    def row(k, a, o):
        place = f'position_lat,"{round(a * CIRCLE)}",semicircles,position_long,"{round(o * CIRCLE)}",semicircles'
        return f'Data,0,record,timestamp,"{START + k - 631065600:.0f}",s,{place},speed,"4.0",m/s'

    return lines(row, head)


def raw_of_a_dated_bus():
    """Yacht Devices' lines in lower case, with dates only in the system time (126992)."""

    def row(k, a, o):
        days, rest = divmod(round(START) + k, 86400)
        now, system = f"{clock(k, '%H:%M:%S')}.000 R", struct.pack("<BBHI", 1, 0xF0, days, 10_000 * rest)
        return f"{now} 0df01003 {system.hex(' ')}\n{now} 09f80103 {frame_bytes(a, o).hex(' ')}"

    return lines(row)


def rtklib_with_commas():
    head = "%  GPST,latitude(deg),longitude(deg),height(m),Q,ns,sdn(m),sde(m)\n"
    return lines(lambda k, a, o: f"{clock(k + 18)}.000,{a:.9f},{o:.9f},40.0,5,10,2.0,2.0", head)


def deltas(before="{0:.0f};I;"):
    def row(k, a, o):
        value = {"path": "navigation.position", "value": {"latitude": a, "longitude": o}}
        update = {"$source": "gps", "timestamp": clock(k, "%Y-%m-%dT%H:%M:%S.000Z"), "values": [value]}
        return before.format(1e3 * (START + k)) + json.dumps({"updates": [update]})

    return lines(row)


def frame_bytes(a, o):
    return struct.pack("<ii", round(1e7 * a), round(1e7 * o))


def candump_with_dates():
    return lines(
        lambda k, a, o: (
            f" ({clock(k, '%Y-%m-%d %H:%M:%S')}.000000)  can0  09F80103   [8]  {frame_bytes(a, o).hex(' ').upper()}"
        )
    )


def analyzed():
    when = "%Y-%m-%d-%H:%M:%S"
    return lines(
        lambda k, a, o: (
            f"{clock(k, when)}.000 2   3 255 129025 Position, Rapid Update:  Latitude = {a:.7f}; Longitude = {o:.7f}"
        )
    )


def seasmart():
    return lines(lambda k, a, o: f"$PCDIN,01F801,{k * 1000:08X},03,{frame_bytes(a, o).hex().upper()}*00")


LOGS = {
    igc: 1e-5,
    dataflash: 1e-6,
    **dict.fromkeys((rtklib, lambda: rtklib("UTC", 0)), 1e-8),
    **dict.fromkeys((tcx, kml_track, kml_placemarks, geojson_line, geojson_of_coordinate_properties), 1e-12),
    **dict.fromkeys((old_dataflash, dumped_dataflash, fit_messages, rtklib_with_commas, deltas), 2e-7),
    **dict.fromkeys((raw_of_a_dated_bus, candump_with_dates, analyzed, seasmart), 2e-7),
}
"""Resolution (degrees) of the positions in each log."""


@pytest.mark.parametrize("log", LOGS)
def test_the_track_is_read_back(log):
    fixes = read(log().encode())
    kept = [k for k in range(COUNT) if k != 3 or log not in (igc, dataflash)]  # fix 3 is invalid
    since = 0.0 if log is seasmart else START  # its times are of the gateway's clock
    assert_allclose(fixes.time, since + np.array(kept), atol=1e-3)
    assert_allclose(np.degrees(fixes.latitude), LATITUDE[kept], atol=LOGS[log])
    assert_allclose(np.degrees(fixes.longitude), LONGITUDE[kept], atol=LOGS[log])


def test_what_a_log_says_beside_places():
    assert_allclose(read(rtklib().encode()).position_std, math.hypot(0.03, 0.04) / math.sqrt(2.0))
    ardupilot = read(dataflash().encode())
    assert_allclose((ardupilot.sog[0], np.degrees(ardupilot.cog[0])), (1.5, 270.0))
    assert 0.1 < ardupilot.position_std[0] < 5.0
    assert_allclose(read(tcx().encode()).sog, 1.5)


@pytest.mark.parametrize("log", [tcx, kml_placemarks])
def test_reading_continues_after_a_damaged_point(log):
    damaged = log().replace(f"{clock(4, ISO)}<", "<<&")
    assert set(np.arange(COUNT)) - set(read(damaged.encode()).time - START) == {4}


@pytest.mark.parametrize("log", LOGS)
def test_damage_costs_what_follows_it_at_most(log):
    data = log().encode()
    rng = np.random.default_rng(0)
    for _ in range(15):
        cut = bytearray(data[: rng.integers(len(data) // 2, len(data))])
        cut[rng.integers(len(cut))] = rng.integers(256)
        try:
            fixes = read(bytes(cut))
        except InputError as error:
            assert "\n" not in str(error)
            continue
        assert np.isfinite(fixes.latitude).all() and (np.diff(fixes.time) >= 0.0).all()


def test_deltas_of_other_vessels_and_damaged_ones_are_counted():
    other = '{"context": "vessels.urn:mrn:imo:mmsi:230099999", "updates": []}\n'
    found = survey((deltas("") + other + '{"updates": [{"values": 3}]}\n').encode())[0].recording
    assert found.skipped == {"delta of another vessel": 1, "line not understood": 1}
    assert (found.format, list(found.sources)) == ("Signal K", ["gps"])


NEW_YEAR = 1672531200.0  # 2023, of the points in tests.messages


def test_gpx_of_both_versions_and_points_without_time_or_place():
    motion = "<course>90</course><speed>2.5</speed>"
    points = (
        POINT.format(1, motion),
        POINT.format(2, ""),
        '<trkpt lat="1" lon="2"/>',
        POINT.format(2, "").replace("2.5", "95"),
    )
    recording = gpx.read(document(*points))
    fixes = only(recording)
    assert list(fixes.time - NEW_YEAR) == [1, 2]
    assert_allclose(np.degrees(fixes.latitude), [1.5, 2.5])
    assert_allclose(np.degrees(fixes.longitude), 2.25)
    assert_allclose(fixes.sog, [2.5, np.nan])
    assert_allclose(np.degrees(fixes.cog), [90.0, np.nan])
    assert recording.counts == {"track points": 4} and recording.skipped == {"no time": 1, "no position": 1}
    head = '<gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1" xmlns:x="http://www.garmin.com/x">'
    inner = "<extensions><x:E><x:speed>1.5</x:speed><x:course>5</x:course></x:E></extensions>"
    fixes = only(gpx.read(document(POINT.format(3, inner), head=head)))
    assert_allclose((fixes.sog[0], np.degrees(fixes.cog[0])), (1.5, 5.0))
    with pytest.raises(InputError, match="XML entities"):
        gpx.read(b'<!DOCTYPE x [<!ENTITY a "b">]><gpx>&a;</gpx>')


def test_tracks_named_by_mmsi_are_vessels():
    tracks = [f"<trk><name>MMSI {m}</name><trkseg>{POINT.format(1, '')}</trkseg></trk>" for m in (235000002, 235000001)]
    fixes = only(gpx.read(f"{HEAD}{''.join(tracks)}</gpx>".encode()))
    assert list(fixes.mmsi) == [235000001, 235000002]
    assert only(gpx.read(document(POINT.format(1, ""), name="<name>Sunday</name>"))).mmsi is None


AT = WHOLE.index(POINTS[3].encode()) + 20


@pytest.mark.parametrize(
    ("damaged", "lost"),
    [
        (WHOLE[: AT + 5], {4, 5, 6, 7}),
        (WHOLE[:AT] + b"\x00<<&" + WHOLE[AT + 9 :], {4}),
        (WHOLE[:AT] + WHOLE[AT + 55 :], {4}),
        (WHOLE[:AT] + b'"' + WHOLE[AT:], {4}),
        (WHOLE[:AT] + b">\n<!-- " + WHOLE[AT:], {4}),
        (WHOLE[: AT - 8] + WHOLE[WHOLE.index(POINTS[4].encode()) :], {4}),
        (WHOLE.replace(b"</trkpt>", b"", 1), {1}),
        (b"junk " + WHOLE, set()),
        (WHOLE.replace(b"<gpx ", b"<gpx <", 1), set()),
        (WHOLE[WHOLE.index(b"<trkseg>") :], set()),
    ],
)
def test_nothing_valid_is_lost_around_damage(damaged, lost):
    recording = gpx.read(damaged)
    assert set((only(recording).time - NEW_YEAR).astype(int)) == {1, 2, 3, 4, 5, 6, 7} - lost
    assert recording.skipped["damaged place"] >= 1
