"""Other logs (GPX, IGC, RTKLIB, ArduPilot, KML, tables): one straight track is read from each, also after damage."""

import datetime
import json
import math
import struct
from typing import NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_allclose

from steerway.core import InputError
from steerway.formats.testing import gpx, read, survey
from tests.messages import HEAD, POINT, POINTS, WHOLE, document, position
from tests.sentences import only

START = 1532858400.0  # 2018-07-29 10:00:00
COUNT = 30
LATITUDE, LONGITUDE = -33.85 + 3e-5 * np.arange(COUNT), -70.2 + 4e-5 * np.arange(COUNT)
WEEK, OF_WEEK = divmod(START + 18.0 - 315964800.0, 604800.0)
ISO = "{utc:%Y-%m-%dT%H:%M:%SZ}"


def fields(k):
    """What a line may say of second k."""
    a, o = LATITUDE[k], LONGITUDE[k]
    utc = datetime.datetime.fromtimestamp(START + k, datetime.UTC)
    days, rest = divmod(round(START) + k, 86400)
    found = {"k": k, "a": a, "o": o, "south": -a, "west": -o, "unix": round(START) + k, "weeks": WEEK}
    found |= {"utc": utc, "gps": utc + datetime.timedelta(seconds=18), "local": utc - datetime.timedelta(hours=6)}
    found |= {
        "ms": 1e3 * (START + k),
        "of_week": 1e3 * (OF_WEEK + k),
        "fit": START + k - 631065600.0,
        "clock": 1000 * k,
    }
    for name, degrees in (("south", -a), ("west", -o)):
        found |= {f"{name}_deg": int(degrees), f"{name}_min": degrees % 1.0 * 60.0, f"{name}_mmin": degrees % 1.0 * 6e4}
    for name, degrees in (("a", a), ("o", o)):
        found |= {f"semi_{name}": round(degrees * 2**31 / 180.0), f"e7_{name}": round(degrees * 1e7)}
    frame, system = position(a, o), struct.pack("<BBHI", 1, 0xF0, days, 10_000 * rest)
    found |= {
        "frame": frame.hex(" "),
        "FRAME": frame.hex(" ").upper(),
        "hex": frame.hex().upper(),
        "system": system.hex(" "),
    }
    found["sps"] = "No fix" if k == 3 else "SPS"
    return found | {"status": 1 if k == 3 else 3, "valid": "V" if k == 3 else "A", "quality": 1 + k % 2}


def lines(row):
    """A line per fix, by a template."""
    return "".join(f"{row.format(**fields(k))}\n" for k in range(COUNT))


class Log(NamedTuple):
    """A log by the template of its lines; resolution of its positions in degrees."""

    row: str
    head: str = ""
    tail: str = ""
    resolution: float = 2e-7

    def __str__(self):
        return f"{self.head}{lines(self.row) if self.row else ''}{self.tail}"


def geojson(properties=lambda times: {"coordTimes": times}):
    line = [[o, a] for a, o in zip(LATITUDE, LONGITUDE, strict=True)]
    feature = {"type": "Feature", "geometry": {"type": "LineString", "coordinates": line}}
    feature["properties"] = properties(lines(ISO).split())
    return Log("", json.dumps({"type": "FeatureCollection", "features": [feature]}))


