"""Aids in the inference of vessel and receiver: their likelihood, and what is fitted with them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from steerway.core import wrap
from steerway.estimation import FiveStateFilter, choose_profile, estimate
from steerway.estimation.testing import NLLS, companion_of, run_rows
from steerway_studies.testing import GYRO_BIAS, GYRO_STD, PROFILE, SLOW, VELOCITY_STD, aided_fixes
from steerway_studies.testing import cells_judged as judged
from steerway_studies.testing import scenarios_sail as sail

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


def between(fixes, every):
    """The same with only every so manieth position, the aids as they were."""
    silent = np.arange(len(fixes)) % every > 0
    places = {name: np.where(silent, np.nan, getattr(fixes, name)) for name in ("latitude", "longitude")}
    return replace(fixes, **places)


def likeliest(fixes, aid):
    return max(choose_profile(fixes, aid=aid).structures, key=lambda each: each.weight)


@pytest.mark.parametrize("seed", [0, 6, 11])
def test_a_gyro_shows_the_few_turns_of_a_short_log(seed):
    """Logs of five minutes of whose turns the positions alone say too little: half of it goes straight."""
    voyage = sail(SLOW, seed)
    fixes = aided_fixes(voyage, seed, GYRO_BIAS)
    profile = choose_profile(fixes, aid=("yaw_rate",))
    found = sum(each.weight * each.values["yaw_rate_std"] for each in profile.structures)
    assert found == pytest.approx(GYRO_STD, rel=0.15)
    sums = judged(estimate(fixes, profile, aid=("yaw_rate",)), voyage, SLOW)
    straight, turn = np.degrees(np.sqrt(sums[:, 1] / sums[:, 3]))
    assert straight < 0.6
    assert turn < 1.05


def test_the_noise_of_a_receivers_velocity_is_found():
    voyage = sail(SLOW, 4)
    values = likeliest(aided_fixes(voyage, 4), ("sog", "cog")).values
    assert values["sog_std"] == pytest.approx(VELOCITY_STD, rel=0.1)
    assert values["velocity_std"] == pytest.approx(VELOCITY_STD, rel=0.1)
    rough = replace(
        aided_fixes(voyage, 4), sog=voyage.sog + np.random.default_rng(1).normal(0.0, 0.3, len(voyage.time))
    )
    assert likeliest(rough, ("sog", "cog")).values["sog_std"] == pytest.approx(0.3, rel=0.1)


def test_aids_that_are_not_there_change_nothing():
    fixes = replace(aided_fixes(voyage_of(2, 120.0), 2), yaw_rate=None)
    plain = choose_profile(fixes)
    assert choose_profile(fixes, aid=("yaw_rate",)) == plain
    assert choose_profile(fixes, aid=("heading", "water_speed")) == plain


@pytest.mark.xfail(strict=True, reason="0.063 of 0.1°/s: quick wander is as probable as a gyro's noise, 1 row a second")
def test_aids_between_the_fixes_are_used():
    voyage = sail(SLOW, 0)
    values = likeliest(between(aided_fixes(voyage, 0), 5), ("yaw_rate",)).values
    assert values["yaw_rate_std"] == pytest.approx(GYRO_STD, rel=0.15)
    assert values["fix_std"] == pytest.approx(0.5, rel=0.1)
