"""Hours of squares, surveys and station keeping without any fault: does the autopilot go on?

`python -m tests.faults.hours [HOURS] [FIRST_SEED]` sails on a virtual clock. Its exit code is 1 if the receiver or the
boat was reported as faulty.
"""

import logging
import math
import sys
from collections import Counter
from typing import NamedTuple

import numpy as np

from steerway.live.testing import UNDER_WAY, State
from steerway.vessels import conditions
from tests.desk import OTTER, SQUARE, Desk, square

SPEED, STRONGEST = 1.2, 0.8
"""Speed on the routes, m/s, and the strongest current as a fraction of it."""
LONGEST, HELD = 400.0, 120.0  # longest time on a route and time of station keeping, s
FAULTY = "stands still", "turn as ordered"
"""Words in the reasons of the checks of receiver and boat."""
WENT_ON = "went on"
_WANDER_TIME = 8.0  # s
SURVEY = tuple((70.0 * ((k + 1) // 2 % 2), 12.0 * (k // 2)) for k in range(8))


class Sailed(NamedTuple):
    """One run: its kind, its time (s), and why it ended."""

    kind: str
    seconds: float
    reason: str


def sailed(seed: int) -> Sailed:
    """One run; the seed sets kind of route, current, receiver and kind of orders."""
    rng = np.random.default_rng(seed)
    kind = ("square", "survey", "hold")[seed % 3]
    speed, direction = STRONGEST * SPEED * rng.uniform(), math.tau * rng.uniform()
    noise, wander, rate = rng.choice((0.1, 0.3, 0.5)), rng.choice((0.0, 0.2, 0.4)), rng.choice((1.0, 5.0, 10.0))
    route = square(
        SURVEY if kind == "survey" else SQUARE, boat=OTTER, **({"hold_radius": 3.0} if kind == "hold" else {})
    )
    by = rng.choice(("yaw-rate", "yaw-rate", "propellers"))
    desk = Desk(route, by=str(by), current=0.2, noise=float(noise), rate=float(rate), seed=seed)
    honest, slow, kept = desk.fixes, np.zeros(2), math.exp(-1.0 / rate / _WANDER_TIME)

    def fixes(time, north, east):
        slow[:] = kept * slow + wander * math.sqrt(1.0 - kept**2) * rng.standard_normal(2)
        return honest(time, north + slow[0], east + slow[1])

    desk.fixes = fixes
    try:
        desk.start()
        desk.sail(20.0)
        _set_in(desk, speed * np.array((math.cos(direction), math.sin(direction))))
        begun = desk.time
        if kind == "hold" and desk.order.state in UNDER_WAY:
            desk.autopilot.guide.hold_position()
        while desk.order.state in UNDER_WAY and desk.time < begun + (HELD if kind == "hold" else LONGEST):
            desk.sail(1.0)
        return Sailed(kind, desk.time, desk.order.reason if desk.order.state is State.STOPPED else WENT_ON)
    finally:
        Desk.afloat.remove(desk)
        desk.dock()


def _set_in(desk, current):
    """Change the current from its initial value within a minute."""
    before, steps = np.array((0.2 * math.cos(0.7), 0.2 * math.sin(0.7))), 60
    for k in range(steps):
        if desk.order.state in UNDER_WAY:
            desk.sea = conditions(tuple(before + (k + 1) / steps * (current - before)))
            desk.sail(1.0)


def main() -> int:
    """Sail; return 1 if the boat or the receiver was reported as faulty."""
    logging.disable(logging.CRITICAL)
    hours = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    seed, seconds, stops, false = int(sys.argv[2]) if len(sys.argv) > 2 else 10_000, 0.0, Counter(), 0
    while seconds < 3600.0 * hours:
        found = sailed(seed)
        seconds += found.seconds
        if found.reason != WENT_ON:
            stops[f"{found.kind}: {found.reason}"] += 1
            print(f"seed {seed}, {found.kind}: {found.reason}", flush=True)
        false += any(words in found.reason for words in FAULTY)
        seed += 1
        if seed % 10 == 0:
            print(f"{seconds / 3600.0:.2f} h, {false} false stops, {sum(stops.values()) - false} others", flush=True)
    print(f"{seconds / 3600.0:.1f} h: {false} false stops of receiver and boat, {sum(stops.values()) - false} others")
    return 1 if false else 0


if __name__ == "__main__":
    sys.exit(main())
