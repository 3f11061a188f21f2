"""Several tracks in one figure: overlay, and differences from a reference."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from steerway.core.angles import wrap_array
from steerway.core.earth import radii
from steerway.formats.results import NamedTrack
from steerway.report.differences import QUANTITIES, differences
from steerway.report.drawing import broken, on_axis
from steerway.report.figures import course_axis, time_axis

COLOURS = ("#000000", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""After Okabe and Ito; the reference is black. Line styles differ too."""
STYLES = ("-", "--", "-.", ":")
_MOST_POINTS = 8000


def overlay_figure(tracks: Sequence[NamedTrack]) -> Figure:
    """The tracks, and their SOG, COG and course rate over time."""
    figure = Figure(figsize=(12.0, 9.0), layout="constrained")
    panes = figure.subplot_mosaic([["map", "sog"], ["map", "cog"], ["map", "course_rate"]], width_ratios=(1.0, 1.2))
    latitude, longitude = (float(np.nanmedian(each)) for each in (tracks[0].latitude, tracks[0].longitude))
    meridian, prime_vertical = radii(latitude)
    cut = course_axis(panes["cog"], *(each.cog for each in tracks))
    for number, track in enumerate(tracks):
        look, few = _look(number), _few(track)
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
    for name in ("sog", "cog", "course_rate"):
        label, unit, _ = QUANTITIES[name]
        panes[name].set_ylabel(f"{label} ({unit})")
        time_axis(panes[name])
    panes["map"].grid(alpha=0.3)
    return figure


def differences_figure(tracks: Sequence[NamedTrack]) -> Figure:
    """The differences of the other tracks from the first, over time and as a cumulative distribution."""
    found = [(track, differences(tracks[0], track)) for track in tracks[1:]]
    shown = [name for name in QUANTITIES if any(np.isfinite(each[name]).any() for _, each in found)]
    figure = Figure(figsize=(12.0, 1.5 + 2.2 * len(shown)), layout="constrained")
    figure.suptitle(f"differences from {tracks[0].name}", fontsize=11)
    axes = figure.subplots(len(shown), 2, squeeze=False, width_ratios=(2.2, 1.0))
    for (over_time, share), name in zip(axes, shown, strict=True):
        label, unit, factor = QUANTITIES[name]
        for number, (track, each) in enumerate(found, 1):
            look, few = _look(number), _few(track)
            over_time.plot(track.time[few] / 86400.0, factor * each[name][few], label=track.name, **look)
            known = np.sort(np.abs(factor * each[name][np.isfinite(each[name])]))
            if len(known):
                share.plot(known, np.linspace(0.0, 1.0, len(known)), **look)
        over_time.set_ylabel(f"{label} ({unit})")
        time_axis(over_time)
        share.set_xlabel(f"|{label}| ({unit})")
        share.set_ylabel("share below")
        share.grid(alpha=0.3)
    axes[0, 0].legend(loc="best", fontsize=8)
    return figure


def _look(number: int) -> dict[str, Any]:
    return {"color": COLOURS[number % len(COLOURS)], "linestyle": STYLES[number % len(STYLES)], "linewidth": 1.2}


def _few(track: NamedTrack) -> slice:
    return slice(None, None, max(1, len(track.time) // _MOST_POINTS))
