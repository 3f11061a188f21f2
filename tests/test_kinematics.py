"""The current triangle of P1: (3)–(10) and (28), for motion in every direction, astern too."""

import math

import pytest

from steerway.core import wrap
from steerway.core.testing import GroundMotion, heading_for, in_body, over_ground, turning_rate

HEADINGS = [0.3 * k - 3.0 for k in range(21)]


def motion(heading, surge, sway, current=(0.0, 0.0), **rest):
    north, east = over_ground(surge, sway, heading)
    known = {"north": 0.0, "east": 0.0, "yaw_rate": 0.0, "course_rate": 0.0, "roll": 0.0, "pitch": 0.0} | rest
    return GroundMotion(
        heading=heading,
        north_velocity=north + current[0],
        east_velocity=east + current[1],
        surge=surge,
        sway=sway,
        **known,
    )


@pytest.mark.parametrize(("surge", "sway"), [(2.0, 0.5), (2.0, -0.5), (-1.0, 0.3), (-1.0, -0.3), (0.0, 1.0)])
def test_course_is_heading_and_crab_angle(surge, sway):
    """P1 (5)–(7): without current crab angle and sideslip are one, and right astern too."""
    for heading in HEADINGS:
        m = motion(heading, surge, sway)
        assert m.sog == pytest.approx(math.hypot(surge, sway)) == m.water_speed
        assert wrap(m.cog - heading - m.crab_angle) == pytest.approx(0.0, abs=1e-12)
        assert m.crab_angle == pytest.approx(math.atan2(sway, surge)) == m.sideslip
        assert m.along == pytest.approx(surge)


def test_a_boat_that_crabs_across_a_current_has_no_sideslip():
    """Heading 30° up against the current to make good a track due north: P1 figure 1."""
    m = motion(math.radians(-30.0), 2.0, 0.0, current=(0.0, 1.0))
    assert m.cog == pytest.approx(0.0, abs=1e-12)
    assert m.crab_angle == pytest.approx(math.radians(30.0))
    assert m.sideslip == 0.0
    assert m.sog == pytest.approx(math.sqrt(3.0))


def test_body_and_ground_are_each_others_inverse():
    for heading in HEADINGS:
        assert in_body(*over_ground(1.2, -0.4, heading), heading) == pytest.approx((1.2, -0.4))
    assert in_body(1.0, 0.0, math.pi / 2) == pytest.approx((0.0, -1.0))  # a current to the north comes from starboard


def test_course_rate_is_yaw_rate_and_the_crab_angles_rate():
    """P1 (28): r = ω_χ − β̇, by differences on a boat whose sway grows as she turns."""
    surge, rate, h = 2.0, 0.2, 1e-6

    def velocity(t):
        return over_ground(surge, 0.3 * t, 0.7 + rate * t)

    now, later = velocity(1.0), velocity(1.0 + h)
    acceleration = [(b - a) / h for a, b in zip(now, later, strict=True)]
    crab_rate = (math.atan2(0.3 * (1.0 + h), surge) - math.atan2(0.3, surge)) / h
    assert turning_rate(*now, *acceleration) == pytest.approx(rate + crab_rate, rel=1e-5)


@pytest.mark.parametrize("current", [(0.3, -0.5), (-0.6, 0.1), (0.0, 0.0)])
def test_the_heading_against_a_current_makes_the_course_good(current):
    for course in HEADINGS:
        heading, speed = heading_for(course, 1.2, *current)
        north, east = over_ground(1.2, 0.0, heading)
        made_good = north + current[0], east + current[1]
        assert made_good == pytest.approx((speed * math.cos(course), speed * math.sin(course)))
        assert heading_for(course, 0.0, *current)[0] == course


@pytest.mark.parametrize("to_starboard", [1.0, -1.0])
def test_across_a_current_faster_than_the_boat_the_heading_is_across(to_starboard):
    heading, speed = heading_for(0.0, 1.0, 0.2, 5.0 * to_starboard)
    assert heading == pytest.approx(-math.asin(0.98) * to_starboard)
    assert speed == pytest.approx(0.2 + math.sqrt(1.0 - 0.98**2))
