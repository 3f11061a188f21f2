"""Differences of tracks from a reference track, and their statistics."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from steerway.core.angles import wrap_array
from steerway.core.arrays import Floats
from steerway.core.earth import radii
from steerway.core.errors import InputError
from steerway.core.statistics import rms, share_within
from steerway.formats.results import NamedTrack

QUANTITIES = {
    "position": ("position", "m", 1.0),
    "sog": ("SOG", "m/s", 1.0),
    "cog": ("COG", "°", np.degrees(1.0)),
    "course_rate": ("course rate", "°/s", np.degrees(1.0)),
}
"""Name of a difference → label, unit and factor from SI."""
_STATISTICS: dict[str, Callable[[Floats], Any]] = {
    "rms": rms,
    "median": np.median,
    "p95": lambda known: np.quantile(known, 0.95),
    "max": np.max,
}
_LONGEST_STEP = 5.0
"""Longest step of the reference that is interpolated, in multiples of its median step."""


def differences(reference: NamedTrack, track: NamedTrack) -> dict[str, np.ndarray]:
    """Track minus reference at the track's times, (n,) each, SI; NaN where either is unknown.

    The reference is interpolated in time, but not over gaps. "position" is a distance; the others are signed. Raises
    InputError if the two do not overlap in time.
    """
    time, order = np.unique(reference.time, return_index=True)
    if len(time) < 2 or time[-1] < track.time.min() or time[0] > track.time.max():
        raise InputError(f"{track.name} and {reference.name} do not overlap in time, expected the same voyage")
    after = np.clip(np.searchsorted(time, track.time), 1, len(time) - 1)
    inside = (track.time >= time[0]) & (track.time <= time[-1])
    inside &= time[after] - time[after - 1] <= _LONGEST_STEP * np.median(np.diff(time))

    def at(values: Floats, angle: bool = False) -> Floats:
        values = values[order]
        low, high = values[after - 1], values[after]
        share = (track.time - time[after - 1]) / (time[after] - time[after - 1])
        step = wrap_array(high - low) if angle else high - low
        between = np.where(share >= 1.0, high, np.where(share <= 0.0, low, low + share * step))
        return np.where(inside, between, np.nan)

    latitude, longitude = at(reference.latitude), at(reference.longitude, angle=True)
    meridian, prime_vertical = radii(float(np.nanmedian(reference.latitude)))
    north = (track.latitude - latitude) * meridian
    east = wrap_array(track.longitude - longitude) * prime_vertical * np.cos(track.latitude)
    return {
        "position": np.hypot(north, east),
        "north": north,
        "east": east,
        "sog": track.sog - at(reference.sog),
        "cog": wrap_array(track.cog - at(reference.cog, angle=True)),
        "course_rate": track.course_rate - at(reference.course_rate),
    }


def statistics(values: np.ndarray) -> dict[str, float]:
    """rms, median, p95 and max of the absolute known values of (n,), and their number n; NaN if n is 0."""
    known = np.abs(values[np.isfinite(values)])
    found = {name: float(of(known)) if len(known) else np.nan for name, of in _STATISTICS.items()}
    return found | {"n": len(known)}


def statistics_table(tracks: Sequence[NamedTrack]) -> list[dict[str, Any]]:
    """Statistics of every track's differences from the first: track, quantity, unit, n, rms, median, p95, max.

    within_2sigma_pct: share of the differences within ± 2σ of the track (for positions: share of the coordinates), NaN
    for a track without σ.
    """
    rows = []
    for track in tracks[1:]:
        apart = differences(tracks[0], track)
        for name, (label, unit, factor) in QUANTITIES.items():
            found = statistics(factor * apart[name])
            signed = np.stack([apart["north"], apart["east"]]) if name == "position" else apart[name]
            within = share_within(signed, getattr(track, f"{name}_std"))
            if found["n"]:
                row = {"track": track.name, "quantity": label, "unit": unit, **found, "within_2sigma_pct": within}
                rows.append(row)
    return rows
