"""Errata of the papers' switching rules: what the printed form does, and that the corrected one is the product's."""

import math

import pytest

from steerway.core import leg_direction, track_errors
from steerway.guidance import Mission, Route
from steerway.guidance.testing import line_of_sight
from steerway_studies.testing import course_autopilot as printed

P1_WAYPOINTS = ([0.0, 2000.0, 5000.0, 3000.0, 6000.0, 10000.0], [0.0, 0.0, 5000.0, 8000.0, 12000.0, 12000.0])


def switches_along_p1(as_printed):
    """Waypoints that a ship takes which makes good the desired course at once, with one form of (45) and (46)."""
    corners, leg = list(zip(*P1_WAYPOINTS, strict=True)), 0
    north, east = 0.0, 0.0
    for _ in range(3000):
        (n0, e0), (n1, e1) = corners[leg], corners[leg + 1]
        direction = leg_direction(n0, e0, n1, e1)
        _, cross_track = track_errors(north, east, n0, e0, direction)
        course, _ = line_of_sight(direction, cross_track, 0.0, 800.0)
        north, east = north + 7.7 * math.cos(course), east + 7.7 * math.sin(course)
        along = printed.along_track(north, east, n0, e0, direction, as_printed)
        if printed.switches(math.hypot(n1 - n0, e1 - e0), along, 50.0, as_printed):
            leg += 1
            if leg + 1 == len(corners):
                break
    return leg


def test_erratum_p1_46_no_waypoint_switches():
    assert switches_along_p1(as_printed=True) == 0
    assert switches_along_p1(as_printed=False) == 5


def test_erratum_p1_45_a_ship_behind_the_leg_switches():
    assert printed.switches(2000.0, -1960.0, 50.0)
    assert not printed.switches(2000.0, -1960.0, 50.0, printed=False)
    assert printed.switches(2000.0, 1960.0, 50.0, printed=False)
    mission = Mission(Route([0.0, 2000.0], [0.0, 0.0], acceptance=50.0))
    mission.step(-1960.0, 0.0, 1.0)
    assert not mission.log.passages


def test_the_corrected_along_track_error_is_the_products():
    for place in [(10.0, -4.0, 3.0, 2.0, 0.6), (-7.0, 1.0, 0.0, 0.0, -2.0)]:
        assert printed.along_track(*place, printed=False) == pytest.approx(track_errors(*place)[0])
