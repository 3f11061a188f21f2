"""The largest autopilot bandwidth that the delay of a course estimate from positions allows."""

import math

import numpy as np

from steerway.control.course import AnglePIDGains, course_gains
from steerway.core.checks import not_negative, positive

COMFORTABLE = 0.2
"""Least relative damping of a loop that `comfortable_bandwidth` allows: an oscillation falls to 28 % in one period.
Chosen."""
RATE_SHARE = 0.3
"""ω_n/ω_e for a vessel with a yaw-rate loop: the largest round number that keeps the least relative damping of s (T s +
1) F(s) + ω_n (2ω_e² s + ω_e³), F the filter of `loop_damping`, at `COMFORTABLE` whatever T
(`tests/test_autopilot.py`)."""
_LEAST = 0.1
"""Share of the largest bandwidth with which `GainSchedule` begins, before speed and interval are known. Chosen: slow
rather than unstable."""
_RETUNED = 0.05
"""Relative change of the carried bandwidth at which `GainSchedule` designs the gains anew. Chosen: it changes a damping
of 0.2 by 0.012 where T ω_e is up to 0.2, by 0.04 where it is 2 (`loop_damping`)."""
_HALVINGS = 14
"""Bisections of 20 octaves in `comfortable_bandwidth`: it is found to 0.1 %."""


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


def loop_damping(
    bandwidth: float, carried: float, nomoto_time: float, damping: float = 1.0, course_gain: float = 1.0
) -> float:
    """Least relative damping −Re s/|s| among the poles of autopilot, vessel and estimator; below 0 the loop oscillates.

    The autopilot of `course_gains` on a Nomoto vessel of time constant T, fed with course and rate from a steady filter
    whose three poles lie at ω_e (s³ + 2ω_e s² + 2ω_e² s + ω_e³): it shows the course as (2ω_e² s + ω_e³)/(…), the rate
    as ω_e³ s/(…) of the true course. A filter of ω_e = ω_n is stable for T ω_n up to 0.55 only; T ω_n = 1 takes
    ω_e = 2 ω_n and a slow vessel 3.8 ω_n. course_gain: dχ/dψ of a boat in a current
    (`core.kinematics.course_per_heading`), which is a factor of the loop's.
    """
    gains = course_gains(1.0, nomoto_time, bandwidth, damping)
    filtering = np.polynomial.Polynomial([carried**3, 2.0 * carried**2, 2.0 * carried, 1.0])
    course = np.polynomial.Polynomial([carried**3, 2.0 * carried**2])
    s = np.polynomial.Polynomial([0.0, 1.0])
    control = (s + 1.0 / gains.integral_time) * course + gains.derivative_time * carried**3 * s**2
    poles = (s**2 * (nomoto_time * s + 1.0) * filtering + course_gain * gains.proportional * control).roots()
    return float(np.min(-poles.real / np.abs(poles)))


def comfortable_bandwidth(carried: float, nomoto_time: float | None) -> float:
    """Bandwidth ω_n (rad/s) that a course estimate of ω_e allows: relative damping of at least `COMFORTABLE`.

    carried ω_e in rad/s, nomoto_time T in s. The largest by `loop_damping`: 0.36 ω_e for a vessel that follows at once,
    0.2 ω_e for a slow one. With T unknown (None), of a vessel that follows a commanded yaw rate by a loop of its own,
    `RATE_SHARE` of ω_e.
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
    """Autopilot gains for what the course estimate carries at the present speed and interval of fixes.

    nomoto_time: T of the vessel's yaw rate, s, the command being the yaw rate that it settles at (Nomoto gain 1); None
        for a vessel with a yaw-rate loop of its own, which holds against wind: the command needs no integral.
    course_rate_density, position_std: of the estimator, as of `carried_bandwidth`.
    most: bandwidth that is never exceeded, however good the estimate, rad/s.
    fix_interval: s, may be set at any time; NaN while unknown.
    """

    def __init__(self, nomoto_time: float | None, course_rate_density: float, position_std: float, most: float):
        self._time = nomoto_time
        self._density, self._std = course_rate_density, position_std
        self._most = positive("autopilot.bandwidth", most)
        self.fix_interval = math.nan
        self._designed_for = math.nan
        self._gains = self._design(_LEAST * most)

    def gains(self, speed: float) -> AnglePIDGains:
        """The gains at a speed over ground (m/s); those in force where speed or interval is unknown."""
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
    """(whether it fits, one sentence) for an autopilot of `bandwidth` ω_n in rad/s; the rest as carried_bandwidth.

    With the vessel's `nomoto_time` (s) the loop's damping has to be at least `COMFORTABLE`: ω_n ≤ ω_e alone does not
    make it stable. course_gain as of `loop_damping`; `current` (m/s), which causes it, is named in the sentence.
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
