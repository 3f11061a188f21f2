"""Time stamps and velocities of receivers that are late, rounded or good enough to aid; other aids in the inference."""

import json
import math
from dataclasses import replace
from functools import cache

import numpy as np
import polars as pl
import pytest

import steerway
from steerway.core import Fixes
from steerway.estimation import choose_profile, estimate
from steerway.estimation.testing import LogEstimator, Track, lateness, on_time, regular_times, velocity_of
from steerway.sensors import Gnss, Instrument
from steerway_studies.testing import SLOW
from steerway_studies.testing import limits_judged as judged
from steerway_studies.testing import scenarios_sail as sail
from tests import scenes
from tests.command_line import run
from tests.golden import missed, no_worse
from tests.scenes import angle_error, turning


def late_receiver(late, duration=300.0):
    """Fixes whose SOG and COG are those of `late` seconds ago."""
    scene = turning(3.0, 0.5, duration)
    cog = np.interp(scene.time - late, scene.time, scene.cog)
    return replace(scene.fixes(0.1, 1), sog=scene.sog, cog=cog)


def test_nothing_is_said_of_a_receiver_in_time_nor_without_one():
    fixes = late_receiver(0.0)
    silent = replace(fixes, sog=None, cog=None)
    for each in (fixes, silent, replace(fixes, mmsi=np.ones(len(fixes))), fixes.rows(slice(0, 50))):
        assert math.isnan(lateness(each).cog) and math.isnan(lateness(each).sog)


def test_instruments_beside_a_late_receiver_keep_their_time():
    fixes = late_receiver(0.0, 10.0)
    moved = on_time(replace(fixes, heading=fixes.cog), 0.3)
    np.testing.assert_allclose(moved.time[moved.has_position], fixes.time - 0.3)
    np.testing.assert_allclose(moved.time[np.isfinite(moved.heading)], fixes.time)


def test_options_of_estimate(tmp_path):
    """On a table whose receiver doubts a tenth of its fixes, and whose course is two seconds late."""
    fixes, path = late_receiver(2.0), tmp_path / "log.csv"
    std = np.where(np.arange(len(fixes)) % 200 >= 180, 20.0, 1.0)
    doubted = int((std > 1.0).sum())
    replace(fixes, position_std=std).to_frame().write_csv(path)
    _, given, _ = run("estimate", path, "--profile", "otter")
    assert f"{doubted} fixes of poor reported accuracy" in given and "COG lags the estimate by 2.0 s" in given
    runs = {}
    for name, options in {"plain": [], "alike": ["--no-accuracy"], "late": ["--latency", "1.5"]}.items():
        out = tmp_path / f"{name}.csv"
        code, given, said = run("estimate", path, "--profile", "otter", "-o", out, "--json", *options)
        assert code == 0, said
        runs[name] = json.loads(given), pl.read_csv(out)
    assert runs["plain"][0]["fixes_doubted"] == doubted and runs["alike"][0]["fixes_doubted"] == 0
    assert runs["plain"][0]["receiver_cog_late_s"] == pytest.approx(2.0, abs=0.11)
    assert not np.allclose(runs["plain"][1]["sog_mps"], runs["alike"][1]["sog_mps"], equal_nan=True)
    np.testing.assert_allclose(runs["plain"][1]["time_s"] - runs["late"][1]["time_s"], 1.5, atol=1e-6)
    assert run("estimate", path, "--latency", "-1")[0] == 2


SETTLED = 100


def received(time):
    """To the second, up to 0.4 s after they were measured."""
    delay = np.random.default_rng(1).uniform(0.0, 0.4, len(time))
    return np.maximum.accumulate(np.floor(time + delay))


def in_whole_seconds(time):
    return np.floor(time)


other_maximum = missed("10.3 mm/s, with the true times 1.8: another maximum of the fit")


@pytest.mark.parametrize(
    ("rate", "stamped", "inferred"),
    [
        (1.0 / 1.016, received, False),
        (5.0, in_whole_seconds, False),
        pytest.param(1.0 / 1.016, received, True, marks=pytest.mark.study),
        pytest.param(5.0, in_whole_seconds, True, marks=[other_maximum, pytest.mark.study]),
    ],
)
def test_fixes_at_regular_times_under_irregular_stamps(rate, stamped, inferred):
    scene = turning(2.5, 0.3, 900.0, rate=rate, seed=4, density=2e-4)
    true = scene.fixes(0.2, 4)
    fixes = replace(true, time=stamped(scene.time))
    track = Track(fixes, ())
    assert track.regular and np.ptp(track.record.time - scene.time) < 0.25
    motions = [(LogEstimator(each) if inferred else scenes.small_craft()[2]).motion(each) for each in (true, fixes)]
    best, error = (math.sqrt(np.nanmean((each.sog - scene.sog)[SETTLED:] ** 2)) for each in motions)
    no_worse(error < 6.0 * best, (error, best))
    assert error < 1.1 * best
    np.testing.assert_array_equal(motions[1].time, fixes.time)


def test_stamps_of_irregular_fixes_stay():
    """Fixes are lost one by one, or come whenever a watch thinks that they are needed."""
    scene = turning(2.5, 0.3, 900.0, rate=1.0, seed=5, density=2e-4)
    fixes = scene.fixes(0.2, 5)
    kept = np.random.default_rng(5).random(len(fixes)) > 0.15
    assert not Track(fixes.rows(kept), ()).regular
    smart = np.cumsum(np.random.default_rng(6).choice([1, 2, 3, 5, 8], 400))
    assert not Track(fixes.rows(smart[smart < len(fixes)]), ()).regular


