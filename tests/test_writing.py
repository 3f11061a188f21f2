"""Written files: round trips to the last bit, files complete or absent, endings."""

import gzip
import json

import numpy as np
import polars as pl
import pytest
from numpy.testing import assert_allclose

from steerway.core import Fixes, Motion
from steerway.formats.testing import formats_writing as writing
from steerway.formats.testing import survey, table

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


@pytest.mark.parametrize("ending", [".csv", ".csv.gz", ".parquet"])
@pytest.mark.parametrize("record", [fixes(), motion(), motion(VESSELS)], ids=["fixes", "motion", "vessels"])
def test_tables_hold_every_number_to_the_last_bit(tmp_path, ending, record):
    path = tmp_path / f"out{ending}"
    writing.write(record, path)
    frame = record.to_frame()
    back = pl.read_parquet(path) if ending == ".parquet" else pl.read_csv(path, schema=frame.schema)
    assert back.equals(frame)


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
    """GPX: version 1.0, which has speed and course."""
    record = motion(VESSELS)
    writing.write(record, tmp_path / f"out{ending}")
    (log,) = survey(tmp_path / f"out{ending}")
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
def test_an_empty_record_can_be_written(tmp_path, ending):
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
    assert (tmp_path / "a.csv.gz").read_bytes() == (tmp_path / "b.csv.gz").read_bytes()
    assert gzip.decompress((tmp_path / "a.csv.gz").read_bytes()) == (tmp_path / "c.csv").read_bytes()
