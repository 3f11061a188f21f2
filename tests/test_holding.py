"""A position held by thrust and steering: what is wanted of the boat, and what comes of it in a current."""

import math

import numpy as np
import pytest

from steerway.control.testing import PositionHold
from steerway.core import Estimate
from steerway.core.testing import over_ground


def estimate(north, east):
    return Estimate(*[math.nan] * 9, 1.0, 0.0, 0.1, 0.0, north, east, 0.0, 1.0)


def test_in_a_current_she_goes_as_fast_as_the_water_with_her_bow_up_it():
    hold = PositionHold(5.0, 0.8)
    assert hold.step(0.0, 2.0, estimate(0.0, 0.5)) == pytest.approx((-0.5 * math.pi, 0.5))
    for bearing in np.linspace(-3.0, 3.0, 7):
        wanted = hold.step(3.0, bearing, estimate(0.0, 0.5))
        north, east = over_ground(wanted.water_speed, 0.0, wanted.heading)
        nearer = north * math.cos(bearing) + (east + 0.5) * math.sin(bearing)
        assert nearer > 0.15 and math.cos(wanted.heading + 0.5 * math.pi) > 0.7
    assert hold.step(20.0, 0.5 * math.pi, estimate(0.0, 0.5)).heading == pytest.approx(0.5 * math.pi)  # far: back
