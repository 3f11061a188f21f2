"""Turns from one leg into the next: both sides are simulated, and the one that stays nearer to the legs is taken.

In a current the crab angles of two legs add to the turn, which may then be more than half a circle to the side of the
corner, or be shorter to the other side.
"""

import math
from typing import NamedTuple

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.kinematics import heading_for
from steerway.guidance.wheel_over import passing, turn_path, wheel_over

_ONE_SIDE = math.radians(100.0)
"""Turn of the bow below which the other side, of more than 260°, is not simulated."""


class TurnLimits(NamedTuple):
    """Of the reference in a turn: bandwidth (rad/s), rate (rad/s), acceleration (rad/s²); see `turn_path`."""

    bandwidth: float
    rate: float
    acceleration: float


class TurnSpeeds(NamedTuple):
    """Speed through the water before a turn and the one asked for in it (m/s), its time constant (s), and the most over
    ground along the bow (m/s); slip_time: as of `turn_path`.
    """

    before: float
    after: float
    time: float = 2.0
    along_most: float = math.inf
    slip_time: float = 0.0


class Turn(NamedTuple):
    """A turn that begins `lead` m before a waypoint and ends `end` m behind it on the next leg.

    path: (n, 2) north and east from its beginning, m. angle: by which the bow turns, rad, + to starboard. time: s.
    excursion: largest distance from the two legs; closest: least distance from the waypoint, m.
    """

    path: Floats
    angle: float
    time: float
    lead: float
    end: float
    excursion: float
    closest: float


def plan_turn(
    direction: float,
    following: float,
    current: tuple[float, float],
    limits: TurnLimits,
    speeds: TurnSpeeds,
    pivot: float = 0.0,
) -> Turn:
    """The turn between legs of two directions (rad) in a current (north, east; m/s); pivot: as of `turn_path`."""
    heading = float(heading_for(direction, speeds.before, *current)[0])
    shortest = wrap(float(heading_for(following, speeds.after, *current)[0]) - heading)
    sides = [shortest]
    if abs(shortest) > _ONE_SIDE:
        sides.append(shortest - math.copysign(math.tau, shortest))
    before, *asked = speeds
    motion = before, *current, *limits, pivot, *asked
    turns = [_placed(direction, following, angle, *turn_path(heading, angle, *motion)) for angle in sides]
    return min(turns, key=lambda turn: turn.excursion)


def _placed(direction: float, following: float, angle: float, path: Floats, time: float) -> Turn:
    lead = float(wheel_over(direction, following, *path[-1]))
    excursion, closest, end = passing(path, lead, direction, following)
    return Turn(path, angle, time, lead, end, excursion, closest)
