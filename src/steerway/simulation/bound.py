"""Lower bound of the course error of any estimator, from the fixes and orders of a run.

The Cramér–Rao bound of P. Tichavský, C. H. Muravchik and A. Nehorai, IEEE Trans. Signal Processing 46(5), 1998, by the
Riccati recursion of `estimation.steering.motion` at the true states. Response, wind, bias and the parameters of the
receiver's errors count as known.
"""

import math

import numpy as np

from steerway.core.arrays import Floats
from steerway.estimation.steering.correction import velocity_of
from steerway.estimation.steering.motion import (
    CURRENT_E,
    CURRENT_N,
    EAST,
    ERROR_E,
    ERROR_N,
    ERROR_TIME,
    GAIN,
    HEADING,
    NORTH,
    STATES,
    TIME,
    WATER_SPEED,
    YAW_RATE,
)
from steerway.estimation.steering.prediction import predict_bank
from steerway.pilot import response_of
from steerway.simulation import assembly
from steerway.simulation.loop import Run
from steerway.simulation.outcome import evaluated
from steerway.simulation.scenario import Scenario

_KNOWN = 1e-6
_UNSTEADY = 0.02
"""1σ of the speed through the water, relative to the usual speed."""
_SLOWEST = 20.0
"""Time constant (s) above which a receiver's error is modelled as a random walk."""


def course_bound(scenario: Scenario, run: Run) -> float:
    """RMS of the smallest possible σ of course over ground on the evaluated rows of a run, rad.

    The receiver measures no velocity. Its errors over seconds have the time constant that the filter assumes.
    """
    known = assembly.boat(scenario)
    response = response_of(known)._replace(
        wander=max(known.yaw_wander / known.turn_rate, _KNOWN),
        slip=0.0,
        slip_time=0.0,
        slip_std=0.0,
        speed_noise=_UNSTEADY,
        gain_std=_KNOWN,
        damping_std=_KNOWN,
        bias_std=_KNOWN,
        speed_gain_std=_KNOWN,
        current_noise=_KNOWN,
    )
    gnss = scenario.gnss
    slow = sum(std**2 for std, time in gnss.markov if time <= _SLOWEST)
    walk = sum(2.0 * std**2 / time for std, time in gnss.markov if time > _SLOWEST)
    truth, parameters = _states(run, response.pivot), response.packed
    orders = np.column_stack((run.time, known.yaw_response.gain * run["yaw"], np.full(len(run), math.nan)))
    p = np.zeros((1, STATES, STATES))
    for k, std in (
        (NORTH, gnss.white),
        (EAST, gnss.white),
        (CURRENT_N, 0.25 * response.speed),
        (CURRENT_E, 0.25 * response.speed),
        (WATER_SPEED, 0.25 * response.speed),
        (HEADING, 0.5),
        (YAW_RATE, 0.5 * response.rate),
    ):
        p[0, k, k] = std**2
    least = np.full(len(run), math.nan)
    fixes = np.flatnonzero(np.isfinite(run["read_north"]))
    before = fixes[0]
    for now in fixes[1:]:
        since, interval = run.time[before], run.time[now] - run.time[before]
        predict_bank(
            truth[before : before + 1].copy(), p, orders[before : now + 1], parameters, slow, since, since + interval
        )
        for k in (NORTH, EAST):
            p[0, k, k] += interval * (walk - 2.0 * slow / ERROR_TIME)  # replaces the filter's own value
        p[0] = _corrected(p[0], truth[now, HEADING], response.pivot, gnss.white)
        least[now] = _course_std(truth[now], p[0], response.pivot)
        before = now
    rows = evaluated(run) & np.isfinite(least)
    return float(np.sqrt(np.mean(least[rows] ** 2)))


def _states(run: Run, pivot: float) -> Floats:
    """True states (n, 21); the heading is the direction of the pivot point's motion through the water."""
    states = np.zeros((len(run), STATES))
    current = run["current_north"], run["current_east"]
    north, east = run["true_north_velocity"] - current[0], run["true_east_velocity"] - current[1]
    c, s = np.cos(run["true_heading"]), np.sin(run["true_heading"])
    ahead, abeam = north * c + east * s, east * c - north * s + pivot * run["true_yaw_rate"]
    states[:, CURRENT_N], states[:, CURRENT_E] = current
    states[:, WATER_SPEED] = np.hypot(ahead, abeam)
    states[:, HEADING] = run["true_heading"] + np.arctan2(abeam, ahead)
    states[:, YAW_RATE], states[:, [GAIN, TIME]] = run["true_yaw_rate"], 1.0
    return states


def _corrected(p: Floats, heading: float, pivot: float, std: float) -> Floats:
    """The covariance after a fix."""
    h = np.zeros((2, STATES))
    h[0, [NORTH, ERROR_N]] = h[1, [EAST, ERROR_E]] = 1.0
    h[:, HEADING] = pivot * math.sin(heading), -pivot * math.cos(heading)
    gain = np.linalg.solve(h @ p @ h.T + std**2 * np.eye(2), h @ p).T
    after = p - gain @ h @ p
    return 0.5 * (after + after.T)


def _course_std(state: Floats, p: Floats, pivot: float) -> float:
    north, east, _, across = velocity_of(state, p, pivot)
    return across / math.hypot(north, east)
