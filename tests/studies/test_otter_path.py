"""otter-path with few seeds: course guidance finds the crab angle, heading guidance leaves its offset."""

import math

import pytest

from steerway_studies.testing import otter_path

LOOKAHEAD, PathCase = otter_path.LOOKAHEAD, otter_path.PathCase


@pytest.mark.parametrize(("noise", "most"), [(0.1, 0.2), (0.5, 0.55)])
@pytest.mark.parametrize("speed", LOOKAHEAD)
def test_course_guidance_stays_on_the_leg(noise, most, speed):
    found = otter_path.leg(PathCase(noise, speed), 1)
    assert found.rms <= most
    # What the current triangle says: 0.3 m/s across, and 5 N of wind that the hull answers by drifting more.
    assert math.sin(found.crab) == pytest.approx(0.3 / speed, abs=0.03)
    assert abs(found.mean) < 0.5 * most


@pytest.mark.parametrize("speed", LOOKAHEAD)
def test_heading_guidance_leaves_its_offset_and_adaptive_guidance_does_not(speed):
    heading = otter_path.leg(PathCase(0.1, speed, "heading"), 1)
    assert heading.mean / (LOOKAHEAD[speed] * math.tan(heading.crab)) == pytest.approx(1.0, abs=0.2)
    assert heading.mean > 3.0  # to the side the current sets
    assert otter_path.leg(PathCase(0.1, speed, "adaptive"), 1).rms <= 0.5
    assert otter_path.leg(PathCase(0.1, speed, "integral"), 1).rms <= 0.7


def test_a_leg_that_was_never_sailed_is_a_miss(monkeypatch):
    monkeypatch.setattr(otter_path, "JUDGED", (150.0, 5000.0))
    assert math.isnan(otter_path.leg(PathCase(0.1, 1.2), 1).rms)