def test_at_rest_nothing_tells():
    time = 1e9 + 1.016 * np.arange(2000.0)
    north, east = np.random.default_rng(7).normal(0.0, 0.5, (2, len(time)))
    for stamped in (received, in_whole_seconds):
        assert regular_times(stamped(time), north, east) is None


def test_gaps_stay_gaps():
    scene = turning(2.5, 0.3, 900.0, rate=5.0, seed=4, density=2e-4)
    fixes = scene.fixes(0.05, 4)
    fixes = fixes.rows((fixes.time < fixes.time[0] + 400.0) | (fixes.time > fixes.time[0] + 430.0))
    track = Track(replace(fixes, time=np.floor(fixes.time)), ())
    assert track.regular
    assert np.ptp(track.record.time - fixes.time) < 0.35


VELOCITY_STD = 0.05
GYRO_STD, GYRO_BIAS = math.radians(0.1), math.radians(0.3)


def aided_fixes(voyage, seed):
    """Fixes of 0.5 m with the receiver's own velocity and a gyro's rate beside them."""
    gnss = Gnss(rate=SLOW.rate, white=0.5, velocity_std=VELOCITY_STD)
    velocity = {"north_velocity": voyage.sog * np.cos(voyage.cog), "east_velocity": voyage.sog * np.sin(voyage.cog)}
    fixes = gnss.fixes(voyage.time, voyage.north, voyage.east, seed, **velocity)
    gyro = Instrument(rate=SLOW.rate, white=GYRO_STD, bias=GYRO_BIAS)
    _, rate = gyro.measured(voyage.time, voyage.course_rate, [seed, 3])
    return Fixes(fixes.time, fixes.latitude, fixes.longitude, sog=fixes.sog, cog=fixes.cog, yaw_rate=rate)


def likeliest(fixes, aid):
    return max(choose_profile(fixes, aid=aid).structures, key=lambda each: each.weight)


@pytest.mark.study
def test_a_gyro_shows_the_few_turns_of_a_short_log():
    """Five minutes of whose turns the positions alone say too little: half of them goes straight."""
    voyage = sail(SLOW, 6)
    fixes = aided_fixes(voyage, 6)
    profile = choose_profile(fixes, aid=("yaw_rate",))
    found = sum(each.weight * each.values["yaw_rate_std"] for each in profile.structures)
    assert found == pytest.approx(GYRO_STD, rel=0.15)
    sums = judged(estimate(fixes, profile, aid=("yaw_rate",), causal=True), voyage, SLOW)
    straight, turn = np.degrees(np.sqrt(sums[:, 1] / sums[:, 3]))
    assert straight < 0.6
    assert turn < 1.05


@pytest.mark.study
@missed("0.063 of 0.1°/s: quick wander is as probable as a gyro's noise, 1 row a second")
def test_aids_between_the_fixes_are_used():
    voyage = sail(SLOW, 0)
    fixes = aided_fixes(voyage, 0)
    silent = np.where(np.arange(len(fixes)) % 5 > 0, np.nan, 0.0)  # all but every fifth position
    fixes = replace(fixes, latitude=fixes.latitude + silent, longitude=fixes.longitude + silent)
    values = likeliest(fixes, ("yaw_rate",)).values
    no_worse(values["yaw_rate_std"] > 0.62 * GYRO_STD, values)
    assert values["yaw_rate_std"] == pytest.approx(GYRO_STD, rel=0.15)
    assert values["fix_std"] == pytest.approx(0.5, rel=0.1)


def with_velocity(north, east):
    """The fixes with this velocity (m/s) as SOG and COG."""
    return replace(scenes.small_craft()[1], sog=np.hypot(north, east), cog=np.arctan2(east, north))


@cache
def doppler():
    scene = scenes.small_craft()[0]
    noise = np.random.default_rng(3).normal(0.0, 0.05, (2, len(scene.time)))
    return with_velocity(scene.sog * np.cos(scene.cog) + noise[0], scene.sog * np.sin(scene.cog) + noise[1])


def differences(span):
    """Velocity from the fix so many rows before."""
    fixes = scenes.small_craft()[1]
    radius = 6.37e6 * np.array([[1.0], [math.cos(fixes.latitude[0])]])
    place = radius * np.array([fixes.latitude, fixes.longitude])
    return with_velocity(*np.pad(place[:, span:] - place[:, :-span], ((0, 0), (span, 0))) / (0.2 * span))


def rms(errors):
    return math.sqrt(np.nanmean(errors[SETTLED:] ** 2))


def test_a_doppler_velocity_is_used():
    scene, fixes, alone = scenes.small_craft()
    first = slice(300)
    estimator = LogEstimator(doppler().rows(first), aid=("auto",))
    assert estimator.aid == ("sog", "cog")
    plain, aided = alone.motion(fixes.rows(first)), estimator.motion(doppler().rows(first))
    assert rms(angle_error(aided.cog, scene.cog[first])) < 0.6 * rms(angle_error(plain.cog, scene.cog[first]))
    covered = angle_error(aided.cog, scene.cog[first])[100:] < 1.96 * aided.cog_std[100:]
    assert covered.mean() > 0.9


def test_differences_of_the_same_positions_are_not():
    structures = scenes.small_craft()[2].profile.structures
    assert velocity_of(doppler(), structures)
    assert not any(velocity_of(differences(span), structures) for span in (1, 15))


def test_without_a_velocity_and_with_a_profile_nothing_changes():
    _, fixes, alone = scenes.small_craft()
    assert not velocity_of(fixes, alone.profile.structures)
    np.testing.assert_array_equal(
        steerway.estimate(doppler(), "small-usv", aid=("auto",)).sog, steerway.estimate(fixes, "small-usv").sog
    )
