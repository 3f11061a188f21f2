"""What is sailed: boats, routes, currents and receivers, and which of them a seed draws."""

import math
from itertools import product
from typing import NamedTuple

import numpy as np

from steerway.guidance import lawnmower
from steerway.vessels import (
    MARINER_BOAT_IN_CURRENT,
    MOTORBOAT_BOAT,
    OTTER_BOAT_IN_CURRENT,
    Mariner,
    Motorboat,
    Otter,
)


class Craft(NamedTuple):
    """A boat: how its model is made, its numbers, the side of its square (m) and the step of its simulation (s)."""

    build: object
    boat: object
    side: float
    step: float
    settling: float  # s after a turn, before a leg counts
    runs: int  # a seed


def _otter():
    return Otter(25.0, (0.05, 0.0, -0.35))


CRAFT = {
    "otter": Craft(_otter, OTTER_BOAT_IN_CURRENT, 80.0, 0.05, 20.0, 16),
    "motorboat": Craft(Motorboat, MOTORBOAT_BOAT.but(cruise=2.0), 80.0, 0.05, 20.0, 16),
    "mariner": Craft(Mariner, MARINER_BOAT_IN_CURRENT, 6000.0, 0.5, 600.0, 8),
}
SHIP_LENGTH = 160.93
DIRECTIONS, SHARES, SHAPES = 16, (0.0, 0.25, 0.5, 0.8), ("square", "lawnmower")
"""Directions of the current, its speed in shares of the boat's, and what is sailed."""


class Receiver(NamedTuple):
    """A receiver: its errors ("rtk" 0.02 m, "white" 0.3 m, "wandering" as of a small receiver), rate, velocity."""

    errors: str
    rate: float
    velocity: bool


RECEIVERS = tuple(Receiver(*each) for each in product(("rtk", "white", "wandering"), (1.0, 5.0, 10.0), (True, False)))
WHITE = {"rtk": 0.02, "white": 0.3, "wandering": 0.05}
WANDERING = ((1.5, 300.0), (0.25, 5.0))
LATENCY, VELOCITY_STD = 0.2, 0.05
"""s, and m/s of north and of east."""


class Case(NamedTuple):
    """One run."""

    craft: str
    shape: str
    share: float  # of the boat's speed
    direction: float  # towards which the current sets, rad
    receiver: Receiver
    variant: str = ""  # what is taken away, "" for nothing


def waypoints(case: Case) -> np.ndarray:
    """(n, 2) north and east, m."""
    side = CRAFT[case.craft].side
    if case.shape == "square":
        return np.array([(0.0, 0.0), (side, 0.0), (side, side), (0.0, side), (0.0, 0.0)])
    return lawnmower(0.0, 0.0, 0.0, side, 0.4 * side, 3, 0.25 * side)


def drawn(seed: int) -> list[Case]:
    """The runs of a seed: every direction with the Otter and the motorboat, the other factors evenly mixed."""
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


VARIANTS = {
    "": "as it is",
    "positions": "without the receiver's velocity",
    "orders": "orders unknown to the estimate",
    "learning": "receiver's noise not learned",
    "early": "turns not begun early",
    "five-state": "course by the five-state filter, current unknown",
}
"""What is taken away, for the ablations."""


def ablations(seed: int) -> list[Case]:
    """Runs of a seed in a current of half the speed, each with every variant."""
    random = np.random.default_rng((seed, 16))
    cases = []
    for name in ("otter", "motorboat"):
        towards = math.tau * float(random.integers(DIRECTIONS)) / DIRECTIONS
        base = Case(name, "square", 0.5, towards, Receiver("white", 5.0, True))
        cases += [base._replace(variant=variant) for variant in VARIANTS]
    return cases