RTKLIB = " {a:.9f} {o:.9f} 100.0 {quality} 9 0.0300 0.0400 0.05 0.0"
KML, KML_END = '<kml xmlns="x" xmlns:gx="y"><Document>', "</Document></kml>"
DELTA = '"timestamp": "{utc:%Y-%m-%dT%H:%M:%S}.000Z", "values": [{{"path": "navigation.position", '
DELTA = '{{"updates": [{{"$source": "gps", ' + DELTA + '"value": {{"latitude": {a}, "longitude": {o}}}}}]}}]}}'
LOGS = {
    "IGC": Log(
        "B{utc:%H%M%S}{south_deg:02d}{south_mmin:05.0f}S{west_deg:03d}{west_mmin:05.0f}W{valid}0010000100\r",
        "AXXX001\r\nHFDTE290718\r\n",
        resolution=1e-5,
    ),
    "RTKLIB": Log(
        "{gps:%Y/%m/%d %H:%M:%S}.000" + RTKLIB,
        "% program : RTKPOST\n%  GPST   latitude(deg) longitude(deg) height(m) Q ns sdn(m) sde(m) sdu(m) sdne(m)\n",
    ),
    "RTKLIB in UTC": Log(
        "{utc:%Y/%m/%d %H:%M:%S}.000" + RTKLIB, "%  UTC   latitude(deg) longitude(deg) height(m) Q ns\n"
    ),
    "RTKLIB with commas": Log(
        "{gps:%Y/%m/%d %H:%M:%S}.000,{a:.9f},{o:.9f},40.0,5,10,2.0,2.0",
        "%  GPST,latitude(deg),longitude(deg),height(m),Q,ns,sdn(m),sde(m)\n",
    ),
    "data flash": Log(
        "GPS, {k}, {status}, {of_week:.0f}, {weeks:.0f}, 14, 0.8, {a:.7f}, {o:.7f}, 12.3, 1.500, 270.00, 0.01, 1",
        "FMT, 130, 50, GPS, QBIHBcLLefffB, TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,U\n",
        "GPS, broken",
    ),
    "old data flash": Log(
        "GPS, 3, {of_week:.0f}, {weeks:.0f}, 9, 1.1, {a}, {o}, 0, 1, 4, 45, 0, 1",
        "FMT, 130, 45, GPS, BIHBcLLeeEefI, Status,TimeMS,Week,NSats,HDop,Lat,Lng,RelAlt,Alt,Spd,GCrs,VZ,T\n",
    ),
    "dumped data flash": Log(
        "{utc:%Y-%m-%d %H:%M:%S}.00: GPS {{TimeUS : {k}, I : 0, Status : 3, GMS : {of_week:.0f}, GWk : {weeks:.0f}, "
        "HDop : 1.1, Lat : {a:.7f}, Lng : {o:.7f}, Spd : 4.0, GCrs : 45.0, U : 1}}"
    ),
    "TCX": Log(
        f"<Trackpoint><Time>{ISO}</Time><Position><LatitudeDegrees>{{a}}</LatitudeDegrees><LongitudeDegrees>{{o}}"
        "</LongitudeDegrees></Position><Extensions><ns3:TPX><ns3:Speed>1.5</ns3:Speed></ns3:TPX></Extensions></Trackpoint>",
        '<?xml version="1.0"?><TrainingCenterDatabase xmlns:ns3="x"><Track>',
        "</Track></TrainingCenterDatabase>",
    ),
    "placemarks": Log(
        f"<Placemark><TimeStamp><when>{ISO}</when></TimeStamp><Point><coordinates>{{o}},{{a}},0</coordinates></Point>"
        "</Placemark>",
        KML,
        KML_END,
    ),
    "KML track": Log(
        "<gx:coord>{o} {a} 0</gx:coord>",
        f"{KML}<Placemark><gx:Track>{lines(f'<when>{ISO}</when>')}",
        f"</gx:Track></Placemark>{KML_END}",
    ),
    "GeoJSON": geojson(),
    "GeoJSON of coordinateProperties": geojson(lambda times: {"coordinateProperties": {"times": times}}),
    "FIT as CSV": Log(
        'Data,0,record,timestamp,"{fit:.0f}",s,position_lat,"{semi_a}",semicircles,position_long,"{semi_o}",semicircles,'
        'speed,"4.0",m/s',
        "Type,Local Number,Message,Field 1,Value 1,Units 1,Field 2,Value 2,Units 2\n",
    ),
    "Yacht Devices, dates only in the system time": Log(
        "{utc:%H:%M:%S}.000 R 0df01003 {system}\n{utc:%H:%M:%S}.000 R 09f80103 {frame}"
    ),
    "deltas": Log("{ms:.0f};I;" + DELTA),
    "candump with dates": Log(" ({utc:%Y-%m-%d %H:%M:%S}.000000)  can0  09F80103   [8]  {FRAME}"),
    "analyzed": Log(
        "{utc:%Y-%m-%d-%H:%M:%S}.000 2   3 255 129025 Position, Rapid Update:  Latitude = {a:.7f}; Longitude = {o:.7f}"
    ),
    "SeaSmart": Log("$PCDIN,01F801,{clock:08X},03,{hex}*00"),
}
LOGGER = "INDEX,RCR,DATE,TIME,VALID,LATITUDE,N/S,LONGITUDE,E/W,HEIGHT,SPEED,HEADING,DISTANCE,"
TABLES = {
    LOGGER: ("1,T,{utc:%Y/%m/%d},{utc:%H:%M:%S},{sps},{south:.7f},S,{west:.7f},W,20.1 m,14.400 km/h,45.0,1 m,"),
    "time,lat,NS,lon,EW": "{unix},{south:.7f},s,{west:.7f},w",
    "time,Latitude,Lat_Dir,Longitude,Lon_Dir": "{unix},{a:.7f},S,{west:.7f},West",
    "time;lat;lat_ref;lon;lon_ref": "{unix};{south_deg} {south_min:.6f};S;{west_deg} {west_min:.6f};W",
    "TAG,DATE,TIME,LATITUDE N/S,LONGITUDE E/W": "T,180729,{utc:%H%M%S},{south:.7f}S,{west:.7f}W",
    "Lcl Date, Lcl Time, UTCOfst, Latitude, Longitude": "{local:%Y-%m-%d}, {local:%H:%M:%S}, -06:00, {a:.7f}, {o:.7f}",
    "No,Latitude,Longitude,utc_d,utc_t": "1,{a:.7f},{o:.7f},{utc:%Y/%m/%d},{utc:%I:%M:%S} AM",
    "40\ntime,lat,lon,provider,": "{unix},{a:.7f},{o:.7f},gps",
    "%time,field.header.stamp,field.status.status,field.latitude,field.longitude": (
        "{unix}900000000,{unix}000000000,0,{a:.7f},{o:.7f}"
    ),
    "%time,field.pose.position.latitude,field.pose.position.longitude": "{unix}000000000,{a:.7f},{o:.7f}",
    "timestamp,position_lat,position_long": "{utc:%Y-%m-%d %H:%M:%S},{semi_a},{semi_o}",
    "timestamp,lat,lon": "{utc:%Y-%m-%d %H:%M:%S},{e7_a},{e7_o}",
    "record.timestamp[s],record.position_lat[semicircles],record.position_long[semicircles]": (
        "{fit:.0f},{semi_a},{semi_o}"
    ),
    "time_boot_ms,time_unix_ms,lat,lon": "{clock},{ms:.0f},{a:.7f},{o:.7f}",
}
"""Tables of loggers and tools: a row by the header."""
LOGS |= {header: Log(row, f"{header}\n") for header, row in TABLES.items()}


