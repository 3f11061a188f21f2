"""The largest autopilot bandwidth that the delay of a course estimate from positions allows."""

import math

import numpy as np

from steerway.control.course import AnglePIDGains, course_gains
from steerway.core.checks import not_negative, positive

COMFORTABLE = 0.2
"""Smallest damping ratio that `comfortable_bandwidth` allows: an oscillation decays to 28 % in one period."""
RATE_SHARE = 0.3
"""Ratio ω_n/ω_e for a vessel with its own yaw-rate loop. 0.3 is the largest round number with a damping ratio of at
least `COMFORTABLE` for every time constant T (`tests/test_autopilot.py`). The poles of the loop are the roots of
s (T s + 1) F(s) + ω_n (2ω_e² s + ω_e³), F as in `loop_damping`."""
_LEAST = 0.1
"""Bandwidth of `GainSchedule` before speed and fix interval are known, as a fraction of the largest. A slow loop is
safe; a fast one could be unstable."""
_RETUNED = 0.05
"""Relative change of the estimate's bandwidth at which `GainSchedule` redesigns the gains. A damping ratio of 0.2 then
changes by 0.012 for T ω_e up to 0.2, and by 0.04 for T ω_e = 2 (`loop_damping`)."""
_HALVINGS = 14
"""Bisections over 20 octaves in `comfortable_bandwidth`; the result is accurate to 0.1 %."""


def carried_bandwidth(speed: float, course_rate_density: float, position_std: float, fix_interval: float) -> float:
    """Bandwidth of the course estimate (rad/s), ω_e = (U² S_ω / (σ² T_gnss))^(1/6). An autopilot faster than ω_e hunts.

    speed U in m/s, spectral density S_ω of the course acceleration in rad²/s³, position_std σ of one fix and axis in m,
    fix_interval T_gnss in s. Lateral position over U measures the integral of the course with noise density σ² T/U².
    ω_e is the natural frequency of the steady Kalman filter, the sixth root of process over measurement density.
    """
    not_negative("speed", speed)
    positive("course_rate_density", course_rate_density)
    positive("position_std", position_std)
    positive("fix_interval", fix_interval)
    return (speed**2 * course_rate_density / (position_std**2 * fix_interval)) ** (1.0 / 6.0)


def loop_damping(
    bandwidth: float, carried: float, nomoto_time: float, damping: float = 1.0, course_gain: float = 1.0
) -> float:
    """Smallest damping ratio −Re s/|s| among the poles of autopilot, vessel and estimator; negative if unstable.

    The autopilot of `course_gains` steers a Nomoto vessel of time constant T. Course and course rate come from a steady
    filter F(s) = s³ + 2ω_e s² + 2ω_e² s + ω_e³: they are (2ω_e² s + ω_e³)/F and ω_e³ s/F times the true course. With
    ω_e = ω_n the loop is stable for T ω_n up to 0.55 only. T ω_n = 1 needs ω_e = 2 ω_n; a slow vessel needs 3.8 ω_n.
    course_gain: dχ/dψ of a boat in a current (`core.kinematics.course_per_heading`), a factor of the loop gain.
    """
    gains = course_gains(1.0, nomoto_time, bandwidth, damping)
    filtering = np.polynomial.Polynomial([carried**3, 2.0 * carried**2, 2.0 * carried, 1.0])
    course = np.polynomial.Polynomial([carried**3, 2.0 * carried**2])
    s = np.polynomial.Polynomial([0.0, 1.0])
    control = (s + 1.0 / gains.integral_time) * course + gains.derivative_time * carried**3 * s**2
    poles = (s**2 * (nomoto_time * s + 1.0) * filtering + course_gain * gains.proportional * control).roots()
    return float(np.min(-poles.real / np.abs(poles)))


