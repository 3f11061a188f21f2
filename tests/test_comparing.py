"""Results side by side: the command `plot`, numbers, notebooks; the motion of the hull under an antenna that rolls."""

import json
import math
from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from numpy.testing import assert_allclose

import steerway
from steerway.core import Fixes, InputError
from steerway.core.testing import displaced_all
from steerway.estimation.testing import compare
from steerway.formats.testing import read_tracks
from steerway.report.testing import differences, statistics, statistics_table
from tests.command_line import run
from tests.scenes import straight, turning, usual_profile


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A log, its causal and its smoothed estimate."""
    path = tmp_path_factory.mktemp("results")
    fixes = turning(2.0, 0.5, 120.0).fixes(0.3, 1)
    steerway.write(fixes, path / "log.csv")
    steerway.write(steerway.estimate(fixes, "otter", causal=True), path / "causal.csv")
    steerway.write(steerway.estimate(fixes, "otter", smooth=True), path / "smooth.parquet")
    return path


def test_differences_are_those_of_shifted_tracks(folder):
    (track,) = read_tracks(folder / "smooth.parquet")
    moved = replace(track, name="moved", latitude=track.latitude + 1e-6, sog=track.sog + 0.25, cog=track.cog + 6.2)
    found = differences(track, moved)
    known = np.isfinite(track.sog)
    assert known.mean() > 0.9 and (np.isfinite(found["sog"]) == known).all()
    assert_allclose(found["sog"][known], 0.25, atol=1e-12)
    assert_allclose(found["cog"][np.isfinite(track.cog)], 6.2 - 2.0 * math.pi, atol=1e-9)
    assert_allclose(found["position"], 6.39, atol=0.03)
    expected = {"n": 4, "max": 4.0, "median": 2.0, "rms": math.sqrt(26.0 / 4.0)}
    assert expected.items() <= statistics(np.array([-3.0, 4.0, np.nan, 0.0, 1.0])).items()
    with pytest.raises(InputError, match="do not overlap in time"):
        differences(track, replace(track, time=track.time + 1e6))


def test_the_command_prints_and_draws(folder, tmp_path):
    files = [folder / name for name in ("smooth.parquet", "causal.csv", "log.csv")]
    code, out, err = run("plot", *files, "-o", tmp_path / "all.svg", "--differences", tmp_path / "off.pdf", "--json")
    assert (code, err) == (0, "")
    rows = json.loads(out)
    tracks = [each for path in files for each in read_tracks(path)]
    assert rows == json.loads(json.dumps(statistics_table(tracks)).replace("NaN", "null"))
    assert {(row["track"], row["quantity"]) for row in rows} == {
        *(("causal.csv", name) for name in ("position", "SOG", "COG", "course rate")),
        ("log.csv", "position"),
    }
    assert (tmp_path / "all.svg").read_bytes().startswith(b"<?xml")
    assert (tmp_path / "off.pdf").read_bytes().startswith(b"%PDF")


def test_a_notebook_shows_extent_first_rows_and_what_a_filter_estimates():
    fixes = straight(2.0, 0.0, 40.0).fixes(0.0, 0)
    assert repr(fixes) == "Fixes: 201 rows, 2023-11-14T22:13:20Z to 2023-11-14T22:14:00Z, 5 Hz"
    motion = steerway.estimate(fixes, "otter", causal=True)
    assert repr(motion).startswith("Motion: 201 rows, 2023-11-14T22:13:20Z to")
    assert "<td>2023-11-14 22:13:20</td>" in motion._repr_html_()
    found, empty = motion.summary(), motion.rows(slice(0)).summary()
    assert (found["start"], found["rows"], empty["start"]) == ("2023-11-14T22:13:20Z", 201, None)
    assert np.isnan(motion.sog).any() and found["sog_median_mps"] == pytest.approx(np.nanmedian(motion.sog))
    assert math.isnan(empty["sog_median_mps"]) and repr(fixes.rows(slice(0))) == "Fixes: no rows"
    estimator = steerway.FiveStateFilter("otter")
    assert repr(estimator) == "FiveStateFilter('otter'): not started"
    for latitude, longitude in zip(fixes.latitude, fixes.longitude, strict=True):
        estimator.predict(0.2)
        estimator.update(latitude, longitude)
    assert repr(estimator).startswith("FiveStateFilter('otter'): SOG 2.0") and "°/s (1σ)" in repr(estimator)
    assert len(steerway.plot(motion, fixes).axes) == 4 and steerway.plot(motion, kind="track").axes
    with pytest.raises(InputError, match="expected signals or track"):
        steerway.plot(motion, kind="map")


def test_an_estimate_is_compared_with_the_truth_of_a_run(tmp_path):
    scene = straight(2.0, 0.5 * math.pi, 200.0, 2.0)
    frame = scene.fixes(0.0, 0).to_frame().select("time_s", true_lat_deg="lat_deg", true_lon_deg="lon_deg")
    frame = frame.with_columns(true_sog_mps=pl.lit(2.0), true_cog_deg=pl.lit(90.0), true_course_rate_dps=pl.lit(0.0))
    frame.write_parquet(tmp_path / "run.parquet")
    steerway.write(scene.fixes(0.05, 5), tmp_path / "log.csv")
    arguments = str(tmp_path / "log.csv"), "--truth", str(tmp_path / "run.parquet"), "--profile", "small-usv"
    code, out, err = run("compare", *arguments, "--json")
    assert (code, err) == (0, "")
    rows = {each["quantity"]: each for each in json.loads(out)}
    assert rows["SOG"]["rms"] < 0.2 and rows["COG"]["rms"] < 5.0 and rows["position"]["rms"] < 0.1
    assert all(each["within_2sigma_pct"] > 90.0 for each in rows.values())
    code, out, _ = run("compare", *arguments)
    assert code == 0 and "within ± 2σ" in out


def test_a_comparison_of_a_slow_boat_says_that_nothing_is_left():
    fixes = straight(0.7, 0.7, 119.0, 1.0).fixes(0.3, 5)
    fixes = replace(fixes, sog=np.full(len(fixes), 0.7))
    motion = steerway.estimate(fixes, "small-usv")
    assert compare(fixes, motion).sentences() == [
        ("rows compared", "none with the receiver's SOG above 1 m/s: largest 0.70 m/s")
    ]
    found = compare(fixes, motion, least_speed=0.3)
    assert found.compared > 100 and found.sog_rms < 0.3 and "nan" not in str(found.sentences())


SPEED = 1.5
SWING = 0.1
PERIOD = 2.5


@pytest.fixture(scope="module")
def fixes():
    """North at 1.5 m/s, the antenna 0.1 m athwart; the receiver's velocity is that of its antenna, to 0.02 m/s."""
    time, rng = np.arange(0.0, 200.0, 0.2), np.random.default_rng(2)
    phase = 2.0 * np.pi * time / PERIOD
    east, across = SWING * np.sin(phase), SWING * 2.0 * np.pi / PERIOD * np.cos(phase)
    north, east = SPEED * time + rng.normal(0.0, 0.01, len(time)), east + rng.normal(0.0, 0.01, len(time))
    velocity = rng.normal(0.0, 0.02, (2, len(time))) + np.array([np.full(len(time), SPEED), across])
    placed = Fixes(1.7e9 + time, *displaced_all(0.9, 0.2, north, east))
    return replace(placed, sog=np.hypot(*velocity), cog=np.arctan2(*velocity[::-1]))