@pytest.mark.parametrize("name", LOGS)
def test_the_track_is_read_back(name):
    fixes = read(str(LOGS[name]).encode())
    kept = [k for k in range(COUNT) if k != 3 or name not in ("IGC", "data flash", LOGGER)]  # fix 3 is invalid
    since = 0.0 if name == "SeaSmart" else START  # its times are of the gateway's clock
    assert_allclose(fixes.time, since + np.array(kept), atol=1e-3)
    assert_allclose(np.degrees(fixes.latitude), LATITUDE[kept], atol=LOGS[name].resolution)
    assert_allclose(np.degrees(fixes.longitude), LONGITUDE[kept], atol=LOGS[name].resolution)


def test_what_a_log_says_beside_places():
    rtklib, ardupilot, tcx = (read(str(LOGS[name]).encode()) for name in ("RTKLIB", "data flash", "TCX"))
    assert_allclose(rtklib.position_std, math.hypot(0.03, 0.04) / math.sqrt(2.0))
    assert_allclose((ardupilot.sog[0], np.degrees(ardupilot.cog[0])), (1.5, 270.0))
    assert 0.1 < ardupilot.position_std[0] < 5.0
    assert_allclose(tcx.sog, 1.5)
    logger = read(str(LOGS[LOGGER]).encode())
    assert_allclose(
        (logger.sog[0], np.degrees(logger.cog[0])), (4.0, 45.0)
    )  # it has no compass: its heading is the course
    assert np.isnan(logger.heading).all() and "skipped 1 × no fix" in logger.notes


@pytest.mark.parametrize("name", ["TCX", "placemarks"])
def test_reading_continues_after_a_damaged_point(name):
    damaged = str(LOGS[name]).replace(f"{ISO.format(**fields(4))}<", "<<&")
    assert set(np.arange(COUNT)) - set(read(damaged.encode()).time - START) == {4}


@pytest.mark.parametrize("name", LOGS)
def test_damage_costs_what_follows_it_at_most(name):
    data = str(LOGS[name]).encode()
    rng = np.random.default_rng(0)
    for _ in range(10):
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
    found = survey((lines(DELTA) + other + '{"updates": [{"values": 3}]}\n').encode())[0].recording
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
