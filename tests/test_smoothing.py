"""What every smoother owes, whatever is inside: it betters the filter, and troubles cost it next to nothing."""

import numpy as np
import pytest

import steerway
from steerway.core import InputError, wrap_array
from steerway.estimation import FiveStateFilter, Profile
from steerway.sensors import Gnss
from steerway.sensors.testing import Fault
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


FAULTS = {
    "no fixes for 30 s": {"kind": "dropout", "duration": 30.0},
    "one fix 50 m off": {"kind": "jump", "size": 50.0},
    "fixes 50 m off for 5 s": {"kind": "jump", "size": 50.0, "duration": 5.0},
    "every later fix 10 m off": {"kind": "step", "size": 10.0},
}
"""Faults that begin at 150 s."""


@pytest.mark.parametrize("fault", FAULTS)
def test_troubles_cost_next_to_nothing(fault):
    voyage, _ = O05.sailed(1)
    gnss = {"rate": O05.scenario.rate, "white": O05.position_std}
    # In good fixes the fault begins after their end, so that the noise is the same.
    good, disturbed = (
        voyage.fixes(Gnss(**gnss, faults=[Fault(start=start, **FAULTS[fault])]), 1) for start in (1e9, 150.0)
    )
    chosen = np.isin(voyage.time, disturbed.time)
    there = TrueMotion(**{name: getattr(voyage, name)[chosen] for name in voyage.__dataclass_fields__})
    usual, troubled = (
        root_mean_square(steerway.estimate(given, O05.profile, smooth=True), truth)
        for given, truth in ((good, voyage), (disturbed, there))
    )
    assert np.all(troubled < 1.3 * usual)


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
