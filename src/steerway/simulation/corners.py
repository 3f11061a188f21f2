"""Corners of a route before it is sailed, for a boat that plans its turns in the estimated current."""

import math
from collections.abc import Sequence
from itertools import pairwise

from steerway.control.boats import Boat
from steerway.control.in_current import InCurrent
from steerway.core.kinematics import water_speed_for
from steerway.core.leg import leg_direction
from steerway.guidance.route import Route


def short_leg(boat: Boat, route: Route, current: tuple[float, float], stays: Sequence[float] = ()) -> str:
    """One sentence with the first leg that is shorter than its turns, and the least length; "" for none.

    current: north and east, m/s. stays: duration (s) at each waypoint; a boat that stays stops and does not turn.
    Corners that are curves are checked with the route.
    """
    steering, model = boat.in_current(), boat.autopilot_in_current().model
    steering_rate = steering.turn_rate
    ends, leads = [0.0], []
    points = list(zip(route.north.tolist(), route.east.tolist(), strict=True))
    directions = [leg_direction(*one, *other) for one, other in pairwise(points)]
    model.max_rate = min(model.max_rate, steering_rate)
    for index, (direction, following) in enumerate(pairwise(directions), start=1):
        if route.curves[index] is not None or (stays and stays[index] > 0.0):
            leads.append(0.0)
            ends.append(0.0)
            continue
        before = _through_water(steering, boat, route, index, direction, current)
        after = _through_water(steering, boat, route, index + 1, following, current)
        turn = steering.planned(direction, following, (before, after), current, model)
        leads.append(turn.lead)
        ends.append(max(turn.end, 0.0))
    leads.append(0.0)
    for index, (length, end, lead) in enumerate(zip(route.lengths.tolist(), ends, leads, strict=True), start=1):
        if length < end + lead:
            return (
                f"the leg to route.waypoints[{index}] is {length:.0f} m long, expected at least {end + lead:.0f} m, "
                f"the length of its turns in a current of {math.hypot(*current):.3g} m/s"
            )
    return ""


def _through_water(
    steering: InCurrent, boat: Boat, route: Route, index: int, course: float, current: tuple[float, float]
) -> float:
    """Speed through the water on the leg to a waypoint, m/s."""
    asked = float(route.speed[index])
    speed = boat.cruise if math.isnan(asked) else asked
    return float(water_speed_for(course, speed, *current, min(steering.slowest, speed), steering.top_speed))
