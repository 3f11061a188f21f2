"""Tables of loggers and tools: hemispheres and units in cells, clocks, units of time, and file forms."""

import math

import numpy as np
import polars as pl
import pytest
from numpy.testing import assert_allclose

import steerway
from steerway.core import InputError
from steerway.identification.testing import read_steering
from tests.command_line import run

START = 1_700_000_000  # 2023-11-14 22:13:20 UTC
SPEED, COURSE = 4.0, math.radians(45.0)
K = np.arange(40)


def track(step=1.0, latitude=-33.85, longitude=-70.2):
    """Seconds and degrees of a boat at 4 m/s on a course of 45°."""
    time = K * step
    north, east = SPEED * time * math.cos(COURSE), SPEED * time * math.sin(COURSE)
    return time, latitude + north / 110_900.0, longitude + east / (111_320.0 * math.cos(math.radians(latitude)))


def table(header, row, **at):
    """CSV with a row per fix, written by `row(seconds since the start, latitude, longitude in degrees)`."""
    return "\n".join([header, *(row(*each) for each in zip(*track(**at), strict=True))]).encode() + b"\n"


def clock(seconds, form="{:02d}:{:02d}:{:02d}"):
    return form.format(22, 13 + (20 + int(seconds)) // 60, (20 + int(seconds)) % 60)


def motion_of(data):
    """(latitude of the first fix (°), mean speed (m/s), course (°), fixes) read from data."""
    fixes = steerway.read(data)
    north = 6.354e6 * (fixes.latitude[-1] - fixes.latitude[0])
    east = 6.378e6 * math.cos(fixes.latitude[0]) * (fixes.longitude[-1] - fixes.longitude[0])
    speed = math.hypot(north, east) / (fixes.time[-1] - fixes.time[0])
    return math.degrees(fixes.latitude[0]), speed, math.degrees(math.atan2(east, north)), fixes


@pytest.mark.parametrize(("side", "latitude"), [("?", 33.85), ("N", -33.85), ("", 33.85), ("E", 33.85)])
def test_a_hemisphere_that_cannot_be_costs_its_row(side, latitude):
    text = f"time,lat,N/S,lon,E/W\n1,33,S,70,W\n2,{latitude},{side},70,W\n3,33,S,70,W\n"
    fixes = steerway.read(text.encode())
    assert fixes.time.tolist() == [1.0, 3.0] and any("N/S not understood" in note for note in fixes.notes)
    with pytest.raises(InputError, match="N/S not understood"):
        steerway.read(f"time,lat,N/S,lon\n1,{latitude},{side},70\n".encode())


def test_units_beside_numbers():
    def row(t, lat, lon):
        speed = "14.4 km/h" if t % 2 else "7.775 kn"
        return f"{START + t},{lat:.7f},{lon:.7f},{speed},45.0°,{700.0 if t % 2 else 0.7}{' mm' if t % 2 else ' m'}"

    fixes = steerway.read(table("time,lat,lon,speed,cog,position_std", row))
    assert fixes.sog == pytest.approx(SPEED, rel=1e-3) and np.degrees(fixes.cog) == pytest.approx(45.0)
    assert fixes.position_std == pytest.approx(0.7)
    fixes = steerway.read(table("time,lat,lon,speed", lambda t, lat, lon: f"{t},{lat},{lon},4.0 parsec"))
    assert np.isnan(fixes.sog).all() and any("'4.0 parsec' is not a valid sog" in note for note in fixes.notes)


@pytest.mark.parametrize(
    ("header", "row", "step"),
    [
        ("timestamp,time_utc_usec,lat,lon", lambda t: f"{20_471_648 + t * 1e6:.0f},{START + t:.1f}", 0.2),
        ("timestamp,time_utc_usec,lat,lon", lambda t: f"{20_471_648 + t * 1e6:.0f},{(START + t) * 1e6:.0f}", 0.2),
        ("timestamp,lat,lon", lambda t: f"{20_471_648 + t * 1e6:.0f}", 0.2),  # µs since the start
        ("t,lat,lon,sog_mps", lambda t: f"{5000 + t * 1e3:.0f}", 1.0),  # ms since the start
        ("time_ms,lat,lon", lambda t: f"{START + t:.1f}", 0.2),  # s, despite the name
        ("time_s,lat,lon", lambda t: f"{(START + t) * 1e3:.0f}", 1.0),
        ("t,lat,lon", lambda t: f"{t:.1f}", 0.2),
        ("t,lat,lon", lambda t: f"{t:.0f}", 900.0),  # a tracker
        ("t,date,lat,lon", lambda t: f"{t:.0f},2023-11-14", 1.0),
    ],
)
def test_the_unit_of_a_time_gives_possible_steps_and_speeds(header, row, step):
    speed = "" if "sog" not in header else f",{SPEED}"
    data = table(header, lambda t, lat, lon: f"{row(t)},{lat:.8f},{lon:.8f}{speed}", step=step)
    _, speed, course, _ = motion_of(data)
    assert speed == pytest.approx(SPEED, rel=0.02) and course == pytest.approx(45.0, abs=1.0)


@pytest.mark.parametrize(("day", "start"), [("231114", START), ("291100", 975_536_000)])
def test_dates_of_six_digits_are_in_the_order_that_can_be(day, start):
    """29 November 2000: a month has no day 00."""
    fixes = steerway.read(table("date,time,lat,lon", lambda t, lat, lon: f"{day},{clock(t)},{lat},{lon}"))
    assert fixes.time[0] == start


def test_a_boat_at_anchor_keeps_the_seconds_of_its_clock():
    data = table("t,lat,lon", lambda t, lat, lon: f"{t:.0f},{-33.85 + 1e-7 * (t % 3)},-70.2", step=10.0)
    fixes = steerway.read(data)
    assert fixes.time[-1] - fixes.time[0] == 10.0 * K[-1]


def test_a_track_of_the_robotic_sailing_rules():
    """Across midnight at the end of a month; a damaged line is skipped."""

    def row(t, lat, lon):
        second = 86_380 + int(t)
        day, second = (31, second) if second < 86_400 else (1, second - 86_400)
        return f"{second // 3600:02d}{second // 60 % 60:02d}{second % 60:02d}{day:02d},{lat * 1e7:.0f},{lon * 1e7:.0f}"

    latitude, speed, course, fixes = motion_of(table("", row).lstrip() + b"2400,torn\n")
    assert (latitude, speed, course) == pytest.approx((-33.85, SPEED, 45.0), rel=0.01)
    assert np.diff(fixes.time) == pytest.approx(1.0)
    assert any("no month and year" in note for note in fixes.notes)
    assert "skipped 1 × line not understood" in fixes.notes and len(fixes) == len(K)


def test_frames_are_read_as_tables_are():
    when = pl.from_epoch(pl.Series("when", 1.7e12 + 500.0 * np.arange(60.0)).cast(pl.Int64), "ms")
    frame = pl.DataFrame({"timestamp": when, "lat": 54.0 + 1e-5 * np.arange(60), "lon": 10.0, "hdop": 1.2, "name": "x"})
    fixes = steerway.Fixes.from_frame(frame)
    assert_allclose(fixes.time, 1.7e9 + 0.5 * np.arange(60))
    assert_allclose(np.degrees(fixes.latitude), frame["lat"])
    assert_allclose(fixes.position_std, 1.8)
    assert "columns not used: name" in fixes.notes
    again = steerway.Fixes.from_frame(fixes.to_frame())
    assert_allclose(again.longitude, fixes.longitude, rtol=1e-15)
    with pytest.raises(InputError, match="no column for time"):
        steerway.read(frame.drop("timestamp"))
    logs = steerway.survey(frame)
    assert [log.recording.format for log in logs] == ["frame"]


def test_frames_of_pandas_with_an_index_of_local_time_there_and_back():
    pd = pytest.importorskip("pandas", reason="pandas is no package of an extra")
    when = pd.date_range("2023-11-14T23:13:20", periods=60, freq="500ms", tz="Europe/Oslo")
    fixes = steerway.Fixes.from_frame(pd.DataFrame({"lat": 54.0 + 1e-5 * np.arange(60), "lon": 10.0}, when))
    assert_allclose(fixes.time, 1.7e9 + 0.5 * np.arange(60))
    assert str(steerway.estimate(fixes, "small-usv").to_pandas().index[0]) == "2023-11-14 22:13:20+00:00"


FORMS = {
    "plain.csv": pl.DataFrame.write_csv,
    "tabs.csv": lambda frame, path: frame.write_csv(path, separator="\t"),
    "commas.csv": lambda frame, path: path.write_text(frame.write_csv(separator=";").replace(".", ",")),
    "log.parquet": pl.DataFrame.write_parquet,
    # Despite the name of the column: the size of the numbers shows their unit.
    "ms.csv": lambda frame, path: frame.with_columns((1e3 * pl.col("time_s")).round().cast(pl.Int64)).write_csv(path),
}


def test_a_manoeuvre_is_read_from_every_form_of_a_table(tmp_path):
    columns = {"time_s": 1.7e9 + 0.5 * K, "rudder_deg": 10.0 * (-1.0) ** (K // 8), "heading_deg": 0.25 * K}
    for name, write in FORMS.items():
        write(pl.DataFrame(columns), tmp_path / name)
        found = read_steering(tmp_path / name)
        assert_allclose(found.time, columns["time_s"], err_msg=name)
        assert_allclose(np.degrees((found.rudder, found.angle)), [columns["rudder_deg"], columns["heading_deg"]])
    for content in (b"PAR1 and no more", b"\x00\x01\x02", b"a;b\n1;2\n"):
        (tmp_path / "log").write_bytes(content)
        for kind in ("yaw", "surge"):
            code, out, said = run("identify", kind, tmp_path / "log")
            assert (code, out) == (2, "") and said.count("\n") == 1 and f"{tmp_path / 'log'}" in said
