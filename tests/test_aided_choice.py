"""What aids say counts in the choice of a profile: the likelihood of it, and what is found by it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from steerway.core.angles import wrap
from steerway.estimation import FiveStateFilter, choose_profile
from steerway.estimation.course.motion.layout import GYRO_STATE
from steerway.estimation.course.replay import run_rows
from steerway.estimation.selection.excerpts import moving, spaced
from steerway_studies.estimator_limits.aided import GYRO_BIAS, GYRO_STD, PROFILE, VELOCITY_STD, aided_fixes
from steerway_studies.estimator_limits.cells import judged
from steerway_studies.estimator_limits.scenarios import SLOW, sail

ALL = ("sog", "cog", "yaw_rate")
ONE = PROFILE.turning


def surprise_of(value, mean, variance) -> float:
    return (value - mean) ** 2 / variance + math.log(2.0 * math.pi * variance)


def foretold(x, p, profile, gyro) -> dict:
    """Mean and variance of what each aid says, by state (n,) and covariance (n, n)."""
    h = np.zeros(len(x))
    h[4] = h[gyro] = 1.0
    return {
        "sog": (x[2], p[2, 2] + profile.sog_std**2),
        "cog": (x[3], p[3, 3] + profile.velocity_std**2 / x[2] ** 2),
        "yaw_rate": (h @ x, h @ p @ h + profile.yaw_rate_std**2),
    }


@pytest.mark.parametrize("aid", ALL)
@pytest.mark.parametrize("profile", [ONE, PROFILE], ids=["one manner", "two"])
def test_the_surprise_is_that_of_the_density_an_aid_was_given(aid, profile):
    fixes = between(aided_fixes(voyage_of(3, 60.0), 3), 2)
    model = profile.model((aid, "yaw_rate"))
    gyro = int(model[..., GYRO_STATE].flat[0])
    alone = np.where(fixes.has_position, np.nan, getattr(fixes, aid))
    fixes = replace(fixes, **{other: alone if other == aid else None for other in ALL})
    found = run_rows(model, (aid, "yaw_rate"), fixes).aid_surprise
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
        memory = estimator._memory
        n = memory.shape[-1]
        modes = [(1.0, memory)] if memory.ndim == 2 else list(zip(memory[0, n + 9], memory[1:], strict=False))
        modes = modes[: 1 if memory.ndim == 2 else len(model) - 1]
        density = 0.0
        for probability, mode in modes:
            upper = np.triu(mode[:n])
            mean, variance = foretold(mode[n], upper + np.triu(upper, 1).T, profile, gyro)[aid]
            error = wrap(value - mean) if aid == "cog" else value - mean
            density += probability * math.exp(-0.5 * surprise_of(error, 0.0, variance))
        assert found[k] == pytest.approx(min(-2.0 * math.log(density), 20.0), rel=1e-9, abs=1e-9)
        compared += 1
        estimator.aid_by(**{aid: value})
    assert compared > 120
    assert np.count_nonzero(found) == compared


def voyage_of(seed, duration):
    return sail(replace(SLOW, duration=duration), seed)


def test_without_aids_nothing_is_surprising_but_the_fixes():
    fixes = aided_fixes(voyage_of(1, 30.0), 1)
    assert not run_rows(PROFILE.model(), (), fixes).aid_surprise.any()


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
