"""Turns from one leg to the next: both sides are simulated, and the path that stays nearer to the corner is used.

In a current the crab angles of both legs add to the turn. It may then exceed 180°, or be shorter to the other side. A
turn may begin and end beside the legs, to balance how far it cuts the corner and how far it goes outside. The large
turns of a ship begin and end on the legs.
"""

import math
from typing import NamedTuple

import numpy as np

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.kinematics import heading_for
from steerway.core.wheel_over import in_line, passing, turn_path, wheel_over

_ONE_SIDE = math.radians(100.0)
"""Largest turn of the bow for which only this side is simulated; the turn to the other side would exceed 260°."""

_CUT, _INSIDE = 1.7, 2.5
"""Divisors in `Turn.cost` of the distances `closest` and `excursion`. On a right-angled path that leaves the legs
equally far on both sides, `closest` is 1.4 and `excursion` 1 times `outside`. Boats leave the path by 0.2 to 0.4 m to
the outside. With _CUT = 1.5, five of 32 squares in a current of 1.3 m/s left a corner by more than 1 m; with 1.7, 3.
A turn of more than 180° goes round the waypoint. With _INSIDE = 1.7, six of 128 squares in currents of 1.0 and 1.3 m/s
left a corner by more than 1 m; with 2.5, two."""
_KEPT = 0.7
"""Factor on the size of a turn to the side planned before, if turns may begin beside the leg. Turns to port and
starboard then begin on different sides of it. A boat that changed the side near the waypoint began its turn 0.7 m
beside the planned place."""
_STEPS = 10
"""Steps of the search for the offset; the result is accurate to 1 % of the turn's size."""
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


class TurnLimits(NamedTuple):
    """Limits of the reference in a turn: bandwidth (rad/s), rate (rad/s), acceleration (rad/s²); see `turn_path`."""

    bandwidth: float
    rate: float
    acceleration: float


class TurnSpeeds(NamedTuple):
    """Speeds through the water before a turn and ordered in it (m/s), the speed's time constant (s), and the largest
    speed over ground along the bow (m/s); slip_time: see `turn_path`."""

    before: float
    after: float
    time: float = 2.0
    along_most: float = math.inf
    slip_time: float = 0.0


class Turn(NamedTuple):
    """A turn that begins `lead` m before a waypoint and ends `end` m after it, both `beside` m to starboard of the leg.

    path: (n, 2) north and east from its beginning, m. angle: turn of the bow, rad, + to starboard. time: s. excursion:
    largest distance from the two legs; outside: largest distance on their outer side; closest: least distance from the
    waypoint, m.
    """

    path: Floats
    angle: float
    time: float
    lead: float
    beside: float
    end: float
    excursion: float
    outside: float
    closest: float

    @property
    def cost(self) -> float:
        """Deviation from the corner, m; distances on the inner side of the legs count less."""
        return max(self.outside, self.closest / _CUT, self.excursion / _INSIDE)

    @property
    def off(self) -> float:
        """Distance from the corner that a waypoint's radius of acceptance limits, m."""
        return max(self.outside, self.closest)


def plan_turn(
    direction: float,
    following: float,
    current: tuple[float, float],
    limits: TurnLimits,
    speeds: TurnSpeeds,
    pivot: float = 0.0,
    leaves_legs: bool = True,
    before: float = 0.0,
) -> Turn:
    """The turn between legs of two directions (rad) in a current (north, east; m/s); pivot: see `turn_path`.

    leaves_legs: whether it may begin and end beside the legs. before: angle of the last plan of this turn, 0 for none.
    If turns may begin beside the legs, its side is kept unless the other side is clearly better.
    """
    heading = float(heading_for(direction, speeds.before, *current)[0])
    shortest = wrap(float(heading_for(following, speeds.after, *current)[0]) - heading)
    sides = [shortest]
    if abs(shortest) > _ONE_SIDE:
        sides.append(shortest - math.copysign(math.tau, shortest))
    at_first, *asked = speeds
    motion = at_first, *current, *limits, pivot, *asked
    turns = [_placed(direction, following, angle, *turn_path(heading, angle, *motion), leaves_legs) for angle in sides]

    def size(turn: Turn) -> float:
        if not leaves_legs:
            return turn.excursion
        return (_KEPT if turn.angle * before > 0.0 else 1.0) * turn.cost * turn.time

    return min(turns, key=size)


def _placed(direction: float, following: float, angle: float, path: Floats, time: float, leaves_legs: bool) -> Turn:
    """The turn with the offset of least cost, found by golden-section search; offset 0 unless `leaves_legs`."""

    def beside(offset: float) -> Turn:
        lead = float(wheel_over(direction, following, path[-1, 0], path[-1, 1], offset, offset))
        if in_line(direction, following):  # the turn does not go beyond the waypoint
            lead = float(np.max(path @ (math.cos(direction), math.sin(direction))))
        excursion, outside, closest, end = passing(path, lead, direction, following, offset)
        return Turn(path, angle, time, lead, -side * offset, end, excursion, outside, closest)

    side, size = math.copysign(1.0, math.sin(following - direction)), float(np.max(np.ptp(path, axis=0)))
    if not leaves_legs:
        return beside(0.0)
    least, most = -size, size
    inner, outer = beside(most - _GOLDEN * (most - least)), beside(least + _GOLDEN * (most - least))
    for _ in range(_STEPS):
        if inner.cost < outer.cost:
            most, outer = -side * outer.beside, inner
            inner = beside(most - _GOLDEN * (most - least))
        else:
            least, inner = -side * inner.beside, outer
            outer = beside(least + _GOLDEN * (most - least))
    return min(inner, outer, key=lambda turn: turn.cost)
