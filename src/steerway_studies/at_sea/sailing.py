"""Boats, routes, currents and receivers; the cases that a seed draws; a simulated run and the numbers of it."""

import math
from functools import partial
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np

from steerway.core import rms
from steerway.guidance import LineOfSight, Mission, Route, lawnmower
from steerway.pilot import Mode, Pilot
from steerway.sensors import Gnss, Suite
from steerway.simulation import Run, Start, sail, short_leg, steering_pilot
from steerway.vessels import (
    MARINER_BOAT_IN_CURRENT,
    MOTORBOAT_BOAT,
    OTTER_BOAT_IN_CURRENT,
    Current,
    Environment,
    Mariner,
    Motorboat,
    Otter,
)


class Craft(NamedTuple):
    """A boat: its model, its numbers, the side of its square (m) and the step of its simulation (s)."""

    build: object
    boat: object
    side: float
    step: float
    settling: float  # s after a turn begins, before its leg counts
    runs: int  # per seed


CRAFT = {
    "otter": Craft(partial(Otter, 25.0, (0.05, 0.0, -0.35)), OTTER_BOAT_IN_CURRENT, 80.0, 0.05, 20.0, 16),
    "motorboat": Craft(Motorboat, MOTORBOAT_BOAT.but(cruise=2.0), 80.0, 0.05, 20.0, 16),
    "mariner": Craft(Mariner, MARINER_BOAT_IN_CURRENT, 6000.0, 0.5, 600.0, 8),
}
SHIP_LENGTH = 160.93
DIRECTIONS, SHARES, SHAPES = 16, (0.0, 0.25, 0.5, 0.8), ("square", "lawnmower")
"""Number of directions of the current; its speeds, as shares of the boat's speed; shapes of the routes."""


class Receiver(NamedTuple):
    """Errors ("rtk" 0.02 m, "white" 0.3 m, "wandering" like a low-cost receiver), rate (Hz), whether with velocity."""

    errors: str
    rate: float
    velocity: bool


RECEIVERS = tuple(Receiver(*each) for each in product(("rtk", "white", "wandering"), (1.0, 5.0, 10.0), (True, False)))
WHITE = {"rtk": 0.02, "white": 0.3, "wandering": 0.05}
WANDERING = ((1.5, 300.0), (0.25, 5.0))
LATENCY, VELOCITY_STD = 0.2, 0.05
"""Latency of positions, s; 1σ of a velocity, north and east each, m/s."""


class Case(NamedTuple):
    """One run."""

    craft: str
    shape: str
    share: float  # of the boat's speed
    direction: float  # towards which the current sets, rad
    receiver: Receiver


def waypoints(case: Case) -> np.ndarray:
    """(n, 2) north and east, m."""
    side = CRAFT[case.craft].side
    if case.shape == "square":
        return np.array([(0.0, 0.0), (side, 0.0), (side, side), (0.0, side), (0.0, 0.0)])
    return lawnmower(0.0, 0.0, 0.0, side, 0.4 * side, 3, 0.25 * side)


def drawn(seed: int) -> list[Case]:
    """The cases of a seed: every direction with the Otter and the motorboat, the other factors evenly mixed."""
    random = np.random.default_rng((seed, 15))
    cases = []
    for name, craft in CRAFT.items():
        n = craft.runs
        angles = random.permutation(DIRECTIONS)[:n]
        shares = random.permutation(np.resize(np.arange(len(SHARES)), n))
        shapes = random.permutation(np.resize(np.arange(len(SHAPES)), n))
        first = random.integers(len(RECEIVERS))
        receivers = random.permutation((first + np.arange(n)) % len(RECEIVERS))
        for angle, share, shape, receiver in zip(angles, shares, shapes, receivers, strict=True):
            towards = math.tau * float(angle) / DIRECTIONS
            cases.append(Case(name, SHAPES[shape], SHARES[share], towards, RECEIVERS[receiver]))
    return cases


def all_cases() -> list[Case]:
    """The full grid."""
    angles = [math.tau * k / DIRECTIONS for k in range(DIRECTIONS)]
    return [Case(*each) for each in product(CRAFT, SHAPES, SHARES, angles, RECEIVERS)]


GATE = 0.75, 1.5
"""Bounds, s, of the time of unbroken rejections after which the autopilot stops. The time is three intervals of the
fixes."""


class JudgedRun(NamedTuple):
    """The numbers of a run; NaN if unknown."""

    case: Case
    finished: bool
    own_stop: bool  # whether the autopilot aboard would have stopped because fixes do not fit its estimate
    legs: float  # RMS distance from the legs after settling, m
    corners: float  # largest distance from the route at the corners, in turn radii
    time: float  # s
    refused: bool = False  # not simulated, because a leg is shorter than its turns


