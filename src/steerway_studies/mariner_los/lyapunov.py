"""The decrease of V = y_e²/2 that P1 (37)–(38) promise, along approaches to a leg: one ideal, one of the ship."""

import math
from dataclasses import dataclass

import numpy as np

from steerway.control import AnglePID, Autopilot, Rudder, place_poles
from steerway.core import LegState
from steerway.estimation.course import AtFaceValue
from steerway.guidance import LineOfSight, LowPass, Mission, Route
from steerway.pilot import Pilot
from steerway.sensors import Truth
from steerway.simulation import sail
from steerway.vessels import MARINER_CRUISE_SPEED as CRUISE_SPEED
from steerway.vessels import MARINER_RUDDER as RUDDER
from steerway.vessels import Mariner
from steerway_studies.mariner_los.ship import BANDWIDTH, LOOKAHEAD, LOW_PASS, STEP
from steerway_studies.papers.course_autopilot import MARINER_NOMOTO

OFFSET = 600.0
"""m beside the path at the start."""
ARRIVED = 1.0
"""m from the path at which an approach is over."""


@dataclass(frozen=True, eq=False)
class Approach:
    """Time (n,) s, cross-track error (n,) m, and V̇ by (38) at every row, m²/s."""

    time: np.ndarray
    cross_track: np.ndarray
    promised: np.ndarray

    @property
    def lyapunov(self) -> np.ndarray:
        """V (n,), m²."""
        return 0.5 * self.cross_track**2

    @property
    def falling_pct(self) -> float:
        """Part of the steps, until the path is first reached, on which V falls."""
        near = np.flatnonzero(np.abs(self.cross_track) < ARRIVED)
        until = near[0] if len(near) else len(self.time)
        return 100.0 * float(np.mean(np.diff(self.lyapunov[:until]) < 0.0))

    @property
    def largest_error(self) -> float:
        """Largest difference of the V̇ seen, by central differences, from the one promised, m²/s."""
        return float(np.abs(np.gradient(self.lyapunov, self.time) - self.promised)[1:-1].max())

    @property
    def relative_error(self) -> float:
        """The same over the largest V̇ promised."""
        return self.largest_error / float(np.abs(self.promised).max())


def approaches() -> tuple[Approach, Approach]:
    """(ideal, ship): on the desired course χ = χ_d as (37) supposes, and the MARINER ship as steered."""
    return _ideal(), _ship()


def promised(cross_track, speed):
    """V̇ of P1 (38)."""
    return -speed * cross_track**2 / np.hypot(LOOKAHEAD, cross_track)


def _ideal(duration=1500.0):
    error, rows = OFFSET, []
    for k in range(round(duration / STEP)):
        rows.append((k * STEP, error))
        # The midpoint rule: V̇ is compared to a thousandth.
        half = error + 0.5 * STEP * CRUISE_SPEED * math.sin(_desired(error))
        error += STEP * CRUISE_SPEED * math.sin(_desired(half))
    time, cross_track = np.array(rows).T
    return Approach(time, cross_track, promised(cross_track, CRUISE_SPEED))


_NORTHWARD = LegState(
    1, direction=0.0, along_track=0.0, cross_track=0.0, remaining=0.0, distance=0.0, bearing=0.0, speed=0.0
)


def _desired(error):
    return LineOfSight(LOOKAHEAD).step(_NORTHWARD._replace(cross_track=error), math.nan, math.nan, STEP).angle


def _ship(duration=1500.0):
    helm = Autopilot(AnglePID(place_poles(*MARINER_NOMOTO, bandwidth=BANDWIDTH, limit=RUDDER.high)), LowPass(LOW_PASS))
    mission = Mission(Route([0.0, 50e3], [0.0, 0.0]))
    pilot = Pilot(AtFaceValue(), mission, LineOfSight(LOOKAHEAD), helm, Rudder(RUDDER.high), cruise=CRUISE_SPEED)
    run = sail(Mariner(), pilot, Truth(), duration, STEP, start=(0.0, OFFSET, 0.0))
    cross_track = run["true_east"]
    return Approach(run.time, cross_track, promised(cross_track, run.true_sog))
