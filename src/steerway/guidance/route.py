"""A route: waypoints in the north-east plane, validated once at construction."""

from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.arrays import Floats
from steerway.core.checks import one_of, positive
from steerway.core.errors import InputError
from steerway.core.leg import leg_direction
from steerway.guidance.corners import KINDS, Corner, corner

LONGEST_LEG = 500e3
"""Longest leg, m. A longer leg is no straight line in one tangent plane; most often its unit is wrong."""
_SHARPEST = -0.9
"""Cosine of 154°, the sharpest turn of a parallel route. Its corner is then four offsets from the waypoint."""


@dataclass(frozen=True, eq=False, init=False)
class Route:
    """Waypoints joined by straight legs.

    north, east: (n,), n ≥ 2, m in the tangent plane.
    acceptance: radius of acceptance of a waypoint, m: one number or (n,), NaN for `default_acceptance`.
    speed:       desired speed on the leg to each waypoint, m/s: None, one number or (n,), NaN for none.
    corners:     one of `corners.KINDS`; corner_radius: least radius of a curve, m.
    Raises InputError that names the waypoint for a route that a boat cannot follow.
    """

    north: Floats
    east: Floats
    acceptance: Floats
    speed: Floats
    default_acceptance: float
    corners: str
    corner_radius: float
    curves: tuple[Corner | None, ...] = field(init=False, repr=False)

    def __init__(
        self,
        north: ArrayLike,
        east: ArrayLike,
        acceptance: ArrayLike | None = None,
        speed: ArrayLike | None = None,
        default_acceptance: float = 10.0,
        corners: str = KINDS[0],
        corner_radius: float = 10.0,
    ) -> None:
        north, east = (np.array(axis, dtype=np.float64).reshape(-1) for axis in (north, east))
        if len(north) != len(east):
            raise InputError(f"route has {len(north)} north and {len(east)} east values, expected as many of each")
        if len(north) < 2:
            raise InputError(f"route has {len(north)} waypoints, expected at least 2")
        positive("route.default_acceptance", default_acceptance)
        acceptance = _column("acceptance", acceptance, len(north))
        acceptance[np.isnan(acceptance)] = default_acceptance
        speed = _column("speed", speed, len(north))
        columns = {"north": north, "east": east, "acceptance": acceptance, "speed": speed}
        for column in columns.values():
            column.setflags(write=False)
        single = {"default_acceptance": default_acceptance, "corners": corners, "corner_radius": corner_radius}
        for name, value in (columns | single).items():
            object.__setattr__(self, name, value)
        self._check_points()
        self._check_legs()
        one_of("route.corners", corners, KINDS)
        positive("route.corner_radius", corner_radius)
        object.__setattr__(self, "curves", self._curves())

    def __len__(self) -> int:
        return len(self.north)

    @property
    def lengths(self) -> np.ndarray:
        """(n−1,) length of each leg, m."""
        return np.hypot(np.diff(self.north), np.diff(self.east))

    def beside(self, offset: float) -> "Route":
        """The parallel route with its legs `offset` m to starboard, to port where negative.

        Raises InputError for a turn of more than 154°, or if a leg becomes no longer than its radius of acceptance.
        """
        ahead = np.column_stack([np.diff(self.north), np.diff(self.east)]) / self.lengths[:, None]
        turns = np.sum(ahead[:-1] * ahead[1:], axis=1)
        if np.any(turns < _SHARPEST):
            index = int(np.argmin(turns)) + 1
            turn = np.degrees(np.arccos(max(turns[index - 1], -1.0)))
            raise InputError(f"the route turns by {turn:.1f}° at waypoint {index}, expected at most 154° for an offset")
        abeam = np.column_stack([-ahead[:, 1], ahead[:, 0]])
        corners = (abeam[:-1] + abeam[1:]) / (1.0 + turns)[:, None]
        north, east = (np.array([self.north, self.east]).T + offset * np.vstack([abeam[:1], corners, abeam[-1:]])).T
        along = np.sum(np.column_stack([np.diff(north), np.diff(east)]) * ahead, axis=1)
        if np.any(along <= self.acceptance[1:]):
            index = int(np.argmin(along - self.acceptance[1:])) + 1
            side = "starboard" if offset > 0.0 else "port"
            raise InputError(
                f"at an offset of {abs(offset):g} m to {side}, the leg to waypoint {index} is no longer than the "
                f"waypoint's acceptance radius of {self.acceptance[index]:g} m, expected a smaller offset or radius"
            )
        return replace(self, north=north, east=east)

    def _curves(self) -> tuple[Corner | None, ...]:
        """The curve at each waypoint, None for none."""
        points = list(zip(self.north, self.east, strict=True))
        directions = [leg_direction(*one, *other) for one, other in pairwise(points)]
        curves: list[Corner | None] = [None] * len(points)
        for index in range(1, len(points) - 1):
            try:
                curves[index] = corner(
                    self.corners, self.corner_radius, *points[index], *directions[index - 1 : index + 1]
                )
            except InputError as error:
                raise InputError(f"route.waypoint[{index}] {error}") from None
        for index, length in enumerate(self.lengths, start=1):
            taken = sum(each.before for each in curves[index - 1 : index + 1] if each is not None)
            if taken > 1.001 * length:  # tolerates the sampling of the curves
                raise InputError(
                    f"corners with a radius of {self.corner_radius:.3g} m take {taken:.3g} m of the leg to "
                    f"route.waypoint[{index}], which has {length:.3g} m, expected a smaller corner_radius"
                )
        return tuple(curves)

    def _check_points(self) -> None:
        for index in range(len(self)):
            for name in ("north", "east"):
                value = getattr(self, name)[index]
                if not np.isfinite(value):
                    raise InputError(f"route.waypoint[{index}].{name} is {value}, expected a number of metres")
            positive(f"route.waypoint[{index}].acceptance", self.acceptance[index])
            if not np.isnan(self.speed[index]):
                positive(f"route.waypoint[{index}].speed", self.speed[index])

    def _check_legs(self) -> None:
        for index, length in enumerate(self.lengths, start=1):
            place = f"route.waypoint[{index}]"
            if length == 0.0:
                raise InputError(f"{place} repeats waypoint {index - 1}, expected another point")
            if length <= self.acceptance[index]:
                raise InputError(
                    f"{place} is {length:g} m from waypoint {index - 1}, expected more than the acceptance "
                    f"radius of {place}, {self.acceptance[index]:g} m"
                )
            if length > LONGEST_LEG:
                raise InputError(
                    f"{place} is {length / 1e3:.0f} km from waypoint {index - 1}, "
                    f"expected at most {LONGEST_LEG / 1e3:.0f} km"
                )


def _column(name: str, given: ArrayLike | None, n: int) -> np.ndarray:
    """A new array of n values from None (NaN), one value or n values."""
    column = np.array(np.nan if given is None else given, dtype=np.float64)
    if column.shape not in ((), (n,)):
        raise InputError(f"route.{name} has {column.size} values, expected one or {n}")
    return np.array(np.broadcast_to(column, (n,)))
