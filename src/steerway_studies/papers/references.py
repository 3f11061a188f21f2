"""Reference filters of the author's public toolbox (MSS) as they are, to compare guidance.reference with."""

import math

from steerway.core import wrap


def los_observer(angle, rate, command, gain, dt):
    """One step of the LOS observer with gain K_f (1/s): (angle, "rate"), rad.

    The "rate" is the angle less its low-pass, so on a ramp it is dt/(1 − exp(−dt/T_f)) times the true rate with
    T_f = 1/(K_f + 2√K_f + 1) in s: 0.44 of it for K_f = 0.3 at dt = 0.05 s. It has the unit of an angle.
    """
    keep = math.exp(-dt * (gain + 2.0 * math.sqrt(gain) + 1.0))
    lagged = keep * (angle - rate) + (1.0 - keep) * angle
    following = angle + dt * (rate + gain * wrap(command - angle))
    return following, following - lagged


def reference_model(angle, rate, acceleration, command, bandwidth, damping, max_rate, dt):
    """One step of the third-order reference model by Euler's rule: (angle, rate, acceleration).

    At its rate limit the acceleration goes on by itself and is no longer the rate's; the angle is not wrapped.
    """
    spread = 2.0 * damping + 1.0
    jerk = -(bandwidth**3) * (angle - command) - spread * (bandwidth**2 * rate + bandwidth * acceleration)
    following = rate + dt * acceleration
    return angle + dt * rate, max(-max_rate, min(max_rate, following)), acceleration + dt * jerk
