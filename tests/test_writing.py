"""Written files, complete or absent, read back to the last bit; written sentences beside literal text."""

import gzip
import json
import math

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from steerway.core import Fixes, Motion
from steerway.core.testing import Leg
from steerway.formats.testing import formats_writing as writing
from steerway.formats.testing import gga, hdt, nmea0183, rmb, rmc, rot, sealed, survey, table, vtg

RNG = np.random.default_rng(7)
N = 300


def fixes(**changes):
    course = RNG.uniform(-np.pi, np.pi, N)
    course[5] = np.nan
    columns = {
        "time": 1.7e9 + np.sort(RNG.uniform(0, 1e4, N)),
        "latitude": RNG.uniform(-1.5, 1.5, N),
        "longitude": RNG.uniform(-np.pi, np.pi, N),
        "sog": RNG.exponential(3.0, N),
        "cog": course,
        "heading": RNG.uniform(-np.pi, np.pi, N),
        "water_speed": RNG.uniform(0, 9, N) * 1e-7,
        "yaw_rate": RNG.normal(0, 0.1, N),
        "position_std": RNG.exponential(1.0, N),
    }
    return Fixes(**(columns | changes))


def motion(mmsi=None):
    columns = {
        name: RNG.uniform(-1.0, 1.0, N) for name in Motion.__dataclass_fields__ if name not in ("mmsi", "status")
    }
    columns |= {"time": 1.7e9 + np.sort(RNG.uniform(0, 1e4, N)), "cog": RNG.uniform(-np.pi, np.pi, N)}
    columns["cog"][3] = columns["course_rate"][3] = np.nan
    columns["sog"] = np.abs(columns["sog"])
    return Motion(**columns, status=RNG.integers(0, 5, N).astype(np.uint8), mmsi=mmsi)


