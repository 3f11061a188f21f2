"""Several tracks in one figure: overlay, differences from a reference, and their statistics."""

from collections.abc import Sequence

import numpy as np
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.figure import Figure

from steerway.core.angles import wrap_array
from steerway.core.earth import radii
from steerway.core.errors import InputError
from steerway.core.statistics import rms
from steerway.formats.results import NamedTrack
from steerway.report.course_axis import broken, course_cut, on_axis

COLOURS = ("#000000", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""After Okabe and Ito; the reference is black. Line styles differ too."""
STYLES = ("-", "--", "-.", ":")
QUANTITIES = {
    "position": ("position", "m", 1.0),
    "sog": ("SOG", "m/s", 1.0),
    "cog": ("COG", "°", np.degrees(1.0)),
    "course_rate": ("course rate", "°/s", np.degrees(1.0)),
}
"""Name of a difference: its label, unit and factor from SI."""
_MOST_POINTS = 8000
_LONGEST_STEP = 5.0
"""Usual steps of the reference over which it is interpolated."""


def differences(reference: NamedTrack, track: NamedTrack) -> dict[str, np.ndarray]:
    """What a track is off the reference at the track's times, (n,) each in SI; NaN where either is unknown.

    The reference is interpolated in time, but not over gaps. "position" is a distance, the others are signed.
    """
    time, order = np.unique(reference.time, return_index=True)
    if len(time) < 2 or time[-1] < track.time.min() or time[0] > track.time.max():
        raise InputError(f"{track.name} and {reference.name} share no time, expected logs of the same voyage")
    after = np.clip(np.searchsorted(time, track.time), 1, len(time) - 1)
    inside = (track.time >= time[0]) & (track.time <= time[-1])
    inside &= time[after] - time[after - 1] <= _LONGEST_STEP * np.median(np.diff(time))

    def at(values, angle=False):
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
        "sog": track.sog - at(reference.sog),
        "cog": wrap_array(track.cog - at(reference.cog, angle=True)),
        "course_rate": track.course_rate - at(reference.course_rate),
    }


def statistics(values: np.ndarray) -> dict[str, float]:
    """rms, median, p95 and max of the magnitudes of the known values (n,), and their number n; NaN without any."""
    known = np.abs(values[np.isfinite(values)])
    if not len(known):
        return {"rms": np.nan, "median": np.nan, "p95": np.nan, "max": np.nan, "n": 0}
    return {
        "rms": rms(known),
        "median": float(np.median(known)),
        "p95": float(np.quantile(known, 0.95)),
        "max": float(known.max()),
        "n": len(known),
    }


def statistics_table(tracks: Sequence[NamedTrack]) -> list[dict]:
    """Statistics of every track's differences from the first: track, quantity, unit, n, rms, median, p95, max."""
    rows = []
    for track in tracks[1:]:
        for name, values in differences(tracks[0], track).items():
            label, unit, factor = QUANTITIES[name]
            found = statistics(factor * values)
            if found["n"]:
                rows.append({"track": track.name, "quantity": label, "unit": unit, **found})
    return rows


def overlay_figure(tracks: Sequence[NamedTrack]) -> Figure:
    """The tracks, and their SOG, COG and course rate over time."""
    figure = Figure(figsize=(12.0, 9.0), layout="constrained")
    panes = figure.subplot_mosaic([["map", "sog"], ["map", "cog"], ["map", "course_rate"]], width_ratios=(1.0, 1.2))
    latitude, longitude = (float(np.nanmedian(each)) for each in (tracks[0].latitude, tracks[0].longitude))
    meridian, prime_vertical = radii(latitude)
    cut = 90.0 * round(course_cut(*(each.cog for each in tracks)) / 90.0)
    for number, track in enumerate(tracks):
        look = {"color": COLOURS[number % len(COLOURS)], "linestyle": STYLES[number % len(STYLES)], "linewidth": 1.2}
        few = slice(None, None, max(1, len(track.time) // _MOST_POINTS))
        east = wrap_array(track.longitude[few] - longitude) * prime_vertical * np.cos(latitude)
        panes["map"].plot(east, (track.latitude[few] - latitude) * meridian, label=track.name, **look)
        time = track.time[few] / 86400.0
        panes["sog"].plot(time, track.sog[few], **look)
        panes["cog"].plot(time, broken(on_axis(track.cog[few], cut)), **look)
        panes["course_rate"].plot(time, np.degrees(track.course_rate[few]), **look)
    panes["map"].set_aspect("equal", adjustable="datalim")
    panes["map"].set_xlabel("east (m)")
    panes["map"].set_ylabel("north (m)")
    panes["map"].legend(loc="best", fontsize=8)
    panes["cog"].set_ylim(cut, cut + 360.0)
    panes["cog"].set_yticks(cut + np.arange(0.0, 361.0, 90.0))
    panes["cog"].yaxis.set_major_formatter(lambda tick, _: f"{tick % 360.0:.0f}")
    for name in ("sog", "cog", "course_rate"):
        label, unit, _ = QUANTITIES[name]
        panes[name].set_ylabel(f"{label} ({unit})")
        _dated(panes[name])
    panes["map"].grid(alpha=0.3)
    return figure


def differences_figure(tracks: Sequence[NamedTrack]) -> Figure:
    """What the other tracks are off the first, over time and as cumulative distribution."""
    found = [(track, differences(tracks[0], track)) for track in tracks[1:]]
    shown = [name for name in QUANTITIES if any(np.isfinite(each[name]).any() for _, each in found)]
    figure = Figure(figsize=(12.0, 1.5 + 2.2 * len(shown)), layout="constrained")
    figure.suptitle(f"differences from {tracks[0].name}", fontsize=11)
    axes = figure.subplots(len(shown), 2, squeeze=False, width_ratios=(2.2, 1.0))
    for (over_time, share), name in zip(axes, shown, strict=True):
        label, unit, factor = QUANTITIES[name]
        for number, (track, each) in enumerate(found, 1):
            look = {
                "color": COLOURS[number % len(COLOURS)],
                "linestyle": STYLES[number % len(STYLES)],
                "linewidth": 1.0,
            }
            few = slice(None, None, max(1, len(track.time) // _MOST_POINTS))
            over_time.plot(track.time[few] / 86400.0, factor * each[name][few], label=track.name, **look)
            known = np.sort(np.abs(factor * each[name][np.isfinite(each[name])]))
            if len(known):
                share.plot(known, np.linspace(0.0, 1.0, len(known)), **look)
        over_time.set_ylabel(f"{label} ({unit})")
        _dated(over_time)
        share.set_xlabel(f"|{label}| ({unit})")
        share.set_ylabel("share below")
        share.grid(alpha=0.3)
    axes[0, 0].legend(loc="best", fontsize=8)
    return figure


def _dated(axes) -> None:
    locator = AutoDateLocator()
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(ConciseDateFormatter(locator))
    axes.grid(alpha=0.3)
