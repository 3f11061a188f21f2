"""Latency: records stamped on reception, and receivers whose own SOG and COG are late.

A smoothed estimate uses past and future alike, so that it is no later than the positions. Compared with it, a
receiver's own SOG and COG show the delay of their filtering. The delay of the positions could only be found by an
instrument on the same clock that is not late itself: no compass or gyro in the logs here is one, so that this delay is
an input.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from steerway.core.checks import not_negative
from steerway.core.records import Fixes, Motion
from steerway.estimation.course.comparison import LEAST_SPEED, LONGEST_LAG, compare

_INSTRUMENTS = ("heading", "water_speed", "yaw_rate")
_LONGEST_SAMPLE = 20_000
"""Rows compared, an hour and more at 5 Hz: the lag of one receiver does not change."""
_FEWEST = 100
"""Rows, of which the RMS is known to 7 %."""
_SHARP = 0.9
"""Largest ratio of the RMS difference with the lag removed to that without, for the lag to be determined."""


@dataclass(frozen=True)
class Lateness:
    """How late a receiver's own SOG and COG are against its positions, s; NaN where a log does not determine it."""

    sog: float = math.nan
    cog: float = math.nan


def on_time(fixes: Fixes, latency: float) -> Fixes:
    """The record with position, SOG and COG moved back by `latency` (s) to the time they are valid for.

    For records stamped on arrival. Other instruments (heading, speed through water, yaw rate) keep their time, in rows
    of their own where they shared one. Raises InputError for a negative latency.
    """
    if not_negative("latency", latency) == 0.0:
        return fixes
    unknown = np.full(len(fixes), np.nan)
    other = np.any([np.isfinite(getattr(fixes, name)) for name in _INSTRUMENTS], axis=0)
    receiver = replace(fixes, time=fixes.time - latency, **dict.fromkeys(_INSTRUMENTS, unknown))
    beside = replace(fixes, **dict.fromkeys(("latitude", "longitude", "position_std", "sog", "cog"), unknown))
    parts = receiver.rows(fixes.has_position | ~other), beside.rows(other)
    columns = {name: np.concatenate([part.columns()[name] for part in parts]) for name in fixes.columns()}
    return replace(fixes, **columns).in_order()


def lateness(fixes: Fixes, smooth: Callable[[Fixes], Motion]) -> Lateness:
    """How late the receiver of one vessel is with its SOG and COG, by the part of the record with most motion.

    smooth: makes the smoothed estimate of a record.
    """
    if fixes.mmsi is not None or not np.isfinite(fixes.sog).any():
        return Lateness()
    part = _busiest(fixes)
    found = compare(part, smooth(part))
    if found.compared < _FEWEST:
        return Lateness()
    return Lateness(
        sog=_determined(found.sog_lag, found.sog_rms_aligned, found.sog_rms),
        cog=_determined(found.cog_lag, found.cog_rms_aligned, found.cog_rms),
    )


def _determined(lag, aligned, at_once):
    return lag if aligned < _SHARP * at_once and abs(lag) < LONGEST_LAG else math.nan


def _busiest(fixes):
    """The record, or the part of the longest sample with most motion."""
    if len(fixes) <= _LONGEST_SAMPLE:
        return fixes
    sailed = np.r_[0, np.cumsum(fixes.sog > LEAST_SPEED)]
    first = int(np.argmax(sailed[_LONGEST_SAMPLE:] - sailed[:-_LONGEST_SAMPLE]))
    return fixes.rows(slice(first, first + _LONGEST_SAMPLE))
