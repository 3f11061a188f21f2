"""The loop obeys the estimator: how quick an autopilot may be on a course made of positions."""

from steerway.checks import not_negative, positive


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


def advice(
    bandwidth: float, speed: float, course_rate_density: float, position_std: float, fix_interval: float
) -> tuple[bool, str]:
    """(whether it fits, one sentence) for an autopilot of `bandwidth` ω_n in rad/s; the rest as carried_bandwidth."""
    positive("autopilot.bandwidth", bandwidth)
    carried = carried_bandwidth(speed, course_rate_density, position_std, fix_interval)
    circumstances = f"at {speed:g} m/s with fixes of {position_std:g} m every {fix_interval:g} s"
    if bandwidth <= carried:
        return True, (
            f"An autopilot of {bandwidth:.2g} rad/s fits: the course estimate carries {carried:.2g} rad/s "
            f"{circumstances}."
        )
    return False, (
        f"An autopilot of {bandwidth:.2g} rad/s will hunt: the course estimate carries {carried:.2g} rad/s "
        f"{circumstances}, so lower the bandwidth to that, sail faster or use better fixes."
    )
