"""The position of a boat relative to a straight leg between two waypoints: in a plane, and on the Earth for outputs."""

import math
from typing import NamedTuple

from steerway.core.compiled import kernel


class LegState(NamedTuple):
    """A position relative to a leg: all that guidance needs of the route. SI, rad; NaN for unknown."""

    target: int  # index of the waypoint the leg leads to
    direction: float  # π_p, the leg's course from true north
    along_track: float  # x_e, from the leg's beginning, negative behind it
    cross_track: float  # y_e, + to starboard of the leg
    remaining: float  # along the leg to its end, negative beyond it
    distance: float  # straight to the waypoint
    bearing: float  # straight to the waypoint
    speed: float  # set by the route; NaN if it sets none


UNSEEN = LegState(0, *[math.nan] * 7)
"""The state without a leg."""


class Leg(NamedTuple):
    """The current leg for displays and other autopilots; m, rad, true; NaN for unknown."""

    cross_track: float  # + when the boat is to starboard of the leg
    direction: float  # from origin to destination
    bearing: float  # from the boat to the destination
    distance: float  # to the destination
    course_to_steer: float
    closing_speed: float  # towards the destination, m/s
    latitude: float  # of the destination
    longitude: float
    origin: str = ""
    destination: str = ""
    is_arrived: bool = False  # within the circle of acceptance
    is_passed: bool = False  # beyond the line through the destination across the leg
    speed: float = math.nan  # desired, m/s
    is_held: bool = False  # the destination is a position to hold, not to pass


UNKNOWN_LEG = Leg(math.nan, math.nan, math.nan, math.nan, math.nan, math.nan, math.nan, math.nan)


@kernel
def leg_direction(north_0: float, east_0: float, north_1: float, east_1: float) -> float:
    """Course π_p of the leg from point 0 to point 1, rad in [−π, π]; positions in m."""
    return math.atan2(east_1 - east_0, north_1 - north_0)


@kernel
def track_errors(north: float, east: float, north_0: float, east_0: float, direction: float) -> tuple[float, float]:
    """Along-track and cross-track error (x_e, y_e), m, from a leg through point 0; P1 (46) corrected and (36)."""
    c, s = math.cos(direction), math.sin(direction)
    dn, de = north - north_0, east - east_0
    return dn * c + de * s, de * c - dn * s


@kernel
def seen_from_leg(
    north: float,
    east: float,
    north_0: float,
    east_0: float,
    north_1: float,
    east_1: float,
    direction: float,
    length: float,
) -> tuple[float, float, float, float, float]:
    """(along, cross, remaining, distance, bearing) of a position on the leg from point 0 to point 1; m, rad."""
    along, cross = track_errors(north, east, north_0, east_0, direction)
    dn, de = north_1 - north, east_1 - east
    return along, cross, length - along, math.hypot(dn, de), math.atan2(de, dn)