def comfortable_bandwidth(carried: float, nomoto_time: float | None) -> float:
    """Largest bandwidth ω_n (rad/s) that a course estimate supports with a damping ratio of at least `COMFORTABLE`.

    carried: bandwidth ω_e of the estimate, rad/s; nomoto_time: T, s. By `loop_damping` ω_n is 0.36 ω_e for a vessel
    that follows at once, 0.2 ω_e for a slow one. For a vessel with its own yaw-rate loop of unknown time constant,
    nomoto_time is None, and ω_n is `RATE_SHARE` of ω_e.
    """
    positive("carried", carried)
    if nomoto_time is None:
        return RATE_SHARE * carried
    low, high = -20.0, 0.0  # powers of two of ω_n/ω_e
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        calm = loop_damping(carried * 2.0**middle, carried, nomoto_time) >= COMFORTABLE
        low, high = (middle, high) if calm else (low, middle)
    return carried * 2.0**low


class GainSchedule:
    """Autopilot gains for the bandwidth of the course estimate at the present speed and fix interval.

    nomoto_time: T of the yaw rate, s; the command is the steady yaw rate (Nomoto gain 1). None for a vessel with its
        own yaw-rate loop: this loop rejects wind, so the autopilot needs no integral.
    course_rate_density, position_std: parameters of the estimator, see `carried_bandwidth`.
    most: upper limit of the bandwidth, also for an accurate estimate, rad/s.
    fix_interval: interval of fixes, s; it may be set at any time; NaN while unknown.
    """

    def __init__(self, nomoto_time: float | None, course_rate_density: float, position_std: float, most: float):
        self._time = nomoto_time
        self._density, self._std = course_rate_density, position_std
        self._most = positive("autopilot.bandwidth", most)
        self.fix_interval = math.nan
        self._designed_for = math.nan
        self._gains = self._design(_LEAST * most)

    def gains(self, speed: float) -> AnglePIDGains:
        """The gains at a speed over ground (m/s); unchanged while speed or fix interval is unknown."""
        if not (speed > 0.0 and self.fix_interval > 0.0):
            return self._gains
        carried = carried_bandwidth(speed, self._density, self._std, self.fix_interval)
        if not abs(carried - self._designed_for) <= _RETUNED * carried:
            self._designed_for = carried
            self._gains = self._design(min(self._most, comfortable_bandwidth(carried, self._time)))
        return self._gains

    def _design(self, bandwidth: float) -> AnglePIDGains:
        return course_gains(1.0, self._time or 0.0, bandwidth, has_bias=self._time is not None)


def advice(
    bandwidth: float,
    speed: float,
    course_rate_density: float,
    position_std: float,
    fix_interval: float,
    nomoto_time: float | None = None,
    damping: float = 1.0,
    course_gain: float = 1.0,
    current: float = 0.0,
) -> tuple[bool, str]:
    """(whether it fits, one sentence) for an autopilot of bandwidth ω_n, rad/s; for the others see `carried_bandwidth`.

    With the vessel's `nomoto_time` (s), the damping ratio of the loop must also be at least `COMFORTABLE`: ω_n ≤ ω_e
    alone does not ensure stability. course_gain: see `loop_damping`; `current` (m/s) only appears in the sentence.
    """
    positive("autopilot.bandwidth", bandwidth)
    carried = carried_bandwidth(speed, course_rate_density, position_std, fix_interval)
    where = f" in a current of {current:g} m/s" if current else ""
    circumstances = f"at {speed:g} m/s with fixes of {position_std:g} m every {fix_interval:g} s{where}"
    left = math.inf
    if nomoto_time is not None and carried > 0.0:
        left = loop_damping(bandwidth, carried, nomoto_time, damping, course_gain)
    if bandwidth <= carried and left >= COMFORTABLE:
        calm = "" if math.isinf(left) else f" with a damping ratio of {left:.2g} in the loop"
        return True, (
            f"An autopilot of {bandwidth:.2g} rad/s fits{calm}: the bandwidth of the course estimate is "
            f"{carried:.2g} rad/s {circumstances}."
        )
    trouble, remedy = "", "to that"
    if bandwidth <= carried:
        trouble = (
            f", and with T = {nomoto_time:g} s the damping ratio of the loop is {left:.2g}, "
            f"expected at least {COMFORTABLE:g}"
        )
        remedy = "further"
    return False, (
        f"An autopilot of {bandwidth:.2g} rad/s will hunt: the bandwidth of the course estimate is {carried:.2g} rad/s "
        f"{circumstances}{trouble}; lower the autopilot's bandwidth {remedy}, sail faster or use better fixes."
    )
