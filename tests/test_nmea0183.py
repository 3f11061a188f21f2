"""The NMEA 0183 reader on sentences with known content."""

import datetime

import numpy as np
import pytest

from steerway.formats.testing import nmea0183
from tests.sentences import KNOT, START, clock, gga, gll, place, rmc, sealed, sortie, track

DAY = 86400.0


def only(data, name="GP"):
    return nmea0183.read(data).sources[name]


def test_sentences_of_one_time_become_one_row():
    time, lat, lon = track(50)
    recording = nmea0183.read(sortie(50))
    fixes = recording.sources["GP"]
    np.testing.assert_allclose(fixes.time, time, atol=1e-6)
    np.testing.assert_allclose(fixes.latitude, np.radians(lat), rtol=0, atol=1e-14)
    np.testing.assert_allclose(fixes.longitude, np.radians(lon), rtol=0, atol=1e-14)
    np.testing.assert_allclose(fixes.sog, 5.0 * KNOT)
    np.testing.assert_allclose(fixes.cog, np.radians(123.4))
    compass = recording.sources["HC"]
    np.testing.assert_allclose(compass.time, time, atol=1e-6)
    np.testing.assert_allclose(compass.heading, np.radians(122.5))
    assert not compass.has_position.any()
    assert recording.counts == {"GPRMC": 50, "GPGGA": 50, "GPGLL": 50, "GPVTG": 50, "HCHDG": 50}
    assert recording.skipped == {}


def test_the_antimeridian_joins_formatters_on_both_sides_and_the_finer_position_is_kept():
    east, west = "1000.00000,N,18000.00000,E", "1000.00000,N,18000.00000,W"
    hour, date = clock(START)
    fixes = only(
        sealed(f"GPRMC,{hour},A,{east},1.0,90.0,{date},,,A") + sealed(f"GPGGA,{hour},{west},1,10,0.9,1.0,M,47.0,M,,")
    )
    assert len(fixes) == 1 and fixes.longitude[0] == -np.pi
    coarse, fine = sealed(f"GPGLL,{place(54.000012, 10.0, 2)},{hour},A,A"), gga(START, 54.000012, 10.0)
    for data in (coarse + fine, fine + coarse):
        (latitude,) = only(data).latitude
        np.testing.assert_allclose(np.degrees(latitude), 54.000012, atol=1e-7)


@pytest.mark.parametrize(
    "sentence, column, value",
    [
        ("GPVTG,90.0,T,,M,10.0,N,18.52,K,A", "sog", 10.0 * KNOT),
        ("GPVTG,,T,,M,,N,36.0,K,A", "sog", 10.0),
        ("GPVTG,270.0,T,,M,10.0,N,18.52,K", "cog", -np.pi / 2),
        ("GPHDT,350.0,T", "heading", np.radians(-10.0)),
        ("GPTHS,350.0,A", "heading", np.radians(-10.0)),
        ("GPHDG,350.0,2.0,W,5.0,E", "heading", np.radians(-7.0)),
        ("GPVHW,350.0,T,,M,6.0,N,11.11,K", "heading", np.radians(-10.0)),
        ("GPVHW,,T,,M,6.0,N,11.11,K", "water_speed", 6.0 * KNOT),
        ("GPVBW,5.5,0.2,A,5.0,0.1,A", "water_speed", 5.5 * KNOT),
        ("GPVBW,5.5,0.2,A,-5.0,0.1,A", "bottom_speed", -5.0 * KNOT),
        ("GPVBW,5.5,0.2,V,5.0,0.1,A,,V,,V", "bottom_speed", 5.0 * KNOT),
        ("GPRPM,S,1,-600.0,10.5,A", "shaft", -10.0),
        ("GPRPM,E,2,1800,,A", "shaft", 30.0),
        ("GPVHW,,,,,,,18.0,K", "water_speed", 5.0),
        ("GPROT,60.0,A", "yaw_rate", np.radians(1.0)),
        ("GPROT,-60.0,A", "yaw_rate", np.radians(-1.0)),
        ("GPGST,120000.00,,,,,3.0,4.0,5.0", "position_std", np.sqrt(12.5)),
    ],
)
def test_what_a_sentence_says(sentence, column, value):
    fixes = only(gga(START, 54.0, 10.0) + sealed(sentence))
    assert len(fixes) == 1
    output = getattr(fixes, column)[0]
    if column == "cog":
        value %= 2 * np.pi
    np.testing.assert_allclose(output, value, rtol=1e-12)


