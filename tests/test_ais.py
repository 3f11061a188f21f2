"""AIS: sentences encoded by pyais, and recorded logs compared with pyais's reader."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pyais import encode_dict
from pyais.stream import IterMessages

from steerway.core.testing import KNOT
from steerway.formats.testing import ais
from tests.messages import checksum, sentences, tagged
from tests.sentences import only

MIDNIGHT = 1565222400  # 2019-08-08 00:00:00


def halves(line):
    """A sentence split into two parts."""
    payload = line.split(b",")[5]
    bodies = [b"AIVDM,2,1,7,A,%s,0" % payload[:28], b"AIVDM,2,2,7,A,%s,0" % payload[28:]]
    return [b"!%s*%s" % (body, checksum(body)) for body in bodies]


def read(clock=MIDNIGHT + 12, **changes):
    return ais.read(tagged(clock, *sentences(**changes)))


@pytest.mark.parametrize("kind", [1, 2, 3, 18, 19])
def test_position_reports_in_si_and_radians(kind):
    fixes = only(read(type=kind, msg_type=kind))
    assert fixes.mmsi[0] == 257591700
    assert_allclose(np.degrees((fixes.latitude[0], fixes.longitude[0])), (63.5, 7.25), atol=1e-6)
    assert_allclose(fixes.sog, 12.5 * KNOT)
    assert_allclose(np.degrees((fixes.cog[0], fixes.heading[0])), (181.5, 180.0))
    assert fixes.time[0] == MIDNIGHT + 10


def test_long_range_report():
    fixes = only(read(type=27, msg_type=27, speed=12, course=181))
    assert_allclose((fixes.sog[0], np.degrees(fixes.cog[0])), (12 * KNOT, 181.0))
    assert_allclose(np.degrees(fixes.latitude), 63.5, atol=2e-3)
    assert fixes.time[0] == MIDNIGHT + 12
    assert np.isnan(only(read(type=27, msg_type=27, speed=63, course=511)).sog[0])


def test_not_available_is_unknown_and_turns_are_positive_to_starboard():
    fixes = only(read(speed=102.3, course=360.0, heading=511, turn=-128))
    assert np.isnan((fixes.sog[0], fixes.cog[0], fixes.heading[0], fixes.yaw_rate[0])).all()
    assert np.isnan(only(read(turn=127)).yaw_rate[0])
    assert_allclose([only(read(turn=turn)).yaw_rate[0] for turn in (20, -20)], np.radians([20 / 60, -20 / 60]))
    most = only(read(speed=102.2, course=359.9, heading=359))
    assert_allclose((most.sog[0], *np.degrees((most.cog[0], most.heading[0]))), (102.2 * KNOT, 359.9, 359.0))
    assert read(lat=91.0).sources == {}
    assert read(lon=181.0).skipped == {"no position": 1}


@pytest.mark.parametrize(
    ("received", "second", "made"),
    [(12, 2, 2), (12, 1, 12), (12, 15, 15), (12, 16, 12), (3, 58, -2), (58, 0, 60), (64, 59, 59), (5, 60, 5)],
)
def test_the_utc_second_takes_out_a_delay_of_up_to_ten_seconds(received, second, made):
    """Or of three seconds too little, by a slow clock."""
    assert only(read(MIDNIGHT + received, second=second)).time[0] == MIDNIGHT + made


@pytest.mark.parametrize(
    "written",
    [
        b"\\s:2573535,c:1565222412*0A\\%s\r\n",
        b"\\g:1-2-1234,s:r003669945,c:1565222412*4A\\%s\n",
        b"2019-08-08T00:00:12.4Z %s\n",
        b"2019-08-08T02:00:12+02:00 %s\n",
        b"1565222412.25: %s\n",
        b"1565222412250 %s\n",
        b"%s,r003669945,1565222412\n",
        b"1565222412 !AIVDM,1,1,,A,33P;Tw0tjBQO2%s\n",
    ],
)
def test_where_the_time_may_stand(written):
    assert only(ais.read(written % sentences()[0])).time[0] == MIDNIGHT + 10


def test_a_clock_in_the_log_stands_in_and_without_any_time_it_says_so():
    recording = ais.read(sentences()[0])
    assert (recording.sources, recording.skipped) == ({}, {"no time": 1})
    assert "no report can be used" in recording.notes[0]
    base = encode_dict(
        {"type": 4, "mmsi": 2573535, "year": 2019, "month": 8, "day": 7, "hour": 23, "minute": 59, "second": 58},
        talker_id="AI",
    )[0]
    log = b"\n".join([base.encode(), *sentences(second=1), *sentences(second=30, mmsi=1)])
    assert list(only(ais.read(log)).time - MIDNIGHT) == [-30, 1]
    rmc = b"GPRMC,235958,A,5310.8115,N,00525.7025,E,0.0,0.0,070819,0.7,E,A"
    rmc = b"$%s*%s\r\n" % (rmc, checksum(rmc))
    assert list(only(ais.read(rmc + sentences(second=1)[0])).time - MIDNIGHT) == [1]


def test_messages_in_two_parts_also_mixed():
    first, second = (halves(*sentences(type=19, msg_type=19, mmsi=mmsi)) for mmsi in (111111111, 222222222))
    mixed = tagged(MIDNIGHT + 12, first[0]) + tagged(
        MIDNIGHT + 14, sentences(mmsi=3)[0], first[1], second[1], second[0]
    )
    recording = ais.read(mixed)
    assert sorted(only(recording).mmsi) == [3, 111111111]
    assert only(recording).time[1] == MIDNIGHT + 10
    assert recording.skipped == {"part of a message missing": 2}


def test_tracks_are_sorted_by_vessel_and_time_and_repeats_dropped():
    lines = [tagged(MIDNIGHT + t, *sentences(mmsi=m, second=t)) for t, m in [(5, 2), (3, 2), (4, 1), (3, 2)]]
    recording = ais.read(b"".join(lines))
    assert list(only(recording).mmsi) == [1, 2, 2]
    assert list(only(recording).time - MIDNIGHT) == [4, 3, 5]
    assert recording.skipped == {"received twice": 1}


def test_damage_costs_the_damaged_line():
    good, other = sentences()[0], sentences(mmsi=5)[0]
    log = tagged(MIDNIGHT + 12, good[:20] + good, b"!AIVDM,1,1,,B,,0*25", good.replace(b"A,1", b"A,2"), other + good)
    recording = ais.read(log + b"\xff\x00!AIVDM")
    assert sorted(only(recording).mmsi) == [5, 257591700]
    assert recording.skipped["checksum"] == 1
    assert recording.skipped["AIS sentence incomplete"] == 2


@pytest.mark.parametrize(
    "name",
    ["ais_misc/kystverket_1000lines.nm4", "ais_misc/pyais_nmea_data_sample.txt", "signalk_samples/gofree-merrimac.log"],
)
def test_recorded_reports_are_kept_as_pyais_counts_them(shared_data, name):
    data = (shared_data / "data" / name).read_bytes()
    valid, undecodable = [], 0
    for message in IterMessages(data.splitlines()):
        try:
            decoded = message.decode()
        except Exception:
            undecodable += 1
            continue
        if message.is_valid and decoded.msg_type in (1, 2, 3, 18, 19, 27) and abs(decoded.lat) <= 90:
            valid.append((decoded.mmsi, round(decoded.lat, 6), round(decoded.lon, 6)))
    recording = ais.read(data)
    fixes = only(recording)
    assert ais.recognises(data[:65536])
    assert len(fixes) + recording.skipped.get("received twice", 0) == len(valid)
    assert len(fixes) >= 0.99 * len(valid)
    kept = zip(fixes.mmsi.tolist(), np.degrees(fixes.latitude), np.degrees(fixes.longitude), strict=True)
    assert {(mmsi, round(lat, 6), round(lon, 6)) for mmsi, lat, lon in kept} == set(valid)
    assert recording.skipped.get("AIS sentence incomplete", 0) >= undecodable
