"""Time stamps that are rounded or those of receipt, of fixes at regular times; and stamps that tell irregular ones."""

import math
from dataclasses import replace

import numpy as np
import pytest

from steerway.estimation.testing import LogEstimator, Track, regular_times
from tests import fitted
from tests.scenes import turning

SETTLED = 100


def received(time):
    """To the second, up to 0.4 s after they were measured."""
    delay = np.random.default_rng(1).uniform(0.0, 0.4, len(time))
    return np.maximum.accumulate(np.floor(time + delay))


def in_whole_seconds(time):
    return np.floor(time)


other_maximum = pytest.mark.xfail(strict=True, reason="3.3 mm/s, with the true times 1.6: another maximum of the fit")


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
    motions = [(LogEstimator(each) if inferred else fitted.small_craft()[2]).motion(each) for each in (true, fixes)]
    best, error = (math.sqrt(np.nanmean((each.sog - scene.sog)[SETTLED:] ** 2)) for each in motions)
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
