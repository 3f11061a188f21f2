"""The papers' course steering as printed; with `printed=False` corrected. For studies and tests, never for a boat.

The Otter's allocation, P4's rule for missed waypoints, and the unchanged reference filters of the author's public
toolbox (MSS), with which `core.reference` is compared.

P0: Fossen and Fossen, Sensors 21, 2021, 7910. P1: Fossen, "Line-of-sight path-following control utilizing an extended
Kalman filter", Journal of Marine Science and Technology, 2022. P4: Motwani, Sharma, Sutton and Culverhouse, weighted
interval Kalman filter on Springer.
"""

import math

import numpy as np

from steerway.core import LegState, wrap

OTTER_NOMOTO = (0.0242, 1.0)
"""K in s/(kg·m²) and T in s, P0 (64)–(65); the unit of K is printed as kg·m²·s."""

OTTER_PRINTED_GAINS = (93.15, 6.67, 0.89)
"""K_p in N·m/rad, T_i and T_d in s, P0 (68). The printed K gives K_p = 92.98; 93.15 results from T/K = 41.4."""

MARINER_NOMOTO = (0.185, 107.3)
"""K in 1/s and T in s, P1 §4."""


def closed_loop_poles(gains, nomoto, printed=True):
    """(3,) poles (1/s) of a Nomoto ship under P1 (29), or under P0 (54) with `printed=False`: P0 (56), P1 (31)."""
    proportional, integral_time, derivative_time = gains
    gain, time_constant = nomoto
    stiffness = gain * proportional / time_constant
    sign = -1.0 if printed else 1.0
    return np.roots(
        [
            1.0,
            1.0 / time_constant + sign * stiffness * derivative_time,
            stiffness,
            sign * stiffness / integral_time,
        ]
    )


class AlwaysByCourse:
    """A hand-over that always steers by course, at any speed and from the first step, as in the papers."""

    by_course = True

    def step(self, speed, course, heading, dt, wanted=True) -> bool:
        """True, see `control.handover.HandOver`."""
        return True


GAIN = 0.0111
"""k in kg·m, P0 (60)."""

ARM = 0.395
"""Lever arm of a propeller, m; l_1 = −0.395 belongs to the port propeller, l_2 = 0.395 to the starboard one."""


def propeller_speeds(surge_force, yaw_moment):
    """(n_1, n_2) in rad/s for a surge force (N) and yaw moment (N·m), P0 (60)–(63): one gain, no limits."""
    half = yaw_moment / ARM
    return tuple(
        math.copysign(math.sqrt(abs(square)), square)
        for square in (0.5 * (surge_force + half) / GAIN, 0.5 * (surge_force - half) / GAIN)
    )


class RangeRatePassing:
    """P4's test for missed waypoints: reached inside the circle of acceptance, P4 (22); missed when the range rises.

    The test is meant for a boat that passes beside a waypoint; a boat that turns round after switching triggers it too.
    Use it in place of `Passing`, one object for each mission.
    """

    time_factor = None
    time_margin = 0.0

    def __init__(self):
        self._target, self._last, self._fell = -1, math.inf, False

    def verdict(self, leg: LegState, acceptance: float, _: float = math.nan) -> tuple[bool, str] | None:
        if leg.target != self._target:
            self._target, self._last, self._fell = leg.target, math.inf, False
        rises, self._last = leg.distance > self._last, leg.distance
        if leg.distance <= acceptance:
            return True, "circle"
        missed = self._fell and rises
        self._fell = self._fell or not rises
        return (False, "range rate") if missed else None


def los_observer(angle, rate, command, gain, dt):
    """One step of the LOS observer with gain K_f (1/s): (angle, "rate"), rad.

    The "rate" is the angle minus its low-pass. On a ramp it is dt/(1 − exp(−dt/T_f)) times the true rate, with
    T_f = 1/(K_f + 2√K_f + 1) in s: 0.44 times for K_f = 0.3 and dt = 0.05 s. Its unit is that of an angle.
    """
    keep = math.exp(-dt * (gain + 2.0 * math.sqrt(gain) + 1.0))
    lagged = keep * (angle - rate) + (1.0 - keep) * angle
    following = angle + dt * (rate + gain * wrap(command - angle))
    return following, following - lagged


def reference_model(angle, rate, acceleration, command, bandwidth, damping, max_rate, dt):
    """One step of the third-order reference model by Euler's rule: (angle, rate, acceleration).

    At the rate limit the acceleration is integrated further and no longer the derivative of the rate. The angle is not
    wrapped.
    """
    spread = 2.0 * damping + 1.0
    jerk = -(bandwidth**3) * (angle - command) - spread * (bandwidth**2 * rate + bandwidth * acceleration)
    following = rate + dt * acceleration
    return angle + dt * rate, max(-max_rate, min(max_rate, following)), acceleration + dt * jerk