class Gated:
    """An estimator that also keeps the longest time (s) for which fixes were rejected without a break."""

    def __init__(self, estimator):
        self._estimator, self.refused = estimator, 0.0
        self.order = estimator.order

    def step(self, measurements, dt):
        """See `Estimator`."""
        estimate = self._estimator.step(measurements, dt)
        self.refused = max(self.refused, self._estimator.filter.refused_for)
        return estimate


def _receiver(case) -> Gnss:
    errors, rate, velocity = case.receiver
    return Gnss(
        rate=rate,
        white=WHITE[errors],
        markov=WANDERING if errors == "wandering" else (),
        latency=LATENCY if CRAFT[case.craft].step < LATENCY else 0.0,
        velocity_std=VELOCITY_STD if velocity else None,
    )


def pilot(case: Case) -> Pilot:
    """The autopilot of a case."""
    boat = CRAFT[case.craft].boat
    made = steering_pilot(boat, Mission(_route(case)), LineOfSight(boat.lookahead))
    made.estimator = Gated(made.estimator)
    return made


def _route(case):
    points = waypoints(case)
    return Route(points[:, 0], points[:, 1], CRAFT[case.craft].boat.acceptance)


def _current(case):
    return Current(speed=case.share * CRAFT[case.craft].boat.cruise, direction_deg=math.degrees(case.direction))


def sailed(case: Case, seed: int) -> tuple[Run, Pilot]:
    """Simulate a case from rest, the ship from its cruise speed: the run and its pilot."""
    craft = CRAFT[case.craft]
    made = pilot(case)
    longest = sum(np.hypot(*np.diff(waypoints(case), axis=0).T)) / (0.1 * craft.boat.cruise)
    start = Start(0.0, 0.0, 0.3, craft.boat.cruise if case.craft == "mariner" else 0.0)
    run = sail(
        craft.build(),
        made,
        Suite(_receiver(case)),
        longest,
        craft.step,
        start=start,
        environment=Environment(current=_current(case)),
        seed=seed,
    )
    return run, made


def judged(case: Case, seed: int) -> JudgedRun:
    """Simulate a case; returns its numbers. A route is refused if a leg is shorter than its turns in the current."""
    velocity = _current(case).velocity
    if short_leg(CRAFT[case.craft].boat, _route(case), velocity):
        return JudgedRun(case, False, False, math.nan, math.nan, 0.0, True)
    run, made = sailed(case, seed)
    interval = 1.0 / case.receiver.rate
    allowed = min(max(GATE[0], 3.0 * interval), GATE[1])
    refused = made.estimator.refused
    legs, corners = _distances(case, run)
    finished = bool(run["mode"][-1] == Mode.STOPPED)
    return JudgedRun(case, finished, refused >= allowed, legs, corners, float(run.time[-1]))


def _distances(case, run):
    """(RMS from the legs, largest at the corners in turn radii)."""
    craft, target = CRAFT[case.craft], run["leg_target"]
    across = run.true_cross_track
    if case.receiver.errors == "wandering":
        across = across + _slow_error(case, run)
    began = np.searchsorted(target, target, side="left") if np.all(np.diff(target) >= 0.0) else np.zeros(len(run), int)
    on_leg = run.time - run.time[began]
    settled = (run["mode"] == Mode.UNDER_WAY) & (on_leg > craft.settling * np.where(target <= 1.0, 2.0, 1.0))
    turning = (run["mode"] == Mode.UNDER_WAY) & (target > 1.0) & (on_leg <= craft.settling)
    legs = rms(across[settled]) if settled.any() else math.nan
    if not turning.any():
        return legs, math.nan
    boat = craft.boat
    radius = (1.0 + case.share) * boat.cruise / boat.turn_rate
    return legs, float(np.max(_from_route(case, run, turning))) / radius


def _slow_error(case, run):
    """The receiver's slow error across the leg, (n,) m: the mean error of its fixes over 10 s."""
    direction = run["leg_direction"]
    lag = round(LATENCY / CRAFT[case.craft].step) if CRAFT[case.craft].step < LATENCY else 0
    north, east = (run[f"read_{axis}"] - np.roll(run[f"true_{axis}"], lag) for axis in ("north", "east"))
    error = east * np.cos(direction) - north * np.sin(direction)
    known = np.isfinite(error) & (run.time > 1.0)
    width = max(1, round(10.0 * case.receiver.rate))
    mean = np.convolve(np.pad(error[known], width // 2, mode="edge"), np.full(width, 1.0 / width), mode="same")
    return np.interp(run.time, run.time[known], mean[width // 2 : width // 2 + known.sum()])


def _from_route(case, run, rows):
    """Distance of the true position from the nearest point of the route, (m,)."""
    points = waypoints(case)
    places = np.column_stack((run["true_north"][rows], run["true_east"][rows]))
    nearest = np.full(len(places), math.inf)
    for start, stop in pairwise(points):
        ahead = stop - start
        share = np.clip((places - start) @ ahead / (ahead @ ahead), 0.0, 1.0)
        nearest = np.minimum(nearest, np.hypot(*(places - start - share[:, None] * ahead).T))
    return nearest
