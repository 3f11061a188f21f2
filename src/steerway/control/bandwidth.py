"""The loop obeys the estimator: how quick an autopilot may be on a course made of positions."""

import numpy as np

from steerway.control.course import place_poles
from steerway.core.checks import not_negative, positive

COMFORTABLE = 0.2
"""Relative damping of the slowest-dying swing above which a loop is called calm."""


def carried_bandwidth(speed: float, course_rate_density: float, position_std: float, fix_interval: float) -> float:
    """ω_e = (U² S_ω / (σ² T_gnss))^(1/6), rad/s: the bandwidth of the course estimate, above which a boat hunts.

    speed U in m/s, spectral density S_ω of the course acceleration in rad²/s³, position_std σ of one fix and axis in m,
    fix_interval T_gnss in s. From the steady Kalman filter of a triple integrator: course is position over U, so its
    measurement density is σ² T/U², and the gain's natural frequency is the sixth root of process over measurement.
    """
    not_negative("speed", speed)
    positive("course_rate_density", course_rate_density)
    positive("position_std", position_std)
    positive("fix_interval", fix_interval)
    return (speed**2 * course_rate_density / (position_std**2 * fix_interval)) ** (1.0 / 6.0)


def loop_damping(bandwidth: float, carried: float, nomoto_time: float, damping: float = 1.0) -> float:
    """Least relative damping −Re s/|s| among the poles of autopilot, vessel and estimator together; below 0 she hunts.

    The autopilot of `place_poles` on a Nomoto vessel of time constant T, fed with course and rate from a steady filter
    whose three poles lie at ω_e (s³ + 2ω_e s² + 2ω_e² s + ω_e³): it shows the course as (2ω_e² s + ω_e³)/(…), the rate
    as ω_e³ s/(…) of the true course. A filter of ω_e = ω_n is stable for T ω_n up to 0.55 only; T ω_n = 1 takes
    ω_e = 2 ω_n and a slow vessel 3.8 ω_n.
    """
    gains = place_poles(1.0, nomoto_time, bandwidth, damping)
    filtering = np.polynomial.Polynomial([carried**3, 2.0 * carried**2, 2.0 * carried, 1.0])
    course = np.polynomial.Polynomial([carried**3, 2.0 * carried**2])
    s = np.polynomial.Polynomial([0.0, 1.0])
    control = (s + 1.0 / gains.integral_time) * course + gains.derivative_time * carried**3 * s**2
    poles = (s**2 * (nomoto_time * s + 1.0) * filtering + gains.proportional * control).roots()
    return float(np.min(-poles.real / np.abs(poles)))


def yaw_rate_gain(carried: float) -> float:
    """Gain k (1/s) from course error to an asked yaw rate, for an estimate that carries ω_e (rad/s): k = 0.3 ω_e.

    Largest round number that keeps the least relative damping of the loop s (T s + 1) F(s) + k (2ω_e² s + ω_e³), F the
    filter of `loop_damping`, at `COMFORTABLE` whatever the time T in which the vessel follows a yaw rate.
    """
    return 0.3 * carried


def advice(
    bandwidth: float,
    speed: float,
    course_rate_density: float,
    position_std: float,
    fix_interval: float,
    nomoto_time: float | None = None,
    damping: float = 1.0,
) -> tuple[bool, str]:
    """(whether it fits, one sentence) for an autopilot of `bandwidth` ω_n in rad/s; the rest as carried_bandwidth.

    With the vessel's `nomoto_time` (s) the loop's damping is judged too: ω_n ≤ ω_e alone does not make it stable.
    """
    positive("autopilot.bandwidth", bandwidth)
    carried = carried_bandwidth(speed, course_rate_density, position_std, fix_interval)
    circumstances = f"at {speed:g} m/s with fixes of {position_std:g} m every {fix_interval:g} s"
    left = None if nomoto_time is None or carried == 0.0 else loop_damping(bandwidth, carried, nomoto_time, damping)
    if bandwidth <= carried and (left is None or left > 0.0):
        calm = "" if left is None else f" with a damping of {left:.2g} in the loop"
        warning = "; she will swing, a lower bandwidth is calmer" if left is not None and left < COMFORTABLE else ""
        return True, (
            f"An autopilot of {bandwidth:.2g} rad/s fits{calm}: the course estimate carries {carried:.2g} rad/s "
            f"{circumstances}{warning}."
        )
    if bandwidth > carried:
        trouble, remedy = "", "to that"
    else:
        trouble, remedy = f", which is too near to it for a vessel with T = {nomoto_time:g} s", "further"
    return False, (
        f"An autopilot of {bandwidth:.2g} rad/s will hunt: the course estimate carries {carried:.2g} rad/s "
        f"{circumstances}{trouble}, so lower the bandwidth {remedy}, sail faster or use better fixes."
    )
