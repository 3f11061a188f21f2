"""Aids in the selection of a profile: their likelihood, and what is fitted with them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from steerway.core.angles import wrap
from steerway.estimation import FiveStateFilter, choose_profile
from steerway.estimation.course.motion.layout import NLLS
from steerway.estimation.course.replay import run_rows
from steerway.estimation.course.update.aids import companion_of
from steerway.estimation.selection.excerpts import moving, spaced
from steerway_studies.estimator_limits.aided import GYRO_BIAS, GYRO_STD, PROFILE, VELOCITY_STD, aided_fixes
from steerway_studies.estimator_limits.cells import judged
from steerway_studies.estimator_limits.scenarios import SLOW, sail

ALL = ("sog", "cog", "yaw_rate")
ONE = PROFILE.turning


def nll_of(value, mean, variance) -> float:
    return 0.5 * ((value - mean) ** 2 / variance + math.log(2.0 * math.pi * variance))


def predicted(x, p, profile, gyro) -> dict:
    """Mean and variance of each aid, by state (n,) and covariance (n, n)."""
    h = np.zeros(len(x))
    h[4] = h[gyro] = 1.0
    return {
        "sog": (x[2], p[2, 2] + profile.sog_std**2),
        "cog": (x[3], p[3, 3] + profile.velocity_std**2 / x[2] ** 2),
        "yaw_rate": (h @ x, h @ p @ h + profile.yaw_rate_std**2),
    }


@pytest.mark.parametrize("aid", ALL)
@pytest.mark.parametrize("profile", [ONE, PROFILE], ids=["one mode", "two"])
def test_the_nll_is_that_of_the_predicted_density_of_an_aid(aid, profile):
    fixes = between(aided_fixes(voyage_of(3, 60.0), 3), 2)
    parameters = profile.parameters((aid, "yaw_rate"))
    gyro = companion_of(parameters[0], "yaw_rate")
    alone = np.where(fixes.has_position, np.nan, getattr(fixes, aid))
    fixes = replace(fixes, **{other: alone if other == aid else None for other in ALL})
    found = run_rows(parameters, (aid, "yaw_rate"), fixes).aid_nll
    estimator = FiveStateFilter(profile, (aid, "yaw_rate"))
    compared = 0
    for k in range(len(fixes)):
        if k:
            estimator.predict(fixes.time[k] - fixes.time[k - 1])
        if fixes.has_position[k]:
            estimator.update(fixes.latitude[k], fixes.longitude[k])
            continue
        value = getattr(fixes, aid)[k]
        if not estimator.underway:
            estimator.aid_by(**{aid: value})
            continue
        bank, n = estimator._bank, estimator._bank.shape[-1]
        count = max(len(parameters) - 1, 1)
        modes = [(1.0, bank[0])] if count == 1 else list(zip(bank[0, n + NLLS, :count], bank[1:], strict=False))
        density = 0.0
        for probability, mode in modes:
            upper = np.triu(mode[:n])
            mean, variance = predicted(mode[n], upper + np.triu(upper, 1).T, profile, gyro)[aid]
            error = wrap(value - mean) if aid == "cog" else value - mean
            density += probability * math.exp(-nll_of(error, 0.0, variance))
        assert found[k] == pytest.approx(min(-math.log(density), 10.0), rel=1e-9, abs=1e-9)
        compared += 1
        estimator.aid_by(**{aid: value})
    assert compared > 120
    assert np.count_nonzero(found) == compared


def voyage_of(seed, duration):
    return sail(replace(SLOW, duration=duration), seed)


def test_without_aids_the_likelihood_is_of_the_fixes_alone():
    fixes = aided_fixes(voyage_of(1, 30.0), 1)
    assert not run_rows(PROFILE.parameters(), (), fixes).aid_nll.any()


@pytest.mark.parametrize("seed", [0, 6, 11])
def test_a_gyro_tells_the_few_turns_of_a_short_log(seed):
    """Logs of five minutes of whose turns the positions alone say too little: half of it goes straight."""
    voyage = sail(SLOW, seed)
    fixes = aided_fixes(voyage, seed, GYRO_BIAS)
    profile = choose_profile(fixes, aid=("yaw_rate",))
    assert profile.turn_course_rate_noise == pytest.approx(SLOW.profile.turn_course_rate_noise, rel=0.5)
    assert profile.course_rate_noise == pytest.approx(SLOW.profile.course_rate_noise, rel=0.5)
    assert profile.yaw_rate_std == pytest.approx(GYRO_STD, rel=0.15)
    sums = judged(FiveStateFilter(profile, ("yaw_rate",)).filter(fixes), voyage, SLOW)
    straight, turn = np.degrees(np.sqrt(sums[:, 1] / sums[:, 3]))
    assert straight < 0.6
    assert turn < 1.05


def test_how_well_a_receiver_tells_its_velocity_is_found():
    voyage = sail(SLOW, 4)
    profile = choose_profile(aided_fixes(voyage, 4), aid=("sog", "cog"))
    assert profile.sog_std == pytest.approx(VELOCITY_STD, rel=0.1)
    assert profile.velocity_std == pytest.approx(VELOCITY_STD, rel=0.1)
    rough = replace(
        aided_fixes(voyage, 4), sog=voyage.sog + np.random.default_rng(1).normal(0.0, 0.3, len(voyage.time))
    )
    assert choose_profile(rough, aid=("sog", "cog")).sog_std == pytest.approx(0.3, rel=0.1)


def test_aids_that_say_nothing_change_nothing():
    fixes = replace(aided_fixes(voyage_of(2, 120.0), 2), yaw_rate=None)
    assert choose_profile(fixes, aid=("yaw_rate",)) == choose_profile(fixes)
    assert choose_profile(fixes, aid=("heading", "water_speed")) == choose_profile(fixes)


def between(fixes, every):
    """The same with only every so manieth position, the aids as they were."""
    silent = np.arange(len(fixes)) % every > 0
    places = {name: np.where(silent, np.nan, getattr(fixes, name)) for name in ("latitude", "longitude")}
    return replace(fixes, **places)


def test_aids_between_the_fixes_are_heard():
    voyage = sail(SLOW, 0)
    profile = choose_profile(between(aided_fixes(voyage, 0), 5), aid=("yaw_rate",))
    assert profile.turn_course_rate_noise == pytest.approx(SLOW.profile.turn_course_rate_noise, rel=0.5)
    assert profile.position_std == pytest.approx(0.5, rel=0.1)


def test_positions_apart_keep_the_aids_between_them():
    fixes = between(aided_fixes(voyage_of(1, 20.0), 1), 2)
    apart = spaced(fixes, 1.0, 0.2)
    assert len(apart) == len(fixes)
    assert np.diff(apart.time[apart.has_position]).min() >= 0.95
    assert apart.has_position.sum() == 17  # every 1.2 s, as every second row has one
    assert np.isfinite(apart.yaw_rate).all()
    positions = fixes.rows(fixes.has_position)
    np.testing.assert_array_equal(spaced(positions, 1.0, 1.0).time, apart.time[apart.has_position])


def test_rows_without_a_position_move_as_those_before_them():
    fixes = aided_fixes(voyage_of(1, 60.0), 1)
    sparse = between(fixes, 5)
    assert (moving(sparse)[::5] == moving(sparse.rows(sparse.has_position))).all()
    assert moving(sparse).mean() == pytest.approx(moving(fixes).mean(), abs=0.05)