VESSELS = np.repeat([219000001, 235000002, 999999999], N // 3)


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_fixes_read_back_as_they_were(tmp_path, ending):
    record = fixes()
    writing.write(record, tmp_path / f"out{ending}")
    back = table.read((tmp_path / f"out{ending}").read_bytes()).sources["table"]
    for name in ("time", "sog", "water_speed", "position_std"):
        assert np.array_equal(getattr(back, name), getattr(record, name))
    for name in ("latitude", "longitude", "yaw_rate"):
        assert_allclose(getattr(back, name), getattr(record, name), rtol=4e-16)
    for name in ("cog", "heading"):
        turned = getattr(back, name) - getattr(record, name)
        assert_allclose(np.mod(turned + 1.0, 2 * np.pi) - 1.0, np.where(np.isnan(turned), np.nan, 0.0), atol=2e-15)


@pytest.mark.parametrize("ending", [".csv", ".parquet", ".gpx", ".geojson"])
def test_an_estimate_can_be_estimated_again(tmp_path, ending):
    """Tables hold every number to the last bit; GPX is version 1.0, which has speed and course."""
    record, path = motion(VESSELS), tmp_path / f"out{ending}"
    writing.write(record, path)
    frame, (log,) = record.to_frame(), survey(path)
    if ending == ".csv":
        assert pl.read_csv(path, schema=frame.schema).equals(frame)
    elif ending == ".parquet":
        assert pl.read_parquet(path).equals(frame)
    recording = log.recording
    (back,) = recording.sources.values()
    assert recording.skipped == {}
    assert np.array_equal(back.mmsi, record.mmsi)
    assert np.array_equal(back.time, record.time)
    assert np.array_equal(back.sog, record.sog)
    assert_allclose(back.latitude, record.latitude, rtol=4e-16)


def test_a_row_without_a_place_is_no_point_of_a_track(tmp_path):
    for ending in (".gpx", ".geojson"):
        writing.write(fixes(latitude=np.where(np.arange(N) == 4, np.nan, 0.5)), tmp_path / f"out{ending}")
        (log,) = survey(tmp_path / f"out{ending}")
        assert [len(each) for each in log.recording.sources.values()] == [N - 1]


def test_geojson_has_a_line_and_points(tmp_path):
    record = motion(VESSELS)
    writing.write(record, tmp_path / "out.geojson")
    features = json.loads((tmp_path / "out.geojson").read_text())["features"]
    lines = [each for each in features if each["geometry"]["type"] != "Point"]
    points = [each for each in features if each["geometry"]["type"] == "Point"]
    assert [line["properties"]["mmsi"] for line in lines] == [219000001, 235000002, 999999999]
    frame = record.to_frame()
    assert [point["geometry"]["coordinates"] for point in points] == [
        [row["lon_deg"], row["lat_deg"]] for row in frame.iter_rows(named=True)
    ]
    assert points[3]["properties"]["cog_deg"] is None
    assert points[0]["properties"]["sog_mps"] == record.sog[0]
    assert points[0]["properties"]["status"] == frame["status"][0]


def test_geojson_cuts_the_line_at_the_antimeridian(tmp_path):
    record = Fixes(np.arange(3.0), np.radians([0.0, 1.0, 2.0]), np.radians([179.0, -179.0, -178.0]))
    writing.write(record, tmp_path / "out.geojson")
    line = json.loads((tmp_path / "out.geojson").read_text())["features"][0]["geometry"]
    assert line["type"] == "MultiLineString"
    first, second = line["coordinates"]
    assert_allclose(first, [[179.0, 0.0], [180.0, 0.5]], atol=1e-9)
    assert_allclose(second, [[-180.0, 0.5], [-179.0, 1.0], [-178.0, 2.0]], atol=1e-9)


@pytest.mark.parametrize("ending", writing.endings())
def test_an_empty_record_can_be_written_and_a_replaced_file_keeps_its_permissions(tmp_path, ending):
    if ending == ".mcap":
        pytest.importorskip("mcap", reason="mcap is not installed")
    empty = motion().rows(slice(0, 0))
    path = tmp_path / f"out{ending}"
    path.touch(0o600)
    writing.write(empty, path)
    assert path.stat().st_mode & 0o777 == 0o600 and path.stat().st_size > 0, "a file that is replaced stays private"


def test_compressed_files_are_the_same_each_time(tmp_path):
    record = fixes()
    for name in ("a.csv.gz", "b.csv.gz", "c.csv"):
        writing.write(record, tmp_path / name)
    packed = (tmp_path / "a.csv.gz").read_bytes()
    assert packed == (tmp_path / "b.csv.gz").read_bytes() and packed[4:8] == bytes(4), "no time in it"
    assert gzip.decompress((tmp_path / "a.csv.gz").read_bytes()) == (tmp_path / "c.csv").read_bytes()


NOON = 1_719_835_200.0  # 2024-07-01 12:00 UTC
PLACE = (math.radians(63.44), math.radians(-10.25))


def test_sentences_as_the_standard_has_them():
    assert rmc(NOON + 0.2, *PLACE, 1852.0 / 3600.0, math.pi / 2.0) == sealed(
        "SWRMC,120000.200,A,6326.4000000,N,01015.0000000,W,1.000,90.00,010724,,,A"
    )
    assert gga(NOON, *PLACE, talker="GP").startswith("$GPGGA,120000.000,6326.4000000,N,01015.0000000,W,1,08,1.0,0.0,M")
    assert vtg(1.0, -math.pi / 2.0) == sealed("SWVTG,270.00,T,,M,1.944,N,3.600,K,A")
    assert rot(math.radians(1.0)) == sealed("SWROT,60.00,A")  # degrees a minute, + to starboard
    assert rot(math.radians(-0.5)) == sealed("SWROT,-30.00,A")
    assert hdt(math.radians(359.999)) == sealed("SWHDT,0.00,T")
    leg = Leg(-370.4, 0.0, 0.1, 1852.0, 0.2, 1852.0 / 3600.0, *PLACE, "A", "B")
    assert rmb(leg) == sealed("SWRMB,A,0.20,R,A,B,6326.4000000,N,01015.0000000,W,1.000,5.73,1.00,V,A")
    assert rmb(leg._replace(distance=1e7)).split(",")[10] == "999.900"
    assert rmb(leg._replace(bearing=math.nan)).split(",")[1] == "V"
    # An independent checksum: many receiver manuals contain this sentence.
    assert sealed("GPGLL,5057.970,N,00146.110,E,142451,A").strip() == "$GPGLL,5057.970,N,00146.110,E,142451,A*27"


def test_nothing_rolls_over_to_sixty_or_three_hundred_and_sixty():
    almost = math.radians(60.0 - 1e-12)
    assert ",6000.0000000,N,01000.0000000,W," in rmc(NOON - 1e-5, almost, math.radians(-10.0 + 1e-12))
    assert rmc(NOON - 1e-5, *PLACE).split(",")[1] == "120000.000"
    assert rmc(NOON - 1e-5, *PLACE, 1.0, -1e-9).split(",")[8] == "0.00"
    assert ",18000.0000000," in rmc(NOON, 0.0, math.pi)


def test_what_is_not_known_is_not_said():
    assert rmc(NOON, *PLACE) == sealed("SWRMC,120000.000,A,6326.4000000,N,01015.0000000,W,,,010724,,,A")
    assert rmc(NOON, math.nan, math.nan) == rmc(NOON, *PLACE, valid=False)
    assert ",V,,,,," in rmc(NOON, *PLACE, 1.0, 1.0, valid=False)
    assert vtg(1.0, 1.0, valid=False) == sealed("SWVTG,,T,,M,,N,,K,N")
    assert vtg(0.0) == sealed("SWVTG,,T,,M,0.000,N,0.000,K,A")
    assert rot() == sealed("SWROT,,V") and rot(0.1, valid=False) == sealed("SWROT,,V")
    refused = nmea0183.read((rmc(NOON, *PLACE, valid=False) + gga(NOON, *PLACE, valid=False)).encode())
    assert not any(fixes.has_position.any() for fixes in refused.sources.values())


@settings(max_examples=60, deadline=None)
@given(
    st.floats(-89.9, 89.9),
    st.floats(-179.99, 179.99),
    st.floats(0.0, 30.0),
    st.floats(-math.pi, math.pi),
    st.floats(-1.0, 1.0),
    st.floats(0.0, 1e8),
)
def test_what_is_written_is_read_back(latitude_deg, longitude_deg, sog, cog, rate, after):
    latitude, longitude, time = math.radians(latitude_deg), math.radians(longitude_deg), round(NOON + after, 3)
    log = rmc(time, latitude, longitude, sog, cog) + gga(time, latitude, longitude) + hdt(cog) + rot(rate)
    (fixes,) = nmea0183.read(log.encode()).sources.values()
    assert len(fixes) == 1
    assert fixes.time[0] == pytest.approx(time, abs=1e-6)
    assert fixes.latitude[0] == pytest.approx(latitude, abs=1.6e-11)  # half a ten-millionth of a minute
    assert fixes.longitude[0] == pytest.approx(longitude, abs=1.6e-11)
    assert fixes.sog[0] == pytest.approx(sog, abs=3e-4)
    assert math.cos(fixes.cog[0] - cog) == pytest.approx(1.0, abs=1e-7)
    assert math.cos(fixes.heading[0] - cog) == pytest.approx(1.0, abs=1e-7)
    assert fixes.yaw_rate[0] == pytest.approx(rate, abs=2e-6)
