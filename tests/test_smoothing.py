"""What every smoother owes, whatever is inside: it betters the filter, and troubles cost it next to nothing."""

import numpy as np
import pytest

import steerway
from steerway.core import InputError
from steerway.estimation import FiveStateFilter
from steerway.sensors import Gnss
from steerway.sensors.testing import Fault
from steerway_studies.testing import CELLS, TrueMotion, errors

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