WITHOUT_A_VALUE = (
    "GPTHS,350.0,V",
    "GPVTG,90.0,T,,M,10.0,N,18.52,K,N",
    "GPVTG,90.0,T,,M,-1.0,N,,K,A",
    "GPVTG,90.0,K,,M,1.0,N,,T,A",
    "GPVTG,90.0,T,,M,1.0,N",
    "GPHDT,3x0.0,T",
    "GPHDG,350.0,2.0,W,5.0,Q",
    "GPHDT,,T",
)


def test_what_is_empty_or_not_believed_leaves_no_value():
    for sentence in WITHOUT_A_VALUE:
        fixes = only(rmc(START, 54.0, 10.0, sog_kn="", cog="") + sealed(sentence))
        said = [name for name in ("sog", "cog", "heading", "yaw_rate") if np.isfinite(getattr(fixes, name)).any()]
        assert said == [], sentence


HOUR, DATE = clock(START)
HERE = place(54.0, 10.0)


@pytest.mark.parametrize(
    "sentence, reason",
    [
        (f"GPRMC,{HOUR},V,{HERE},1.0,90.0,{DATE},,,A", "no fix"),
        (f"GPRMC,{HOUR},A,{HERE},1.0,90.0,{DATE},,,N", "no fix"),
        (f"GPGGA,{HOUR},{HERE},0,00,,,M,,M,,", "no fix"),
        (f"GPGLL,{HERE},{HOUR},V,N", "no fix"),
        (f"GPRMC,{HOUR},A,{HERE},1.0,90.0,{DATE}", "number of fields"),
        (f"GPRMC,{HOUR},A,{HERE},1.0,400.0,{DATE},,,A", "malformed or out of range"),
        (f"GPRMC,{HOUR},A,{HERE},1.0.0,90.0,{DATE},,,A", "malformed or out of range"),
        (f"GPRMC,{HOUR},A,{HERE},1.0,90.0,310224,,,A", "time or date"),
        (f"GPRMC,246000,A,{HERE},1.0,90.0,{DATE},,,A", "time or date"),
        (f"GPGGA,{HOUR},5460.000,N,01000.000,E,1,10,0.9,1.0,M,47.0,M,,", "position"),
        (f"GPGGA,{HOUR},5400.000,N,18100.000,E,1,10,0.9,1.0,M,47.0,M,,", "position"),
        (f"GPGGA,{HOUR},5400.000,E,01000.000,N,1,10,0.9,1.0,M,47.0,M,,", "position"),
        (f"GPGGA,{HOUR},5400.000,N,,,1,10,0.9,1.0,M,47.0,M,,", "position"),
        (f"GPRMCGP,{HOUR},A,{HERE},1.0,90.0,{DATE},,,A", "unknown sentence type"),
    ],
)
def test_a_sound_checksum_is_not_believed_blindly(sentence, reason):
    recording = nmea0183.read(sealed(sentence))
    assert not any(fixes.has_position.any() for fixes in recording.sources.values())
    assert [reason in counted for counted in recording.skipped] == [True]


def test_a_talker_may_be_an_address_on_a_bus():
    log = b"".join(rmc(START + k, 54.0, 10.0 + k * 1e-3, talker="24") for k in range(3)) + sealed("04HDT,90.0,T")
    assert nmea0183.recognises(log)
    sources = nmea0183.read(log).sources
    assert len(sources["24"]) == 3 and np.isfinite(sources["04"].heading).all()


def test_checksums():
    good = gga(START, 54.0, 10.0)
    lower = good.replace(good[-4:-2], good[-4:-2].lower())
    without = good[: good.index(b"*")] + b"\r\n"
    wrong = good[:-4] + b"00\r\n"
    assert len(only(lower)) == 1
    assert len(only(without)) == 1
    assert nmea0183.read(wrong).skipped == {"checksum wrong": 1}
    assert len(only(good[:-2] + gga(START + 1, 54.0, 10.0))) == 2
    after_one_with = nmea0183.read(good + gga(START + 1, 54.0, 10.0).split(b"*")[0] + b"\r\n")
    assert after_one_with.skipped == {"checksum missing, unlike the talker's other sentences": 1}


def test_the_date_is_carried_over_midnight_and_back_to_the_start():
    midnight = START - START % DAY + DAY
    time = midnight + np.arange(-10, 10)
    data = b"".join(gga(t, 54.0, 10.0 + k * 1e-3) for k, t in enumerate(time[:5]))
    data += rmc(time[5], 54.0, 10.1)
    data += b"".join(gga(t, 54.0, 10.2 + k * 1e-3) for k, t in enumerate(time[6:]))
    np.testing.assert_allclose(only(data).time, time, atol=1e-6)


