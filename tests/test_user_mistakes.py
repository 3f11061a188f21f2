"""User mistakes in units, profiles and short logs: each gives a one-sentence error or is read correctly."""

import io
import math

import numpy as np
import polars as pl
import pytest
from numpy.testing import assert_allclose

import steerway
from steerway.core import Fixes
from steerway.core.testing import KNOT
from steerway.estimation import Profile
from steerway.estimation.testing import compare
from steerway.formats.testing import table
from tests.command_line import run
from tests.scenes import straight
from tests.sentences import only

T = 1672531201
NEEDED = "speed_noise = 1e-2\ncourse_rate_noise = 1e-2\n"


def log(names="time,lat,lon", speed=2.0, course=0.7, n=120, place=(63.4, 10.3), columns=()):
    """A straight track with 0.3 m of noise as CSV bytes; `columns` are more cells, equal in every row."""
    fixes = straight(speed, course, n - 1.0, 1.0, np.radians(place)).fixes(0.3, 5)
    rows = zip(fixes.time, np.degrees(fixes.latitude), np.degrees(fixes.longitude), strict=True)
    more = "".join(f",{each:.4f}" for each in columns)
    return "\n".join([names, *(f"{t:.0f},{a:.8f},{o:.8f}{more}" for t, a, o in rows)]).encode()


@pytest.mark.parametrize(("unit", "words"), [(1.0, "m/s"), (KNOT, "knots"), (1 / 3.6, "km/h")])
@pytest.mark.parametrize("name", ["sog", "Speed"])
def test_the_unit_of_a_bare_speed_is_that_of_the_positions(name, unit, words):
    recording = table.read(log(f"time,lat,lon,{name}", columns=(2.0 / unit,)))
    assert_allclose(only(recording).sog, 2.0, rtol=1e-3)
    assert f"{name} as sog in {words} (by the positions)" in recording.notes[0]
    assert "by the positions" not in table.read(log(f"time,lat,lon,{name}", columns=(30.0,))).notes[0]
    # A unit in the name is never overruled.
    assert_allclose(only(table.read(log("time,lat,lon,sog_kn", columns=(2.0,)))).sog, 2.0 * KNOT, rtol=1e-9)


def test_a_time_without_a_date_is_left_out():
    rows = f"time_s,lat_deg,lon_deg\n{T},54,10\n1e300,54,10\n-1e12,54,10\n{T + 1},54,10\n"
    recording = table.read(rows.encode())
    assert only(recording).time.tolist() == [T, T + 1]
    assert recording.skipped == {"time_s not understood": 2}
    frame = pl.DataFrame({"time_s": [float(T), 1e300, T + 1.0], "lat_deg": [54.0] * 3, "lon_deg": [10.0] * 3})
    file = io.BytesIO()
    frame.write_parquet(file)
    assert len(only(table.read(file.getvalue()))) == 2


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig"])
def test_a_table_of_a_spreadsheet_is_read(encoding):
    text = f"time_s,lat_deg,lon_deg\n{T},54,10\n{T + 1},54,10\n"
    assert len(steerway.read(text.encode(encoding))) == 2


@pytest.mark.parametrize("row", ["{t},54.1234\u0663,10.1", "{t},N 54 12.\u0663,10.1", "\u0662\u0660{t},54.1,10.1"])
def test_digits_of_other_scripts_are_no_numbers(row):
    rows = [row.format(t=T), *(f"{T + k},54.{k:05d},10.1" for k in range(1, 9))]
    read = steerway.read("\n".join(["time_s,lat_deg,lon_deg", *rows]).encode())
    assert len(read) == 8


def test_a_name_cannot_write_on_the_terminal(tmp_path):
    """Control characters are escaped, and brackets are not markup."""
    for name, shown in (("a\x1b[31m\n.csv", r"a\x1b[31m\n.csv"), ("[red].csv", "[red].csv")):
        path = tmp_path / name
        path.write_text("")
        code, _, said = run("info", path)
        assert (code, said) == (2, f"steerway: {tmp_path / shown}: is empty, expected a log\n")
        path.write_text(f"time_s,lat_deg,lon_deg,\x1b[2J\n{T},54,10,1\n")
        code, out, _ = run("info", path)
        assert code == 0 and shown in out and "\x1b" not in out and r"\x1b[2J" in out


@pytest.mark.parametrize("value", [0.7, math.degrees(0.7)])
def test_a_bare_course_may_be_in_radians(value):
    assert_allclose(only(table.read(log("time,lat,lon,cog", columns=(value,)))).cog, 0.7, atol=1e-4)


def test_positions_in_radians_are_refused_unless_named_so():
    rows = [f"{T + k},{math.radians(63.4 + 1e-5 * k):.10f},{math.radians(10.3):.10f}" for k in range(20)]
    with pytest.raises(steerway.InputError, match=r"'latitude' and 'longitude' .* may be radians, expected names"):
        table.read("\n".join(["time,latitude,longitude", *rows]).encode())
    fixes = only(table.read("\n".join(["time,lat_rad,lon_rad", *rows]).encode()))
    assert_allclose(np.degrees(fixes.latitude[0]), 63.4, atol=1e-6)
    assert len(only(table.read(log(place=(0.5, 10.3))))) == 120


def test_degrees_are_not_taken_for_radians_in_python():
    estimator = steerway.FiveStateFilter()
    with pytest.raises(ValueError, match=r"update takes radians: latitude is 63\.43"):
        estimator.update(63.43, 10.39)
    with pytest.raises(steerway.InputError, match="radians"):
        estimator.update(0.5, 10.39)
    estimator.update(math.radians(63.43), math.radians(10.39))
    with pytest.raises(steerway.InputError, match=r"Fixes.latitude has 63\.4 rad"):
        Fixes(np.arange(2.0), np.full(2, 63.4), np.full(2, 10.3))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (NEEDED + "position_std = 1e300", r"position_std is 1e\+300, expected at most 10000.0 m"),
        (NEEDED + "position_sdt = 0.5", "unknown key position_sdt, expected perhaps position_std"),
        (NEEDED, "position_std is missing, expected 1σ of the white noise of a fix"),
    ],
)
def test_a_profile_is_checked_like_a_scenario(tmp_path, text, message):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(steerway.InputError, match=f"mine.toml: {message}"):
        Profile.load(path)


@pytest.mark.parametrize(("count", "found"), [(1, "1 position"), (3, "3 positions at one time")])
def test_a_log_without_motion_is_refused(count, found):
    fixes = Fixes(np.full(count, 5.0), np.full(count, 0.5), np.full(count, 0.5))
    with pytest.raises(steerway.InputError, match=f"the log has {found}, expected at least two at different times"):
        steerway.estimate(fixes)


def test_a_comparison_of_a_slow_boat_says_that_nothing_is_left():
    fixes = only(table.read(log("time,lat,lon,sog_mps", speed=0.7, columns=(0.7,))))
    motion = steerway.estimate(fixes, "small-usv")
    assert compare(fixes, motion).sentences() == [
        ("rows compared", "none with the receiver's SOG above 1 m/s: largest 0.70 m/s")
    ]
    found = compare(fixes, motion, least_speed=0.3)
    assert found.compared > 100 and found.sog_rms < 0.3
    assert "nan" not in str(found.sentences())
