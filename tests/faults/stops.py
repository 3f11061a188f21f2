"""How soon the autopilot stops and how far off the route, a table of docs/steering.md.

Measured with a motorboat of 2 m/s over MAVLink (`tests.bench`) and an Otter (`tests.desk`), on virtual clocks.
"""

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from steerway.core import displacement
from steerway.live.testing import Controls, Limits, OnStop, State
from tests.bench import Case, sail
from tests.desk import HOME, Desk, corner, dock_all, square
from tests.faults.table import Table

TABLE = Table("steering.md", "stops", "| what happens | reason | after | off the route |")
LEG = ((0.0, 0.0), (200.0, 0.0))
FULL_SPEED, DEAD = 2.0, 40.0  # top speed of the motorboat, m/s; time after its start at which its motor fails, s
AGAINST, ABEAM = 180.0, 45.0  # direction towards which the current sets, degrees from the first leg
BEFORE, AFTER, FAR = 20.0, 90.0, 5000.0  # time before and after the operator is lost, s; distance of the route, m


class Stop(NamedTuple):
    """Why the autopilot stopped, after how long (s; NaN: not started), and the largest distance off the route, m."""

    why: str
    seconds: float
    off: float


def line(name: str, found: list[Stop]) -> str:
    """One line of the table: the largest numbers of several runs, and the reason of the longest run."""
    seconds, off = (max(getattr(each, key) for each in found) for key in ("seconds", "off"))
    after = "not begun" if math.isnan(seconds) else f"{seconds:.0f} s"
    why = max(found, key=lambda each: each.seconds).why
    return f"| {name} | {why} | {after} | {f'{off:.1f} m' if off > 0.0 else 'never on the route'} |"


def too_strong(share: float) -> list[Stop]:
    """In a current against the first leg, a fraction `share` of the boat's speed, with and without compass."""
    cases = [Case(share * FULL_SPEED, AGAINST, compass) for compass in (True, False)]
    return [Stop(_reason(found.why), found.seconds, found.off) for found in map(sail, cases)]


def dead_motor() -> list[Stop]:
    """The motor fails at `DEAD` s, in a current of 0.5 m/s."""
    cases = [Case(0.5, each, compass, dead=DEAD) for compass in (True, False) for each in (AGAINST, ABEAM)]
    return [Stop(_reason(found.why), found.seconds - DEAD, found.off) for found in map(sail, cases)]


def _reason(stopped):
    return stopped.partition(": ")[2] or stopped


def lost_operator(answer: str) -> list[Stop]:
    """No operator is heard after `BEFORE` s, the limit is 10 s. `off` is from the leg, or from the held position."""
    more = {"rally": corner(0.0, 0.0)} if answer == "return" else {}
    limits, on_stop = Limits(operator_lost=10.0), OnStop(operator=answer)
    desk = Desk(square(LEG, limits=limits, on_stop=on_stop, **more), current=0.3).start()
    for _ in range(int(BEFORE)):
        desk.sail(1.0)
        Controls(desk.autopilot).do("present", None, "the table")
    off = [abs(desk.state[7])]
    seconds = desk.until(lambda: desk.order.state is not State.RUNNING, AFTER)
    why = desk.order.reason
    if desk.order.state is State.DEGRADED:
        place = desk.autopilot.guide.place
        desk.sail(AFTER)
        off.append(math.dist(desk.state[6:8], displacement(*place, *HOME)))
    dock_all()
    return [Stop(why, seconds, max(off))]


def far_first_leg() -> list[Stop]:
    """The route begins `FAR` m away."""
    desk = Desk(square(tuple((north + FAR, east) for north, east in LEG)), engage=True)
    desk.until(lambda: desk.order is not None and desk.order.reason.startswith("the route begins"))
    why = desk.order.reason
    dock_all()
    return [Stop(why, math.nan, math.nan)]


ON_THE_DESK: dict[str, Callable[[], list[Stop]]] = {
    "operator lost (`operator_lost = 10`)": partial(lost_operator, "stop"),
    '… `operator = "hand-back"`': partial(lost_operator, "hand-back"),
    '… `operator = "hold"`, 90 s later': partial(lost_operator, "hold"),
    '… `operator = "return"`, 90 s later': partial(lost_operator, "return"),
    "the first leg is 5 km away": far_first_leg,
}
ON_THE_BENCH: dict[str, Callable[[], list[Stop]]] = {
    **{f"current of {share:g} of the boat's speed": partial(too_strong, share) for share in (1.02, 1.1, 1.2)},
    "the motor dies": dead_motor,
}
FAULTS = ON_THE_BENCH | ON_THE_DESK


def measured(name: str) -> list[Stop]:
    """Sail until the autopilot stops."""
    return FAULTS[name]()