@pytest.mark.parametrize("hours", [2.0, -3.5, 5.75, 13.0])
@pytest.mark.parametrize("first", [0, 1])
def test_a_sentence_without_date_in_local_time_is_made_utc(hours, first):
    times = START + 43_190.0 + np.arange(20.0)  # across midnight
    sentences = [
        each
        for k, time in enumerate(times)
        for each in (
            rmc(time, 54.0 + 2e-5 * k, 10.0),
            gga(time, 54.0 + 2e-5 * k, 10.0),
            gll(time + 3600.0 * hours + 0.02, 54.0 + 2e-5 * k, 10.0),
        )
    ]
    recording = nmea0183.read(b"".join(sentences[first:]))
    own = [times[0], times[0] + 0.02][: 1 + first]  # before the first date a sentence keeps its own time
    assert recording.sources["GP"].time.tolist() == [*own, *times[1:]]
    assert any("20 sentences without a date were in local time" in note for note in recording.notes)


def test_a_gap_of_whole_hours_is_no_other_time_zone():
    later = [gga(START + 7200.0 + k, 54.1, 10.0) for k in range(3)]
    times = nmea0183.read(rmc(START, 54.0, 10.0) + b"".join(later)).sources["GP"].time
    assert times.tolist() == [START, *(START + 7200.0 + k for k in range(3))]


def test_where_the_date_comes_from():
    """From ZDA, also the time of what has none; from a later sentence; from nowhere."""
    vtg = sealed("GPVTG,90.0,T,,M,2.0,N,,K,A")
    by_zda = only(sealed("GPZDA,120000,01,07,2024,00,00") + f"$GPGLL,{HERE}\r\n".encode() + vtg)
    later = only(gga(START, 54.0, 10.0) + rmc(START + 1, 54.0, 10.0, talker="II") + vtg)
    for fixes in (by_zda, later):
        assert fixes.time.tolist() == [START] and fixes.sog[0] == 2.0 * KNOT
    recording = nmea0183.read(gga(START, 54.0, 10.0) + gga(START + 1, 54.0, 10.0))
    np.testing.assert_allclose(recording.sources["GP"].time, [43200.0, 43201.0])
    assert any("1970-01-01" in note for note in recording.notes)


def iso(time):
    return datetime.datetime.fromtimestamp(time, datetime.UTC).strftime("%Y-%m-%dT%H:%M:%S.%f").encode()


@pytest.mark.parametrize(
    "prefix",
    [
        lambda t: iso(t) + b"Z ",
        lambda t: iso(t).replace(b"T", b" ") + b"\t",
        lambda t: iso(t + 7200.0) + b"+02:00;",
        lambda t: f"{t:.3f} ".encode(),
        lambda t: f"[{t * 1000:.0f}] ".encode(),
        lambda t: f"\\s:rx,c:{t:.0f}*00\\".encode(),
    ],
)
def test_receive_times_date_a_log(prefix):
    time, lat, lon = track(5)
    data = b"".join(prefix(t + 0.3) + gga(t, *at) for t, *at in zip(time, lat, lon, strict=True))
    np.testing.assert_allclose(only(data).time, time, atol=1e-6)
    np.testing.assert_allclose(only(prefix(START + 0.5) + sealed("HEHDT,90.0,T"), "HE").time, START + 0.5, atol=0.51)


def test_instruments_with_receive_times_keep_them_and_a_burst_is_one_epoch():
    data = iso(START + 0.2) + b" " + gga(START, 54.0, 10.0)
    data += iso(START + 0.3) + b" " + sealed("GPHDT,90.0,T")
    data += iso(START + 0.8) + b" " + sealed("GPHDT,91.0,T")
    data += iso(START + 0.4) + b" " + sealed("HEHDT,92.0,T")
    recording = nmea0183.read(data)
    np.testing.assert_allclose(recording.sources["GP"].time, [START, START + 0.8], atol=1e-6)
    np.testing.assert_allclose(np.degrees(recording.sources["GP"].heading), [90.0, 91.0])
    np.testing.assert_allclose(recording.sources["HE"].time, [START + 0.4], atol=1e-6)


def test_of_many_headings_in_an_epoch_without_times_the_first_is_kept_and_the_rest_counted():
    headings = b"".join(sealed(f"HEHDT,{heading:.1f},T") for heading in range(100, 110))
    recording = nmea0183.read(gga(START, 54.0, 10.0) + headings + gga(START + 1, 54.0, 10.001) + headings)
    np.testing.assert_allclose(np.degrees(recording.sources["HE"].heading), [100.0, 100.0])
    assert recording.skipped == {"without a time field and repeated within an epoch": 18}


