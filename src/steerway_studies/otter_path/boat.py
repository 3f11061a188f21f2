"""One leg of the Otter across current and wind, and what it gave."""

import math
from typing import NamedTuple

import numpy as np

from steerway.core import rms, wrap, wrap_array
from steerway.estimation import FiveStateFilter, Profile
from steerway.estimation.course import FilterEstimator
from steerway.guidance import AdaptiveLineOfSight, IntegralLineOfSight, LineOfSight, Mission, Route, TrackingFilter
from steerway.pilot import Pilot
from steerway.sensors import Compass, Suite, white
from steerway.simulation import Run, Start, sail
from steerway.vessels import OTTER_BOAT_FOR_SMALL_MOMENTS, Current, Environment, Otter

LEG, JUDGED = 400.0, (150.0, 380.0)
SEA = Environment(Current(0.3, math.pi / 2.0), force=(0.0, 5.0))
LOOKAHEAD = {0.7: 10.0, 1.2: 15.0}
NOISES = (0.1, 0.5)
RATE, STEP = 5.0, 0.02
FILTER = {"speed_noise": 1e-3, "course_rate_noise": 4e-3, "course_rate_decay": 0.3}
"""The spectral densities of the filter in the loop, for every noise and speed; the 1σ of the fixes is known to it."""


class PathCase(NamedTuple):
    """One set-up: noise (m), speed (m/s) and law: "course", "heading", "integral" or "adaptive"."""

    noise: float
    speed: float
    law: str = "course"


CASES = (
    *(PathCase(noise, speed) for noise in NOISES for speed in LOOKAHEAD),
    *(PathCase(0.1, speed, law) for law in ("heading", "integral", "adaptive") for speed in LOOKAHEAD),
)


def sailed(case: PathCase, seed: int) -> Run:
    """One leg."""
    boat = OTTER_BOAT_FOR_SMALL_MOMENTS
    pilot = Pilot(
        FilterEstimator(FiveStateFilter(Profile(position_std=case.noise, **FILTER))),
        Mission(Route([0.0, LEG], [0.0, 0.0], 1.0)),
        _law(case),
        boat.autopilot(TrackingFilter(2.0)),
        boat.propulsion,
        boat.speed_loop(),
        cruise=case.speed,
        steer_by="course" if case.law == "course" else "heading",
    )
    instruments = Suite(white(case.noise, RATE), compass=None if case.law == "course" else Compass())
    otter = Otter(25.0, (0.05, 0.0, -0.35))
    start = Start(0.0, 0.0, 0.0, case.speed)
    return sail(otter, pilot, instruments, 1.5 * LEG / case.speed, STEP, start=start, environment=SEA, seed=seed)


def _law(case):
    """The integral and the adaptive law with gains that put both poles of the path error at U/(2Δ)."""
    lookahead = LOOKAHEAD[case.speed]
    if case.law == "integral":
        return IntegralLineOfSight(lookahead, case.speed / 4.0)
    if case.law == "adaptive":
        return AdaptiveLineOfSight(lookahead, case.speed / (2.0 * lookahead) ** 2)
    return LineOfSight(lookahead)


class LegResult(NamedTuple):
    """What one leg gave, on the judged part; m, rad."""

    rms: float
    mean: float
    crab: float
    course_error_rms: float
    yaw_rms: float


def leg(case: PathCase, seed: int) -> LegResult:
    """Sail it and judge it. NaN where the boat never came to the judged part."""
    run = sailed(case, seed)
    rows = (run["true_north"] > JUDGED[0]) & (run["true_north"] < JUDGED[1])
    if not rows.any() or run["true_north"][-1] < JUDGED[1]:
        return LegResult(*[math.nan] * 5)
    east = run["true_east"][rows]
    turn = run["estimated_cog"] - run.true_cog
    error = wrap_array(turn[rows])
    return LegResult(rms(east), float(east.mean()), _crab(run.rows(rows)), rms(error), rms(run["yaw"][rows]))


def _crab(run) -> float:
    """The mean direction over ground less the mean heading."""
    course = math.atan2(run["true_east_velocity"].mean(), run["true_north_velocity"].mean())
    heading = math.atan2(np.sin(run["true_heading"]).mean(), np.cos(run["true_heading"]).mean())
    return wrap(course - heading)
