"""What every smoother owes, whatever is inside: it betters the filter, and troubles cost it next to nothing."""

import math
from dataclasses import replace

import numpy as np
import pytest

import steerway
from steerway.core import Fixes, InputError, radii, wrap_array
from steerway.estimation import FiveStateFilter, Profile
from steerway_studies.testing import CELLS, TrueMotion, errors
from tests.scenes import straight, turning

ENDS = 100
"""Rows at both ends that count for nothing: there the filter from the past, or the one from the future, begins."""
MIDDLE = slice(ENDS, -ENDS)
PROFILES = {
    "two motion models": {},
    "one motion model": None,
    "slow error of the receiver": {"error_std": 0.3, "error_time": 20.0},
}


def profile_of(name, kind):
    """The true parameters of a cell; those of the average; or with an error of the receiver that she does not have."""
    profile = CELLS[name].profile
    return profile.on_average if PROFILES[kind] is None else profile.model_copy(update=PROFILES[kind])


def output(motion):
    """(3, n) SOG, COG and course rate."""
    return np.stack([motion.sog, motion.cog, motion.course_rate])


def deviations(motion):
    return np.stack([motion.sog_std, motion.cog_std, motion.course_rate_std])


def apart(one, other):
    """(3, n) difference of two estimates (3, n)."""
    difference = one - other
    difference[1] = wrap_array(difference[1])
    return difference


@pytest.mark.parametrize("kind", PROFILES)
def test_smoothed_is_better_and_surer_than_causal(kind):
    profile = profile_of("o05", kind)
    squares, variances = [], []
    for seed in range(3):
        voyage, fixes = CELLS["o05"].sailed(seed)
        both = [steerway.estimate(fixes, profile, smooth=smooth) for smooth in (False, True)]
        found = [np.square(errors(*output(each), voyage))[:, MIDDLE] for each in both]
        squares.append(np.nanmean(found, axis=2))
        variances.append(np.nanmean([deviations(each)[:, MIDDLE] ** 2 for each in both], axis=2))
    squares, variances = np.array(squares), np.array(variances)
    causal, smoothed = np.sqrt(squares.mean(axis=0))
    assert np.all(smoothed < 0.85 * causal)
    assert np.all(squares[:, 1] < squares[:, 0]), "in every single voyage"
    assert np.all(variances[:, 1] < variances[:, 0])


def test_a_record_is_smoothed_unless_causal_is_asked_for():
    _, fixes = CELLS["o05"].sailed(0)
    profile = CELLS["o05"].profile
    by_default, smoothed = steerway.estimate(fixes, profile), steerway.estimate(fixes, profile, smooth=True)
    causal, not_smoothed = (
        steerway.estimate(fixes, profile, causal=True),
        steerway.estimate(fixes, profile, smooth=False),
    )
    np.testing.assert_array_equal(output(by_default), output(smoothed))
    np.testing.assert_array_equal(output(causal), output(not_smoothed))
    np.testing.assert_array_equal(output(causal), output(FiveStateFilter(profile).filter(fixes)))
    assert not np.array_equal(causal.sog, smoothed.sog, equal_nan=True)
    with pytest.raises(InputError, match="causal and smooth are both true"):
        steerway.estimate(fixes, profile, causal=True, smooth=True)


O05 = CELLS["o05"]


def root_mean_square(motion, voyage):
    """(3,) of the errors of SOG, COG and course rate after the first half minute."""
    found = errors(*output(motion), voyage)[:, voyage.time > 30.0]
    return np.sqrt(np.mean(np.square(found), axis=1))


BEGIN = 150.0
"""s at which a fault of the fixes begins."""
_POLAR_RADIUS = 6_399_593.6
"""Radius of curvature at the pole (WGS-84), m."""
_FROM_POLE = 1000.0


def _moved(fixes: Fixes, north, east) -> Fixes:
    meridian, prime_vertical = radii(0.0)
    return replace(fixes, latitude=fixes.latitude + north / meridian, longitude=fixes.longitude + east / prime_vertical)


def _rows(voyage: TrueMotion, fixes: Fixes, chosen) -> tuple[TrueMotion, Fixes]:
    columns = {name: getattr(voyage, name)[chosen] for name in voyage.__dataclass_fields__}
    return TrueMotion(**columns), fixes.rows(chosen)


def dropout(voyage, fixes, chance):
    """No fixes for 30 s."""
    return _rows(voyage, fixes, (voyage.time < BEGIN) | (voyage.time >= BEGIN + 30.0))


def jump(voyage, fixes, chance):
    """One fix 50 m off."""
    return voyage, _displaced(voyage, fixes, chance, 50.0, 0.1)


def burst(voyage, fixes, chance):
    """Fixes 50 m off for 5 s."""
    return voyage, _displaced(voyage, fixes, chance, 50.0, 5.0)


def step(voyage, fixes, chance):
    """Every later fix 10 m off."""
    return voyage, _displaced(voyage, fixes, chance, 10.0, math.inf)


def _displaced(voyage, fixes, chance, by, duration):
    direction = chance.uniform(-math.pi, math.pi)
    during = (voyage.time >= BEGIN) & (voyage.time < BEGIN + duration)
    return _moved(fixes, during * by * math.cos(direction), during * by * math.sin(direction))