ROLLS = usual_profile(
    "base", "wander", "antenna", fix_std=0.01, antenna_std=0.07, antenna_period=PERIOD, wander_std=1e-3
)
STIFF = usual_profile("base", "wander", fix_std=0.01)


def test_the_motion_is_the_hulls_and_like_is_compared_with_like(fixes):
    """Means over the swing: what is left is noise, where the antenna's course itself is 7° (RMS) from the hull's."""
    motion = steerway.estimate(fixes, ROLLS)
    inner = motion.rows(slice(100, -100))
    assert np.degrees(np.sqrt(np.mean(inner.cog**2))) < 1.0, "the antenna's course swings by 9.5°"
    assert np.sqrt(np.mean((inner.sog - SPEED) ** 2)) < 0.01
    apart, alike = compare(fixes, motion), compare(fixes, motion, swing=4.0)
    assert np.degrees(apart.cog_rms) > 6.0 and np.degrees(alike.cog_rms) < 0.35 * np.degrees(apart.cog_rms)
    assert alike.compared == apart.compared
    vessels = replace(fixes, mmsi=np.repeat([211000001, 211000002], 500))
    two = compare(vessels, steerway.estimate(vessels, ROLLS), swing=4.0)
    assert np.degrees(two.cog_rms) < 0.5 * np.degrees(apart.cog_rms)


@pytest.mark.parametrize(("given", "is_of_hull"), [(ROLLS, True), (STIFF, False)])
def test_commands_say_whose_motion_it_is(fixes, given, is_of_hull, tmp_path):
    log, path = tmp_path / "log.csv", tmp_path / "mine.toml"
    steerway.write(fixes, log)
    given.save(path)
    _, out, _ = run("estimate", log, "--profile", path)
    assert ("of the hull: the antenna rolls" in out) == is_of_hull
    _, out, _ = run("compare", log, "--profile", path)
    assert ("compared as 4 s means" in out) == is_of_hull
    _, out, _ = run("compare", log, "--profile", path, "--json")
    found = json.loads(out)
    assert found["of_hull"] == is_of_hull and found["smoothed"]
    assert (found["cog_rms_deg"] < 3.0) == is_of_hull
