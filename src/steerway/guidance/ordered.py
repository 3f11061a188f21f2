"""Courses and speeds ordered at given times, in place of a route: orders of a helmsman, and steps for trials."""

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple

from steerway.core.errors import InputError
from steerway.core.leg import UNSEEN, LegState
from steerway.core.settings import NotNegative, Number, Table
from steerway.guidance.mission_log import Passage
from steerway.guidance.waypoints import Mission, Phase


class Order(NamedTuple):
    """An order in force from `time` (s): rad, m/s, m. A position of NaN means none, a speed of NaN the cruise speed."""

    time: float
    course: float = 0.0  # or heading, if the law commands a heading
    speed: float = math.nan
    north: float = math.nan
    east: float = math.nan


class OrderTable(Table):
    """One of the [[orders]] of a scenario; a key that is left out keeps its previous value.

    A vessel in dynamic positioning is given a position and a heading.
    """

    time: Annotated[NotNegative, "s"] = 0.0
    """Time from the start at which the order comes into force."""
    course_deg: Number | None = None
    """Ordered course, or heading if `guidance.steer_by` is "heading" or a position is held."""
    speed: Annotated[NotNegative | None, "m/s"] = None
    """Ordered speed over ground; by default the cruise speed."""
    north: Annotated[Number | None, "m"] = None
    """North of the position to hold."""
    east: Annotated[Number | None, "m"] = None
    """East of the position to hold."""


def orders_of(tables: Sequence[OrderTable], first: Order) -> tuple[Order, ...]:
    """The orders of the tables, after the order `first`. Raises InputError for times that do not rise from 0."""
    orders: list[Order] = []
    for index, table in enumerate(tables):
        before = orders[-1] if orders else first
        if table.time < before.time or (orders and table.time == before.time):
            raise InputError(f"orders[{index}].time is {table.time:g} s, expected more than {before.time:g} s")
        if not orders and table.time > 0.0:
            orders.append(first)
        course = before.course if table.course_deg is None else math.radians(table.course_deg)
        others = (
            old if new is None else new
            for old, new in zip(before[2:], (table.speed, table.north, table.east), strict=True)
        )
        orders.append(Order(table.time, course, *others))
    return tuple(orders)


class Ordered:
    """Supplies orders in place of the legs of a `Mission`, as a `pilot.LegSource`.

    orders: in order of time, the first from 0 s; see `orders_of`. cruise: the boat's cruise speed, m/s.
    """

    phase = Phase.UNDER_WAY
    following = math.nan
    passages: tuple[Passage, ...] = ()
    missions: tuple[Mission, ...] = ()

    def __init__(self, orders: Sequence[Order], cruise: float = math.nan):
        self.orders, self.cruise = tuple(orders), cruise
        self.lead = self.preview = math.nan
        self._time = math.nan

    @property
    def now(self) -> Order:
        """The order in force."""
        # Times are sums of steps: they may be early by a rounding error.
        started = [each for each in self.orders if each.time <= self._time + 1e-9]
        return started[-1] if started else self.orders[0]

    @property
    def given_course(self) -> float:
        """The ordered course, or heading, rad."""
        return self.now.course

    def step(self, north: float, east: float, dt: float, effort: float = 0.0) -> LegState:
        """A `LegState` with the ordered speed and no leg; the first step is at 0 s. See `waypoints.Mission.step`."""
        self._time = 0.0 if math.isnan(self._time) else self._time + dt
        speed = self.now.speed
        return UNSEEN._replace(speed=self.cruise if math.isnan(speed) else speed)
