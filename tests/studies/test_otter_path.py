"""otter-path with few seeds: course guidance finds the crab angle, heading guidance leaves its offset."""

import math

import pytest

from steerway_studies.testing import BOAT_LOOKAHEAD as LOOKAHEAD
from steerway_studies.testing import PathCase, boat


@pytest.mark.parametrize(("noise", "most"), [(0.1, 0.2), (0.5, 0.55)])
@pytest.mark.parametrize("speed", LOOKAHEAD)
def test_course_guidance_stays_on_the_leg(noise, most, speed):
    found = boat.leg(PathCase(noise, speed), 1)
    assert found.rms <= most
    # What the current triangle says: 0.3 m/s across, and 5 N of wind that the hull answers by drifting more.
    assert math.sin(found.crab) == pytest.approx(0.3 / speed, abs=0.03)
    assert abs(found.mean) < 0.5 * most


@pytest.mark.parametrize("speed", LOOKAHEAD)
def test_heading_guidance_leaves_its_offset_and_adaptive_guidance_does_not(speed):
    heading = boat.leg(PathCase(0.1, speed, "heading"), 1)
    assert heading.mean / (LOOKAHEAD[speed] * math.tan(heading.crab)) == pytest.approx(1.0, abs=0.2)
    assert heading.mean > 3.0  # to the side the current sets
    assert boat.leg(PathCase(0.1, speed, "adaptive"), 1).rms <= 0.5
    assert boat.leg(PathCase(0.1, speed, "integral"), 1).rms <= 0.7


def test_a_leg_that_was_never_sailed_is_a_miss(monkeypatch):
    monkeypatch.setattr(boat, "JUDGED", (150.0, 5000.0))
    assert math.isnan(boat.leg(PathCase(0.1, 1.2), 1).rms)
