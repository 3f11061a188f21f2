"""Latency: records stamped on reception, and receivers whose own SOG and COG are late.

A velocity from the positions before and after a fix is no later than the positions. Compared with it, a receiver's own
SOG and COG show the delay of their filtering. The delay of the positions themselves is an input. Only an instrument on
the same clock that is not late itself could show it; no compass or gyro in the recorded logs is such an instrument.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.checks import not_negative
from steerway.core.earth import radii
from steerway.core.records import INSTRUMENT_COLUMNS, OK, Fixes, Motion
from steerway.estimation.log.compare import LEAST_SPEED, LONGEST_LAG, compare

_LONGEST_SAMPLE = 20_000
"""Most rows that are compared, an hour and more at 5 Hz; the lag of one receiver does not change."""
_FEWEST = 100
"""Least number of rows: their RMS is known to 1/√(2 · 100), 7 %."""
_SHARP = 0.9
"""A lag is determined if removing it multiplies the RMS difference by less than this factor. For SOG, the remaining RMS
must also be below this share of the SOG's standard deviation. By chance, an RMS of the fewest rows is off by 7 %."""
_SPANS = 1.0, 2.0, 4.0, 8.0
"""Spans, s, on either side of a fix for its velocity. Noise favours long spans, turns favour short ones. The span with
the best match in COG is used."""
_POINTS = 10
"""Points of a line on either side of a fix. With fewer, its noise depends on whether they are at fixes or between."""


@dataclass(frozen=True)
class Lateness:
    """Delay (s) of a receiver's own SOG and COG relative to its positions; NaN if the log does not determine it."""

    sog: float = math.nan
    cog: float = math.nan


UNKNOWN_LATENESS = Lateness()


def on_time(fixes: Fixes, latency: float) -> Fixes:
    """The record with position, SOG and COG moved back by `latency` (s) to the time they are valid for.

    For records stamped on arrival. Other instruments (heading, speed through water, yaw rate) keep their time; those
    that share a row with a fix get rows of their own. Raises InputError for a negative latency.
    """
    if not_negative("latency", latency) == 0.0:
        return fixes
    unknown: Any = np.full(len(fixes), np.nan)
    other = np.any([np.isfinite(getattr(fixes, name)) for name in INSTRUMENT_COLUMNS], axis=0)
    receiver = replace(fixes, time=fixes.time - latency, **dict.fromkeys(INSTRUMENT_COLUMNS, unknown))
    beside = replace(fixes, **dict.fromkeys(("latitude", "longitude", "position_std", "sog", "cog"), unknown))
    first, second = receiver.rows(fixes.has_position | ~other).columns(), beside.rows(other).columns()
    columns: dict[str, Any] = {name: np.append(first[name], second[name]) for name in first}
    return replace(fixes, **columns).in_order()


def lateness(fixes: Fixes) -> Lateness:
    """Delay of SOG and COG of one vessel's receiver, from the part of the record with most motion."""
    if fixes.mmsi is not None or not np.isfinite(fixes.sog).any():
        return UNKNOWN_LATENESS
    part = _busiest(fixes)
    of_spans = [compare(part, differenced(part, span)) for span in _SPANS]
    best = min(of_spans, key=lambda each: each.cog_rms_aligned)
    if best.compared < _FEWEST:
        return UNKNOWN_LATENESS
    variation = float(np.nanstd(part.sog[part.sog > LEAST_SPEED]))
    return Lateness(
        sog=_determined(best.sog_lag, best.sog_rms_aligned, min(best.sog_rms, variation)),
        cog=_determined(best.cog_lag, best.cog_rms_aligned, best.cog_rms),
    )


def _determined(lag: float, aligned: float, otherwise: float) -> float:
    return lag if aligned < _SHARP * otherwise and abs(lag) < LONGEST_LAG else math.nan


def differenced(fixes: Fixes, span: float) -> Motion:
    """Motion at every fix by a straight line through the positions up to `span` s before and after it.

    A span below the usual interval between fixes is raised to it. Standard deviations and course rate are NaN.
    """
    fixes = fixes.rows(fixes.has_position)
    time, unknown = fixes.time, np.full(len(fixes), np.nan)
    usual = float(np.median(np.diff(time))) if len(time) > 1 else span
    offsets = max(span, usual) * np.arange(1, _POINTS + 1) / _POINTS

    def velocity(values: Floats) -> Floats:
        moved = (np.interp(time + s, time, values) - np.interp(time - s, time, values) for s in offsets)
        return sum(s * each for s, each in zip(offsets, moved, strict=True)) / (2.0 * float(offsets @ offsets))

    meridian, prime_vertical = radii(float(np.mean(fixes.latitude))) if len(time) else (math.nan, math.nan)
    north = velocity(fixes.latitude) * meridian
    east = velocity(np.unwrap(fixes.longitude)) * prime_vertical * np.cos(fixes.latitude)
    return Motion(
        time,
        fixes.latitude,
        fixes.longitude,
        sog=np.hypot(north, east),
        cog=np.arctan2(east, north),
        course_rate=unknown,
        sog_std=unknown,
        cog_std=unknown,
        course_rate_std=unknown,
        nis=unknown,
        status=np.full(len(time), OK, np.uint8),
        position_std=unknown,
    )


def _busiest(fixes: Fixes) -> Fixes:
    """The `_LONGEST_SAMPLE` rows with most motion, or all rows of a shorter record."""
    if len(fixes) <= _LONGEST_SAMPLE:
        return fixes
    sailed = np.r_[0, np.cumsum(fixes.sog > LEAST_SPEED)]
    first = int(np.argmax(sailed[_LONGEST_SAMPLE:] - sailed[:-_LONGEST_SAMPLE]))
    return fixes.rows(slice(first, first + _LONGEST_SAMPLE))
