"""Wheel-over point and path of a turn from one leg to the next, from the boat's turn through the water and the current.

The simulated path over ground gives the wheel-over point, from which the turn ends on the next leg. The boat then
follows this path between the legs.
"""

import math

import numpy as np

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.reference import third_order

_MOST_POINTS = 3000
"""Largest number of points of a path. At 0.02/ω s apart they cover 180° at a rate of ω/19; a slower turn is cut off."""


_AHEAD = 2.5
"""Largest lead (rad) of the command over the reference, below π, so that wrapping keeps the turn's direction."""
_IN_LINE = 0.1
"""Sine of the angle between two legs. Below it they count as in line, and a turn has no wheel-over point."""


@kernel
def ahead_on(left: float) -> float:
    """Lead (rad, + to starboard) of the next command over the reference, for a remaining turn `left` (rad)."""
    return min(_AHEAD, max(-_AHEAD, left))


@kernel
def turn_path(
    heading: float,
    turn: float,
    water_speed: float,
    current_north: float,
    current_east: float,
    bandwidth: float,
    max_rate: float,
    max_acceleration: float,
    pivot: float = 0.0,
    after: float = math.nan,
    speed_time: float = 2.0,
    along_most: float = math.inf,
    slip_time: float = 0.0,
) -> tuple[Floats, float]:
    """(path (n, 2) over ground, north and east in m; time in s) of a turn from the origin by a reference model.

    turn: change of heading (rad, + to starboard), which may exceed 180°. The path ends 1° before it is complete.
    pivot: distance (m) from the boat's position forward to the pivot point, which moves along the bow. after: ordered
    speed through the water (m/s), approached with the time constant speed_time (s); NaN keeps water_speed.
    along_most: largest speed over ground along the bow, m/s. slip_time: time constant (s) with which the direction of
    the motion through the water follows the bow.
    """
    dt = 0.02 / bandwidth
    angle, rate, acceleration, left = heading, 0.0, 0.0, turn
    follows, abeam = 1.0 if slip_time <= dt else dt / slip_time, 0.0  # abeam: angle of the motion behind the bow, rad
    path = np.zeros((_MOST_POINTS, 2))
    north = east = 0.0  # displacement of the pivot point
    n = 1
    while n < _MOST_POINTS and abs(left) > 0.02:
        before = angle
        angle, rate, acceleration = third_order(
            angle, rate, acceleration, angle + ahead_on(left), bandwidth, 1.0, max_rate, max_acceleration, dt
        )
        left -= wrap(angle - before)
        abeam = (abeam + wrap(angle - before)) * (1.0 - follows)
        c, s = math.cos(angle - abeam), math.sin(angle - abeam)
        if math.isfinite(after):
            tends_to = min(after, along_most - current_north * c - current_east * s)
            water_speed += dt / speed_time * (max(tends_to, 0.0) - water_speed)
        north += dt * (water_speed * c + current_north)
        east += dt * (water_speed * s + current_east)
        path[n, 0] = north + pivot * (math.cos(heading) - c)
        path[n, 1] = east + pivot * (math.sin(heading) - s)
        n += 1
    return path[:n], (n - 1) * dt


@kernel
def in_line(direction: float, following: float) -> bool:
    """Whether the directions (rad) of two legs are so nearly in line that a turn has no wheel-over point."""
    return abs(math.sin(following - direction)) < _IN_LINE


@kernel
def wheel_over(
    direction: float, following: float, north: float, east: float, begins: float = 0.0, ends: float = 0.0
) -> float:
    """Distance (m) of the wheel-over point before a waypoint, for a turn with the displacement (north, east) in m.

    direction and following: of the two legs, rad. begins, ends: distances (m) of the turn's beginning and end from
    the legs, outwards. Returns 0 for legs that are (nearly) in line, also in opposite directions.
    """
    sine, cosine = math.sin(wrap(following - direction)), math.cos(following - direction)
    if in_line(direction, following):
        return 0.0
    side = math.copysign(1.0, sine)
    across = east * math.cos(following) - north * math.sin(following)
    return (side * (begins * cosine - ends) - across) / sine


@kernel
def passing(
    path: Floats, lead: float, direction: float, following: float, begins: float = 0.0
) -> tuple[float, float, float, float]:
    """Four distances (m) of a turn's path (n, 2) around the waypoint between two legs of given directions (rad).

    They are (1) the largest from the legs, (2) the largest from the legs on their outer side, (3) the least from the
    waypoint, and (4) the along-track distance of the path's end on the next leg. The path begins `lead` m before the
    waypoint and `begins` m outside of the first leg.
    """
    widest, outside, nearest, along = 0.0, 0.0, math.inf, 0.0
    before_n, before_e = math.cos(direction), math.sin(direction)
    after_n, after_e = math.cos(following), math.sin(following)
    side = math.copysign(1.0, math.sin(wrap(following - direction)))
    start_n = -lead * before_n + side * begins * before_e
    start_e = -lead * before_e - side * begins * before_n
    for k in range(len(path)):
        north, east = path[k, 0] + start_n, path[k, 1] + start_e
        along = north * after_n + east * after_e
        behind = north * before_n + east * before_e
        off_first, off_second = east * before_n - north * before_e, east * after_n - north * after_e
        nearest = min(nearest, math.hypot(north, east))
        off = min(math.hypot(off_first, max(behind, 0.0)), math.hypot(off_second, min(along, 0.0)))
        widest = max(widest, off)
        if side * off_first < 0.0 or side * off_second < 0.0:
            outside = max(outside, off)
    return widest, outside, nearest, along


@kernel
def off_path(path: Floats, north: float, east: float) -> tuple[float, bool]:
    """(distance from a path (n, 2) in m, + to starboard; whether its end is passed) of a position (north, east)."""
    off, nearest, beyond = 0.0, math.inf, True
    for k in range(len(path) - 1):
        ahead_n, ahead_e = path[k + 1, 0] - path[k, 0], path[k + 1, 1] - path[k, 1]
        length = math.hypot(ahead_n, ahead_e)
        if length == 0.0:
            continue
        dn, de = north - path[k, 0], east - path[k, 1]
        along = (dn * ahead_n + de * ahead_e) / length
        across = (de * ahead_n - dn * ahead_e) / length
        distance = math.hypot(across, along - min(length, max(0.0, along)))
        if distance < nearest:
            off, nearest, beyond = across, distance, k == len(path) - 2 and along >= length
    return off, beyond