ROLLOVER = 1024 * 7 * DAY


@pytest.mark.parametrize("rollovers", [1, 2])
def test_week_rollover_by_receive_time(rollovers):
    data = b"".join(
        iso(START + k + 0.2) + b" " + rmc(START + k - rollovers * ROLLOVER, 54.0, 10.0 + k * 1e-3) for k in range(5)
    )
    recording = nmea0183.read(data)
    np.testing.assert_allclose(recording.sources["GP"].time, START + np.arange(5), atol=1e-6)
    assert any("rollover" in note for note in recording.notes)


@pytest.mark.parametrize(
    ("shift", "wrong", "note"),
    [(-ROLLOVER, wrong, "rollover: ") for wrong in ([3, 4, 5], [0, 1], [0, 2])]
    + [(40 * DAY, [4], "1 rows had a date")],
)
def test_week_rollover_and_a_stray_date_by_continuity(shift, wrong, note):
    data = b"".join(rmc(START + k + shift * (k in wrong), 54.0, 10.0 + k * 1e-3) for k in range(8))
    recording = nmea0183.read(data)
    np.testing.assert_allclose(recording.sources["GP"].time, START + np.arange(8), atol=1e-6)
    assert [note in each for each in recording.notes] == [True]


def test_late_and_out_of_order_sentences_find_their_row():
    data = gga(START, 54.0, 10.0) + gga(START + 1, 54.0, 10.001) + rmc(START, 54.0, 10.0) + rmc(START + 1, 54.0, 10.001)
    fixes = only(data)
    assert len(fixes) == 2 and np.isfinite(fixes.sog).all()
    late = only(rmc(START + 2, 54.0, 10.002) + rmc(START, 54.0, 10.0) + rmc(START + 3, 54.0, 10.003))
    np.testing.assert_allclose(late.time, START + np.array([0.0, 2.0, 3.0]))
    # What is said twice stays twice, and another position stays another.
    here = rmc(START, 54.0, 10.0)
    assert len(only(here + gll(START, 54.0, 10.0) + here)) == len(only(here + gll(START, 54.0, 10.01))) == 2


def test_two_receivers_behind_one_talker():
    time, lat, lon = track(40)
    data = b""
    for k, (t, a, o) in enumerate(zip(time, lat, lon, strict=True)):
        pair = [rmc(t, a, o), rmc(t, a + 1e-3, o)]
        data += b"".join(pair if k % 3 else pair[::-1]) if k % 7 else pair[0]
    sources = nmea0183.read(data).sources
    near, far = sorted(sources.values(), key=lambda fixes: fixes.latitude[1])
    np.testing.assert_allclose(np.degrees(near.latitude), lat, atol=1e-7)
    np.testing.assert_allclose(np.degrees(far.latitude), lat[np.arange(40) % 7 != 0] + 1e-3, atol=1e-7)


def test_a_plotter_that_stamps_two_moments_with_one_second():
    time, lat, lon = track(40)
    data = b"".join(rmc(t, a, o) + gga(t, a + 2e-5, o) for t, a, o in zip(time, lat, lon, strict=True))
    sources = nmea0183.read(data).sources
    assert set(sources) == {"GP RMC", "GP GGA"}
    np.testing.assert_allclose(np.degrees(sources["GP RMC"].latitude), lat, atol=1e-7)


def test_variation_from_the_sentence_then_rmc_then_the_model():
    own = nmea0183.read(gga(START, 54.0, 10.0) + sealed("HCHDG,100.0,,,3.0,W"))
    np.testing.assert_allclose(np.degrees(own.sources["HC"].heading), 97.0)
    by_rmc = nmea0183.read(gga(START, 54.0, 10.0) + sealed("HCHDM,100.0,M") + rmc(START, 54.0, 10.0, variation="4.0,E"))
    np.testing.assert_allclose(np.degrees(by_rmc.sources["HC"].heading), 104.0)
    assert any("RMC" in note for note in by_rmc.notes)
    model = nmea0183.read(rmc(START, 54.0, 10.0) + sealed("HCHDM,100.0,M"))
    assert 103.0 < np.degrees(model.sources["HC"].heading[0]) < 106.0
    assert any("World Magnetic Model 2020" in note for note in model.notes)
    nowhere = nmea0183.read(sealed("GPZDA,120000,01,07,2024,00,00") + sealed("HCHDM,100.0,M"))
    assert nowhere.skipped == {"magnetic heading without variation or position": 1}
