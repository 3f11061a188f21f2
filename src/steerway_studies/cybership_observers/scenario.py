"""Scenario S*: CyberShip II goes 10 m north, 10 m east and 45° in a disturbance, under P2's PID.

P2 states neither noise nor disturbance nor steps. Used here: Runge–Kutta steps of 0.1 s over 100 s; GNSS at
1 Hz with white noise of 0.098 m; a compass at 10 Hz with 0.5°; a Gauss–Markov force in NED of (0.29 N, 0.29 N,
0.029 N·m) over 50 s, clipped at 2.5σ, unless it is switched off.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from steerway.control import PositioningGains, PositionPID
from steerway.core import markov_decay, markov_step, wrap
from steerway.vessels import CYBERSHIP2_THRUST as THRUST
from steerway.vessels import CyberShip2, conditions

STEP, STEPS = 0.1, 1000
PER_FIX = 10
ROWS = STEPS + 1
TIME = STEP * np.arange(ROWS)
FIX_STD, HEADING_STD = 0.098, math.radians(0.5)
FORCE_STD, FORCE_TIME, FORCE_CLIP = np.array([0.29, 0.29, 0.029]), 50.0, 2.5
CHANGE = 10.0
GOAL = (10.0, 10.0, math.radians(45.0))

PRINTED_GAINS = PositioningGains(
    proportional=[[0.5160, 0.0, 0.0], [0.0, 0.6760, 0.0202], [0.0, 0.0202, 0.0552]],
    integral=[[0.0026, 0.0, 0.0], [0.0, 0.0034, 0.0001], [0.0, 0.0001, 0.0003]],
    derivative=[[4.1280, 0.0, 0.0], [0.0, 5.4080, 0.1618], [0.0, 0.1618, 0.4416]],
    limit=tuple(each.high for each in THRUST),
)
"""P2 (36)–(38)."""


def desired(row: int):
    """The setpoint of P2 §III at a row."""
    return GOAL if row * STEP >= CHANGE - 1e-9 else (0.0, 0.0, 0.0)


class Draws(NamedTuple):
    """The random numbers of one run, standard normal; the same for every observer."""

    force: np.ndarray  # (rows, 3)
    fix: np.ndarray  # (fixes, 2)
    heading: np.ndarray  # (rows,)


def drawn(seed: int) -> Draws:
    """The draws of a seed."""
    chance = np.random.default_rng(seed)
    sizes = (ROWS, 3), (STEPS // PER_FIX + 1, 2), ROWS
    return Draws(*(chance.standard_normal(size) for size in sizes))


def disturbance(draws: Draws) -> np.ndarray:
    """(rows, 3) the force in north, east (N) and yaw (N·m), started from its stationary distribution."""
    decay = markov_decay(FORCE_TIME, STEP)
    force = np.empty((ROWS, 3))
    force[0] = FORCE_STD * draws.force[0]
    for k in range(1, ROWS):
        for i in range(3):
            force[k, i] = markov_step(force[k - 1, i], decay, FORCE_STD[i], draws.force[k, i])
    return np.clip(force, -FORCE_CLIP * FORCE_STD, FORCE_CLIP * FORCE_STD)


@dataclass(frozen=True)
class SimulatedRun:
    """One run: rows 0.1 s apart.

    `states` (rows, 6), `forces` (rows − 1, 3) of the actuators, `pushes` (rows, 3) of the disturbance, `fixes`
    (rows, 2), NaN between fixes, and `headings` (rows,).
    """

    states: np.ndarray
    forces: np.ndarray
    pushes: np.ndarray
    fixes: np.ndarray
    headings: np.ndarray


def sail(
    draws: Draws,
    disturbed: bool = True,
    fix_noise: Callable | None = None,
    controller=None,
) -> SimulatedRun:
    """One run, controlled by the true states."""
    vessel = CyberShip2()
    controller = controller or PositionPID(PRINTED_GAINS, anti_windup=False)
    pushes = disturbance(draws) if disturbed else np.zeros((ROWS, 3))
    noise = (fix_noise or white)(draws)
    states, forces = np.empty((ROWS, 6)), np.empty((STEPS, 3))
    fixes, headings = np.full((ROWS, 2), math.nan), np.empty(ROWS)
    state = vessel.start()
    for k in range(ROWS):
        if k:
            state = vessel.step(state, forces[k - 1], conditions((0.0, 0.0), pushes[k - 1, :2], pushes[k - 1, 2]), STEP)
        states[k] = state
        headings[k] = wrap(state[2] + HEADING_STD * draws.heading[k])
        if k % PER_FIX == 0:
            fixes[k] = state[:2] + noise(k // PER_FIX, math.hypot(state[3], state[4]))
        if k < STEPS:
            forces[k] = controller.step(desired(k), *state[:3], state[3:], STEP)
    return SimulatedRun(states, forces, pushes, fixes, headings)


def correct(observer, force, fix, heading) -> float:
    """One step of an observer: predict, correct by heading and fix. Returns the NIS of the fix, NaN without one."""
    observer.predict(force, STEP)
    if math.isfinite(heading):
        observer.update_heading(heading)
    return observer.update(*fix) if math.isfinite(fix[0]) else math.nan


def white(draws: Draws, std: float = FIX_STD):
    """White noise of fixes: a function of the fix's number and the speed (m/s) that returns (2,) m."""
    return lambda i, speed: std * draws.fix[i]


DOUBLING = 0.25
"""Speed (m/s) at which `growing` noise is twice that at rest."""


def growing(draws: Draws):
    """As `white`, but the noise grows with the vessel's speed."""
    return lambda i, speed: FIX_STD * (1.0 + speed / DOUBLING) * draws.fix[i]


@dataclass(frozen=True)
class ObserverRun:
    """An observer on a record: `errors` (rows, 2) north and east (m), `heading_errors` (rows,) rad, mean `nis`."""

    errors: np.ndarray
    heading_errors: np.ndarray
    nis: float
    places: np.ndarray

    @property
    def mae(self) -> float:
        """Mean |error| over north and east at all times, m."""
        return float(np.abs(self.errors).mean())

    @property
    def mae_at_fixes(self) -> float:
        """Mean |error| over north and east right after each fix, m."""
        return float(np.abs(self.errors[PER_FIX::PER_FIX]).mean())

    @property
    def heading_mae(self) -> float:
        """Mean |heading error|, rad."""
        return float(np.abs(self.heading_errors).mean())


def watch(observer, record: SimulatedRun, compass: bool = True) -> ObserverRun:
    """Run an observer over a record, from an initial error of zero; with the heading if `compass`."""
    observer.start(0.0, 0.0, 0.0)
    places, nis = np.zeros((ROWS, 3)), []
    for k in range(1, ROWS):
        heading = record.headings[k] if compass else math.nan
        nis.append(correct(observer, record.forces[k - 1], record.fixes[k], heading))
        places[k] = observer.motion[:3]
    off = places - record.states[:, :3]
    heading = np.array([wrap(each) for each in off[:, 2]])
    known = [value for value in nis if math.isfinite(value)]
    return ObserverRun(off[:, :2], heading, float(np.mean(known)) if known else math.nan, places)


def held_fixes(record: SimulatedRun) -> np.ndarray:
    """(rows, 2) errors of an observer that repeats the last fix."""
    last = record.fixes[(np.arange(ROWS) // PER_FIX) * PER_FIX]
    return last - record.states[:, :2]
