"""Latency: records stamped when they were heard, and receivers whose own SOG and COG come late.

A smoothed estimate knows the past and the future of every moment alike, so that it is late by no more than the
positions are. A receiver's own SOG and COG, set beside it, show how late their filtering makes them. How late the
positions themselves are only an instrument on the same clock can tell that is not late itself: of the compasses and
gyros in the logs at hand none is, so that this has to be known and is not looked for.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from steerway.core.checks import not_negative
from steerway.core.records import Fixes
from steerway.estimation.course.comparison import LONGEST_LAG, UNDERWAY, compare
from steerway.estimation.course.filter import FiveStateFilter
from steerway.estimation.profiles import Profile

_INSTRUMENTS = ("heading", "water_speed", "yaw_rate")
_LONGEST_SAMPLE = 20_000
_FEWEST = 100
_SHARP = 0.9
"""Part of the difference that may be left with a lag taken out, for the lag to be told."""


@dataclass(frozen=True)
class Lateness:
    """How late a receiver's own SOG and COG are against its positions, s; NaN where a log cannot tell."""

    sog: float = math.nan
    cog: float = math.nan


def on_time(fixes: Fixes, latency: float) -> Fixes:
    """The record with position, SOG and COG put back by `latency` (s) to the moment they are of.

    For records stamped on arrival. What instruments beside the receiver say (heading, speed through water, yaw rate)
    keeps its time, in rows of its own where it shared one. Raises InputError for a negative latency.
    """
    if not_negative("latency", latency) == 0.0:
        return fixes
    silent = np.full(len(fixes), np.nan)
    said = np.any([np.isfinite(getattr(fixes, name)) for name in _INSTRUMENTS], axis=0)
    receiver = replace(fixes, time=fixes.time - latency, **dict.fromkeys(_INSTRUMENTS, silent))
    beside = replace(fixes, **dict.fromkeys(("latitude", "longitude", "position_std", "sog", "cog"), silent))
    parts = receiver.rows(fixes.has_position | ~said), beside.rows(said)
    columns = {name: np.concatenate([part.columns()[name] for part in parts]) for name in fixes.columns()}
    return replace(fixes, **columns).in_order()


def lateness(fixes: Fixes, profile: Profile) -> Lateness:
    """How late the receiver of one vessel is with its SOG and COG, by the busiest part of her record."""
    if fixes.mmsi is not None or not np.isfinite(fixes.sog).any():
        return Lateness()
    part = _busiest(fixes)
    found = compare(part, FiveStateFilter(profile).smooth(part))
    if found.compared < _FEWEST:
        return Lateness()
    return Lateness(
        sog=_told(found.sog_lag, found.sog_rms_aligned, found.sog_rms),
        cog=_told(found.cog_lag, found.cog_rms_aligned, found.cog_rms),
    )


def _told(lag, aligned, at_once):
    return lag if aligned < _SHARP * at_once and abs(lag) < LONGEST_LAG else math.nan


def _busiest(fixes):
    """The record, or as much of it as is looked at, where there is most way."""
    if len(fixes) <= _LONGEST_SAMPLE:
        return fixes
    sailed = np.r_[0, np.cumsum(fixes.sog > UNDERWAY)]
    first = int(np.argmax(sailed[_LONGEST_SAMPLE:] - sailed[:-_LONGEST_SAMPLE]))
    return fixes.rows(slice(first, first + _LONGEST_SAMPLE))
