"""The receiver's velocity is used where it predicts the fixes, and not where it is a difference of them."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import steerway
from steerway.estimation.testing import LogEstimator, Track, velocity_of
from tests.command_line import run
from tests.scenes import angle_error, turning

SEED = 3


@cache
def sortie():
    scene = turning(1.5, 0.7, 300.0, seed=SEED)
    return scene, scene.fixes(0.5, SEED)


@cache
def unaided():
    _, fixes = sortie()
    estimator = LogEstimator(fixes)
    return estimator, estimator.motion(fixes)


def with_velocity(north, east):
    """The fixes with this velocity (m/s) as SOG and COG."""
    return replace(sortie()[1], sog=np.hypot(north, east), cog=np.arctan2(east, north))


@cache
def doppler():
    scene, _ = sortie()
    noise = np.random.default_rng(SEED).normal(0.0, 0.05, (2, len(scene.time)))
    return with_velocity(scene.sog * np.cos(scene.cog) + noise[0], scene.sog * np.sin(scene.cog) + noise[1])


def differences(span):
    """Velocity from the fix so many rows before."""
    record = Track(sortie()[1], ()).record
    moved = [np.concatenate([np.zeros(span), column[span:] - column[:-span]]) for column in (record.north, record.east)]
    return with_velocity(*(each / (0.2 * span) for each in moved))


def rms(errors):
    return math.sqrt(np.nanmean(errors[100:] ** 2))


def test_a_doppler_velocity_is_used():
    scene, _ = sortie()
    estimator = LogEstimator(doppler(), aid=("auto",))
    assert estimator.aid == ("sog", "cog")
    plain, aided = unaided()[1], estimator.motion(doppler())
    assert rms(angle_error(aided.cog, scene.cog)) < 0.6 * rms(angle_error(plain.cog, scene.cog))
    covered = angle_error(aided.cog, scene.cog)[100:] < 1.96 * aided.cog_std[100:]
    assert covered.mean() > 0.9


@pytest.mark.parametrize("span", [1, 5, 15])
def test_differences_of_the_same_positions_are_not(span):
    fixes = differences(span)
    estimator, motion = unaided()
    assert velocity_of(fixes, estimator.inference.structures) is None
    np.testing.assert_array_equal(steerway.estimate(fixes, aid=("auto",)).sog, motion.sog)


def test_without_a_velocity_nothing_changes():
    _, fixes = sortie()
    np.testing.assert_array_equal(steerway.estimate(fixes, aid=("auto",)).sog, unaided()[1].sog)
    np.testing.assert_array_equal(
        steerway.estimate(doppler(), "small-usv", aid=("auto",)).sog, steerway.estimate(fixes, "small-usv").sog
    )


def test_the_command_hints_at_it(tmp_path):
    log = tmp_path / "sortie.csv"
    doppler().rows(slice(600)).to_frame().write_csv(log)
    assert "--aid auto" in run("estimate", log)[1]
    code, out, _ = run("estimate", log, "--aid", "auto")
    assert code == 0 and "--aid auto" not in out and "SOG within" in out
