"""Missions with stays between them."""

import math

import pytest

from steerway.core import InputError
from steerway.guidance import Mission, Phase, Route
from steerway.guidance.testing import Voyage


def route():
    return Route([0.0, 50.0, 50.0, 0.0], [0.0, 0.0, 50.0, 50.0], 5.0, 1.0)


def sailed(mission, speed=1.0, duration=200.0, dt=0.5):
    """(time, phase, target) of a point that goes to where each leg leads, and waits while it holds."""
    north, east, seen = 0.0, 0.0, []
    for k in range(round(duration / dt)):
        leg = mission.step(north, east, dt)
        seen.append((k * dt, mission.phase, leg.target))
        if mission.phase is Phase.UNDER_WAY:
            north += speed * dt * math.cos(leg.bearing)
            east += speed * dt * math.sin(leg.bearing)
    return seen


def test_without_stays_a_voyage_is_a_mission():
    assert sailed(Voyage(route())) == sailed(Mission(route()))


def test_a_stay_lasts_as_long_as_it_should_and_the_route_goes_on():
    voyage = Voyage(route(), (0.0, 30.0, 0.0, 0.0))
    seen = sailed(voyage)
    holding = [time for time, phase, _ in seen if phase is Phase.HOLDING]
    assert holding[0] == 45.0 and holding[-1] == pytest.approx(75.0, abs=0.5)
    assert all(target == 1 for time, _, target in seen if time <= holding[-1])
    assert [each.waypoint for each in voyage.passages] == [1, 2, 3] and all(each.reached for each in voyage.passages)
    assert seen[-1][1:] == (Phase.STOPPED, 3)
    times = [each.time for each in voyage.passages]
    assert times == sorted(times) and times[0] == pytest.approx(45.5)


def test_a_stay_that_cannot_be_is_refused():
    with pytest.raises(InputError, match=r"waypoint\[3\]\.stay is 5 s, expected 0 at the first and the last"):
        Voyage(route(), (0.0, 0.0, 0.0, 5.0))
    with pytest.raises(InputError, match="voyage has 2 stays, expected one for each of the 4 waypoints"):
        Voyage(route(), (0.0, 0.0))
    with pytest.raises(InputError, match=r"waypoint\[1\]\.stay is -1"):
        Voyage(route(), (0.0, -1.0, 0.0, 0.0))
