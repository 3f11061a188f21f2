"""The filter without a profile on white noise of which it is not told: errors beside the paper's tuning, good fixes."""

import math

import numpy as np
import pytest

import steerway
from steerway.core import REJECTED
from steerway.estimation import FiveStateFilter, Profile
from tests.scenes import angle_error, turning

MOST, REFUSED = 1.1, 0.01
"""Error over that of the paper's tuning, and share of good fixes that are refused."""
SETTLING = 20.0
"""s."""


def errors(estimator, scene, fixes):
    """RMS of SOG (m/s) and COG (rad) after the start, and the share of refused fixes."""
    steps = np.diff(fixes.time, prepend=fixes.time[0]).tolist()
    rows = [estimator.row(*row) for row in zip(steps, fixes.latitude.tolist(), fixes.longitude.tolist(), strict=True)]
    sog, cog = np.array([values[2:4] for values, *_ in rows]).T
    late = fixes.time - fixes.time[0] > SETTLING
    known = np.isfinite(cog)
    assert known[late].mean() > 0.99
    squares = (sog - scene.sog)[late] ** 2, angle_error(cog, scene.cog)[late & known] ** 2
    refused = np.mean([status == REJECTED for *_, status in rows])
    return *(math.sqrt(each.mean()) for each in squares), refused


def beside_the_paper(scene, std, seeds, published="otter"):
    """Ratios of SOG and COG errors, of the paper's tuning told this noise, and the share of good fixes refused."""
    told = Profile.named(published).model_copy(update={"position_std": std})
    found = {
        kind: np.mean([errors(FiveStateFilter(profile), scene, scene.fixes(std, seed)) for seed in seeds], axis=0)
        for kind, profile in {"told": told, "untold": None}.items()
    }
    return *found["untold"][:2] / found["told"][:2], found["untold"][2]


@pytest.mark.parametrize("std", [0.05, 0.35, 2.0])
def test_untold_noise_costs_nothing(std):
    sog, cog, refused = beside_the_paper(turning(1.3, 0.4, 90.0), std, (51,))
    assert sog < MOST and cog < MOST and refused < REFUSED


def test_a_whole_record_is_estimated_as_by_estimate():
    fixes = turning(1.3, 0.4, 30.0).fixes(1.0, 52)
    np.testing.assert_array_equal(FiveStateFilter().filter(fixes).sog, steerway.estimate(fixes, causal=True).sog)