def antimeridian(voyage, fixes, chance):
    """A track across 180° of longitude."""
    return voyage, replace(fixes, longitude=wrap_array(fixes.longitude + math.pi - fixes.longitude[len(fixes) // 2]))


def pole(voyage, fixes, chance):
    """A track a kilometre from the North Pole, where the direction of north changes along it."""
    meridian, prime_vertical = radii(0.0)
    away, aside = _FROM_POLE - fixes.latitude * meridian, fixes.longitude * prime_vertical
    there = replace(
        fixes, latitude=math.pi / 2.0 - np.hypot(away, aside) / _POLAR_RADIUS, longitude=np.arctan2(aside, away)
    )
    north_turned = np.unwrap(np.arctan2(voyage.east, _FROM_POLE - voyage.north))
    return replace(voyage, cog=voyage.cog + north_turned), there


@pytest.mark.parametrize("trouble", [burst, step, jump, dropout, antimeridian, pole])
def test_troubles_cost_next_to_nothing(trouble):
    voyage, fixes = O05.sailed(1)
    truth, disturbed = trouble(voyage, fixes, np.random.default_rng(1))
    usual, troubled = (
        root_mean_square(steerway.estimate(given, O05.profile, smooth=True), there)
        for given, there in ((fixes, voyage), (disturbed, truth))
    )
    assert np.all(troubled < 1.3 * usual)


def backwards(fixes: Fixes) -> Fixes:
    """The same voyage as a film that runs backwards."""
    time = fixes.time[0] + fixes.time[-1] - fixes.time[::-1]
    return Fixes(time, fixes.latitude[::-1].copy(), fixes.longitude[::-1].copy())


@pytest.mark.parametrize("kind", ["one motion model", "two motion models"])
def test_it_knows_no_direction_of_time(kind):
    """Backwards the boat sails the opposite courses and turns the other way; RMS of the difference in deviations.

    Not to the last digit: filters begin at one end, and a fix that seems wild from one side need not from the other."""
    profile = profile_of("o05", kind)
    _, fixes = CELLS["o05"].sailed(0)
    there, back = (steerway.estimate(each, profile, smooth=True) for each in (fixes, backwards(fixes)))
    mirrored = np.stack([back.sog, back.cog + math.pi, -back.course_rate])[:, ::-1]
    difference = apart(output(there), mirrored) / deviations(there)
    assert np.all(np.sqrt(np.nanmean(difference[:, MIDDLE] ** 2, axis=1)) < 0.3)


ALIKE, ALIKE_DEVIATIONS = 0.03, 0.01
"""How far apart estimates (in deviations) and deviations (as a part of them) may be that should be the same."""
ONE_MODEL = Profile(speed_noise=1e-4, course_rate_noise=1e-6, course_rate_decay=0.2, position_std=0.14)
SAME_TWICE = {
    "turn_time": 20.0,
    "straight_time": 50.0,
    "turn_speed_noise": ONE_MODEL.speed_noise,
    "turn_course_rate_noise": ONE_MODEL.course_rate_noise,
    "turn_course_rate_decay": ONE_MODEL.course_rate_decay,
}
BUT_ONE = {
    "both models alike": SAME_TWICE,
    "both alike, changing all the time": SAME_TWICE | {"turn_time": 1.0, "straight_time": 1.0},
    "turns next to never": SAME_TWICE | {"turn_time": 1.0, "straight_time": 1e12, "turn_course_rate_noise": 1e-3},
}


@pytest.mark.parametrize("two", BUT_ONE)
def test_where_there_is_one_motion_model_it_is_the_smoother_of_one(two):
    """At a speed and with fixes at which the form of a correction does not matter, and with no fix near the gate."""
    profile = ONE_MODEL.model_copy(update=BUT_ONE[two])
    for scene in (straight(5.0, 0.7, 300.0), turning(5.0, 0.7, 300.0, decay=0.2, density=1e-6)):
        fixes = scene.fixes(0.1, 1)
        one, other = (steerway.estimate(fixes, each, smooth=True) for each in (ONE_MODEL, profile))
        difference = apart(output(one), output(other)) / deviations(one)
        assert np.max(np.abs(difference[:, MIDDLE])) < ALIKE
        assert np.all(np.abs(deviations(other) / deviations(one) - 1.0)[:, MIDDLE] < ALIKE_DEVIATIONS)


def test_the_time_of_a_fix_is_as_uncertain_where_modes_are_alike():
    """Way along the course is then less certain than across it, by half as much as the fixes are."""
    one = ONE_MODEL.model_copy(update={"time_std": 0.1})
    fixes = turning(5.0, 0.7, 300.0, decay=0.2, density=1e-6).fixes(0.1, 0)
    surely, plain, two = (
        steerway.estimate(fixes, each, smooth=True) for each in (ONE_MODEL, one, one.model_copy(update=SAME_TWICE))
    )
    assert np.all(np.abs(deviations(two) / deviations(plain) - 1.0)[:, MIDDLE] < ALIKE_DEVIATIONS)
    assert np.mean(two.sog_std[MIDDLE] / surely.sog_std[MIDDLE]) > 1.05
    assert np.max(np.abs(apart(output(plain), output(two)) / deviations(plain))[:, MIDDLE]) < ALIKE
