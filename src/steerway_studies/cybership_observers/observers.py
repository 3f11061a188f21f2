"""Constructors of the study's observers, one call for each run; and P2's control law on true states, without noise."""

import math
import warnings
from dataclasses import replace

import numpy as np

from steerway.control import PositionPID
from steerway.estimation.positioning import (
    DEMO_GAINS,
    ObserverGains,
    PassiveObserver,
    SpeedDependentFixNoise,
    TimeVaryingNoise,
    VesselFilter,
    VesselNoise,
)
from steerway.vessels import CALM, CyberShip2
from steerway.vessels import CYBERSHIP2_DAMPING as DAMPING
from steerway.vessels import CYBERSHIP2_INERTIA as INERTIA
from steerway_studies.cybership_observers import scenario

BASE = VesselNoise(position_std=scenario.FIX_STD, heading_std=scenario.HEADING_STD)
PRODUCT = replace(BASE, force_std=tuple(scenario.FORCE_STD), force_time=scenario.FORCE_TIME)
RECIPE_B = 1.5e-3
"""The scale of Q with which Table III is reproduced."""

TUNED_GAINS = ObserverGains.of_inertia(INERTIA)


PRINTED_NOISE = TimeVaryingNoise()
"""Q as (19) prints it."""


def time_varying(noise=PRINTED_NOISE, fix_noise=None) -> VesselFilter:
    """P2's filter, corrected: (20) clips, Q is a density, no gate. The printed Q by default."""
    return VesselFilter(INERTIA, DAMPING, BASE, math.inf, fix_noise, noise)


def constant(scale: float, yaw: float) -> TimeVaryingNoise:
    """Q that does not depend on the velocity."""
    return TimeVaryingNoise(coefficient=0.0, scale=scale, yaw=yaw)


def product(noise=PRODUCT, gate=13.8) -> VesselFilter:
    """The nine-state filter."""
    return VesselFilter(INERTIA, DAMPING, noise, gate, None)


def speed_aware(noise) -> VesselFilter:
    """A filter whose R grows with the estimated speed in the same way as the noise of `scenario.growing`."""
    return time_varying(noise, SpeedDependentFixNoise(scenario.FIX_STD, scenario.DOUBLING))


def observer(gains=TUNED_GAINS, correction="impulsive", check=True) -> PassiveObserver:
    """The passive observer without its warnings, because the study measures their subject."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return PassiveObserver(INERTIA, DAMPING, gains, correction, check=check)


def stock_observer() -> PassiveObserver:
    """The passive observer with the public simulator's gains, on measurements held from fix to fix."""
    return observer(DEMO_GAINS, "held")


def bound(record, noise=PRODUCT) -> tuple[float, float]:
    """The least mean |error| (m) of an unbiased estimator on a record, over all times and at fixes.

    The Cramér–Rao bound of P. Tichavský, C. Muravchik and A. Nehorai (1998), Posterior Cramér–Rao bounds for
    discrete-time nonlinear filtering, IEEE Transactions on Signal Processing 46(5): the filter's covariance along the
    true states, with no process noise except the disturbance. A Gaussian error of 1σ s has a mean |error| of s √(2/π).
    """
    known = product(replace(noise, acceleration=(0.0, 0.0, 0.0)), math.inf)
    variances = np.full((scenario.ROWS, 2), BASE.start_std[0] ** 2)
    for k in range(1, scenario.ROWS):
        known.state[:6], known.state[6:9] = record.states[k - 1], record.pushes[k - 1]
        known.predict(record.forces[k - 1], scenario.STEP)
        known.update_heading(known.state[2])
        if k % scenario.PER_FIX == 0:
            known.update(*known.state[:2])
        variances[k] = known.covariance_upper.diagonal()[:2]
    mean_error = math.sqrt(2.0 / math.pi) * np.sqrt(variances)
    return float(mean_error.mean()), float(mean_error[scenario.PER_FIX :: scenario.PER_FIX].mean())


def control_numbers() -> dict[str, float]:
    """Rise time, overshoot and end position of the corrected law; end position of the printed law; growth of both."""
    printed = _way(PositionPID(scenario.PRINTED_GAINS, anti_windup=False))
    careful = _way(PositionPID(scenario.PRINTED_GAINS))
    literal = _literal_way()
    out = {}
    for i, name in enumerate(("north", "east")):
        out[f"pid_rise_{name}"] = rise(printed[:, i], scenario.GOAL[i])
        out[f"pid_overshoot_{name}_pct"] = overshoot(printed[:, i], scenario.GOAL[i])
        out[f"pid_end_{name}"] = printed[-1, i]
        out[f"pid_anti_windup_overshoot_{name}_pct"] = overshoot(careful[:, i], scenario.GOAL[i])
    out["pid_literal_end_error"] = math.dist(literal[-1, :2], scenario.GOAL[:2])
    out["pid_literal_turned_deg"] = math.degrees(literal[-1, 2])
    out["pid_literal_growth"] = growth(-1.0)
    out["pid_corrected_growth"] = growth(1.0)
    return out


def rise(place, goal) -> float:
    """Rise time from 10 to 90 % of the goal, s."""
    return float(scenario.STEP * (np.argmax(place >= 0.9 * goal) - np.argmax(place >= 0.1 * goal)))


class PrintedPositionPID:
    """P2 (30) as printed: τ = K_p x̃ + K_d dx̃/dt + K_i ∫x̃ dt, positive gains and no rotation into body axes."""

    def __init__(self, gains):
        self._gains = gains
        self._integral = np.zeros(3)

    def step(self, desired, north, east, heading, velocity, dt) -> np.ndarray:
        """Force (3,) within the limits. `velocity`: rates of north, east and heading; x_d is assumed constant."""
        gains = self._gains
        error = np.array([north, east, heading]) - desired
        self._integral += dt * error
        wanted = gains.proportional @ error + gains.derivative @ velocity + gains.integral @ self._integral
        return np.clip(wanted, -np.array(gains.limit), gains.limit)


def overshoot(place, goal) -> float:
    """Overshoot beyond the goal, % of the goal."""
    return float(100.0 * (place.max() / goal - 1.0))


def growth(sign) -> float:
    """The largest real part (1/s) of the closed loop's poles at rest heading north; `sign` −1 for (30) as printed."""
    gains, inverse = scenario.PRINTED_GAINS, np.linalg.inv(INERTIA)
    nothing, one = np.zeros((3, 3)), np.eye(3)
    loop = np.block(
        [
            [nothing, one, nothing],
            [-sign * inverse @ gains.proportional, -inverse @ (DAMPING + sign * gains.derivative), sign * inverse],
            [-gains.integral, nothing, nothing],
        ]
    )
    return float(np.linalg.eigvals(loop).real.max())


def _way(controller):
    return scenario.sail(scenario.drawn(0), disturbed=False, controller=controller).states


def _literal_way():
    """States with (30) as printed, which uses the rates of north, east and heading in place of the body's velocity."""
    vessel, controller = CyberShip2(), PrintedPositionPID(scenario.PRINTED_GAINS)
    states = [vessel.start()]
    for k in range(scenario.STEPS):
        motion = vessel.motion(states[-1], CALM)
        velocity = (motion.north_velocity, motion.east_velocity, motion.yaw_rate)
        force = controller.step(scenario.desired(k), *states[-1][:3], velocity, scenario.STEP)
        states.append(vessel.step(states[-1], force, CALM, scenario.STEP))
    return np.array(states)
