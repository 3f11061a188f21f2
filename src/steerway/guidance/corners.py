"""Curved corners of a route: the path from one leg to the next is an arc or a pair of clothoids."""

import math
from dataclasses import dataclass

import numpy as np

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.errors import InputError

KINDS = ("exact", "arc", "clothoid")
"""Path at a waypoint: the boat's own turn, an arc, or a curve whose curvature rises and falls linearly (clothoids)."""
_STEP = 0.02
"""Turn (rad) between two points of a curve; the chord is 5·10⁻⁵ of the radius from the arc."""
_LEAST_TURN = math.radians(3.0)
"""Turn (rad) below which legs count as in line. An arc with a radius of 10 m would cut such a corner by 3 mm."""
_LARGEST_TURN = math.radians(175.0)
"""Largest turn of a curved corner. Its arc begins r tan(turn/2) = 23 r before the waypoint."""


@dataclass(frozen=True, eq=False)
class Corner:
    """A curve that begins `before` m before a waypoint on one leg, and ends the same distance behind it on the next.

    north, east (m) and direction (rad): (n,), points `step` m apart along the curve.
    """

    before: float
    step: float
    north: Floats
    east: Floats
    direction: Floats

    @property
    def length(self) -> float:
        """Length of the curve, m."""
        return self.step * (len(self.north) - 1)

    def seen(self, north: float, east: float) -> tuple[float, float]:
        """(along-track distance, cross-track error) of a position by the curve's nearest point; m, + to starboard."""
        k = int(np.argmin((self.north - north) ** 2 + (self.east - east) ** 2))
        c, s = math.cos(self.direction[k]), math.sin(self.direction[k])
        dn, de = north - self.north[k], east - self.east[k]
        return k * self.step + dn * c + de * s, de * c - dn * s

    def direction_at(self, along: float) -> float:
        """Direction (rad) at a distance (m) along the curve; before and behind the curve, that of the legs."""
        return float(np.interp(along, self.step * np.arange(len(self.north)), self.direction))


def corner(kind: str, radius: float, north: float, east: float, direction: float, following: float) -> Corner | None:
    """The curve at a waypoint between legs of two directions (rad), with a least radius of curvature in m.

    None for legs nearly in line, and for the kind "exact". Raises InputError for a turn of more than 175°.
    """
    turn = wrap(following - direction)
    if kind == "exact" or abs(turn) < _LEAST_TURN:
        return None
    if abs(turn) > _LARGEST_TURN:
        raise InputError(f"turns by {math.degrees(abs(turn)):.0f}°, expected at most 175° for a corner of kind {kind}")
    share = np.linspace(0.0, 1.0, max(8, math.ceil(abs(turn) / _STEP)) + 1)
    if kind == "arc":
        turned, length = turn * share, radius * abs(turn)
    else:  # the curvature rises linearly to 1/r and falls again: two clothoids
        turned, length = turn * np.where(share < 0.5, 2.0 * share**2, 1.0 - 2.0 * (1.0 - share) ** 2), 2.0 * radius
        length *= abs(turn)
    step = length / (len(share) - 1)
    towards = 0.5 * (turned[1:] + turned[:-1])
    along = np.concatenate([[0.0], np.cumsum(step * np.cos(towards))])
    across = np.concatenate([[0.0], np.cumsum(step * np.sin(towards))])
    before = float(math.hypot(along[-1], across[-1]) / (2.0 * math.cos(0.5 * turn)))
    along -= before
    c, s = math.cos(direction), math.sin(direction)
    return Corner(before, step, north + along * c - across * s, east + along * s + across * c, direction + turned)
