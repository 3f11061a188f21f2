"""Corners of a route before it is sailed, for a boat that plans its turns in the estimated current."""

import math
from collections.abc import Sequence
from itertools import pairwise

from steerway.control.boats import Boat
from steerway.control.in_current import InCurrent
from steerway.control.turns import Turn
from steerway.core.kinematics import water_speed_for
from steerway.core.leg import leg_direction
from steerway.guidance.route import Route


def planned_turns(
    boat: Boat, route: Route, current: tuple[float, float], stays: Sequence[float] = ()
) -> dict[int, Turn]:
    """The turn at each waypoint, by its index.

    current: north and east, m/s. stays: duration (s) at each waypoint; a boat that stays stops and does not turn.
    Corners that are curves are checked with the route.
    """
    steering, model = boat.in_current(), boat.autopilot_in_current().model
    points = list(zip(route.north.tolist(), route.east.tolist(), strict=True))
    directions = [leg_direction(*one, *other) for one, other in pairwise(points)]
    model.max_rate = min(model.max_rate, steering.turn_rate)
    turns = {}
    for index, (direction, following) in enumerate(pairwise(directions), start=1):
        if route.curves[index] is None and not (stays and stays[index] > 0.0):
            before = _through_water(steering, boat, route, index, direction, current)
            after = _through_water(steering, boat, route, index + 1, following, current)
            turns[index] = steering.planned(direction, following, (before, after), current, model)
    return turns


def short_leg(boat: Boat, route: Route, current: tuple[float, float], stays: Sequence[float] = ()) -> str:
    """One sentence with the first leg that is shorter than its turns, and the least length; "" for none."""
    turns = planned_turns(boat, route, current, stays)
    for index, length in enumerate(route.lengths.tolist(), start=1):
        end = max(turns[index - 1].end, 0.0) if index - 1 in turns else 0.0
        least = end + (turns[index].lead if index in turns else 0.0)
        if length < least:
            return (
                f"the leg to route.waypoints[{index}] is {length:.0f} m long, expected at least {least:.0f} m, "
                f"the length of its turns in a current of {math.hypot(*current):.3g} m/s"
            )
    return ""


def wide_turn(boat: Boat, route: Route, current: tuple[float, float], stays: Sequence[float] = ()) -> str:
    """One sentence with the turn that exceeds its waypoint's radius of acceptance by most; "" for none."""
    turns = planned_turns(boat, route, current, stays)
    beyond = {index: turn.off - float(route.acceptance[index]) for index, turn in turns.items()}
    index = max(beyond, key=beyond.__getitem__, default=0)
    if not beyond.get(index, 0.0) > 0.0:
        return ""
    turn, acceptance = turns[index], route.acceptance[index]
    return (
        f"The turn at route.waypoints[{index}] passes it at {turn.closest:.1f} m and is up to {turn.outside:.1f} m "
        f"outside of the legs, its acceptance is {acceptance:g} m: sail slower, or turn quicker."
    )


def _through_water(
    steering: InCurrent, boat: Boat, route: Route, index: int, course: float, current: tuple[float, float]
) -> float:
    """Speed through the water on the leg to a waypoint, m/s."""
    asked = float(route.speed[index])
    speed = boat.cruise if math.isnan(asked) else asked
    return float(water_speed_for(course, speed, *current, min(steering.slowest, speed), steering.top_speed))
