"""The papers' course autopilots as printed; corrected with `printed=False`. For studies and tests, never for a boat.

P0: Fossen and Fossen, Sensors 21, 2021, 7910. P1: Fossen, "Line-of-sight path-following control utilizing an extended
Kalman filter", Journal of Marine Science and Technology, 2022.
"""

import numpy as np

from steerway.core import wrap

OTTER_NOMOTO = (0.0242, 1.0)
"""K in s/(kg·m²) and T in s, P0 (64)–(65); the unit of K is printed as kg·m²·s."""

OTTER_PRINTED_GAINS = (93.15, 6.67, 0.89)
"""K_p in N·m/rad, T_i and T_d in s, P0 (68); the printed K gives K_p = 92.98, and 93.15 needs T/K = 41.4."""

MARINER_NOMOTO = (0.185, 107.3)
"""K in 1/s and T in s, P1 §4."""


def rudder(course_error, integral, rate_error, gains, feedforward=0.0, printed=True):
    """P1 (29): rudder (rad) for gains (K_p, T_i, T_d); errors in rad and rad/s, integral of the wrapped error in rad·s.

    Printed with minus signs inside the bracket, which makes the closed loop unstable; P0 (54) has them right.
    """
    proportional, integral_time, derivative_time = gains
    others = integral / integral_time + derivative_time * rate_error
    bracket = wrap(course_error) + (-others if printed else others)
    return feedforward - proportional * bracket


def feedforward(desired_rate, desired_acceleration, nomoto, printed=True):
    """P1 (30): rudder (rad) that makes a Nomoto ship (K, T) follow; the printed 1/T belongs to 1/K, as in P0 (55)."""
    gain, time_constant = nomoto
    return time_constant / gain * desired_acceleration + desired_rate / (time_constant if printed else gain)


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
