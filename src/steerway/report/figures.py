"""Figures of an estimate: the track, and its quantities over time."""

from typing import TypeVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.figure import Figure

from steerway.core.angles import wrap_array
from steerway.core.arrays import Floats
from steerway.core.earth import radii
from steerway.core.errors import InputError
from steerway.core.records import NO_COURSE, REJECTED, STARTING, Fixes, Motion
from steerway.core.statistics import FIX_GATE
from steerway.report.drawing import BAD, OURS, QUIET, THEIRS, broken, course_cut, on_axis, thinned
from steerway.report.episodes import gaps

_MOST_POINTS = 20_000
T = TypeVar("T", float, Floats)


def plot(motion: Motion, fixes: Fixes | None = None, kind: str = "signals") -> Figure:
    """A matplotlib Figure of the estimate of one vessel.

    Args:
        motion: the estimate.
        fixes: its input, to add the receiver's own SOG and COG, and gaps.
        kind: "signals" (SOG, COG, course rate with ±2σ and innovations over time) or "track".

    Raises InputError for any other kind, and for signals of several vessels.
    """
    if kind not in ("signals", "track"):
        raise InputError(f"kind is {kind!r}, expected signals or track")
    if kind == "track":
        return track_figure(motion)
    if motion.mmsi is not None:
        raise InputError("motion has several vessels, expected one of its `tracks()`, or kind='track'")
    return signals_figure(fixes or Fixes(motion.time, motion.latitude, motion.longitude), motion)


def track_figure(motion: Motion) -> Figure:
    """The track in metres from its median position, coloured by speed; grey where course is undefined."""
    figure = Figure(figsize=(9.0, 7.0), layout="constrained")
    axes = figure.subplots()
    latitude, longitude = np.nanmedian(motion.latitude), np.nanmedian(motion.longitude)
    meridian, prime_vertical = radii(latitude)
    fastest = max(float(np.nanmax(motion.sog, initial=0.1)), 0.1)
    lines = None
    for mmsi, track in motion.tracks():
        track = track.rows(np.isfinite(track.latitude))
        if len(track) < 2:
            continue
        track = thinned(track, _MOST_POINTS)
        north = (track.latitude - latitude) * meridian
        turned = wrap_array(track.longitude - longitude)
        east = turned * prime_vertical * np.cos(latitude)
        points = np.column_stack([east, north])
        segments = np.stack([points[:-1], points[1:]], axis=1)
        moving = np.isfinite(track.cog[1:])
        axes.add_collection(LineCollection(segments[~moving], colors=QUIET, linewidths=1.2))
        lines = LineCollection(segments[moving], cmap="viridis", linewidths=2.0)
        lines.set_array(track.sog[1:][moving])
        lines.set_clim(0.0, fastest)
        axes.add_collection(lines)
        if mmsi is None:
            axes.plot(*points[0], "o", color="black", markersize=6, label="start")
            axes.plot(*points[-1], "s", color="black", markersize=6, label="end")
            rejected = track.status == REJECTED
            if rejected.any():
                axes.plot(*points[rejected].T, "x", color=BAD, markersize=5, label="fix rejected")
            axes.legend(loc="best", frameon=False)
    axes.autoscale_view()
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"east of {_degrees(longitude, 'E', 'W')} (m)")
    axes.set_ylabel(f"north of {_degrees(latitude, 'N', 'S')} (m)")
    axes.grid(alpha=0.25)
    if lines is not None:
        figure.colorbar(lines, ax=axes, label="speed over ground (m/s)", shrink=0.8)
    return figure


def signals_figure(fixes: Fixes, motion: Motion, gate: bool = True) -> Figure:
    """SOG, COG and course rate with ±2σ against the receiver's own, the innovation ratio, gaps and rejections.

    gate: whether the estimate has a rejection gate: with a profile, but not with inferred structures.
    """
    figure = Figure(figsize=(11.0, 11.0), layout="constrained")
    sog, cog, rate, nis = figure.subplots(4, 1, sharex=True)
    shown = thinned(motion, _MOST_POINTS)
    reported = thinned(fixes.rows(np.isfinite(fixes.sog) | np.isfinite(fixes.cog)), _MOST_POINTS)
    time, reported_time = _dates(shown.time), _dates(reported.time)

    _receiver(sog, reported_time, reported.sog, "receiver's SOG")
    _banded(sog, time, shown.sog, shown.sog_std, "SOG ± 2σ")
    sog.set_ylim(bottom=0.0, top=_top(shown.sog, reported.sog))
    sog.set_ylabel("SOG (m/s)")

    moving = np.where(reported.sog > 0.3, reported.cog, np.nan) if len(reported) else reported.cog
    cut = course_axis(cog, shown.cog)
    _receiver(cog, reported_time, on_axis(moving, cut), "receiver's COG above 0.3 m/s")
    _banded(cog, time, broken(on_axis(shown.cog, cut)), np.degrees(shown.cog_std), "COG ± 2σ")
    cog.set_ylabel("COG (°)")

    _banded(rate, time, np.degrees(shown.course_rate), np.degrees(shown.course_rate_std), "course rate ± 2σ")
    rate.axhline(0.0, color=QUIET, linewidth=0.8)
    rate.set_ylim(-_reach(shown), _reach(shown))
    rate.set_ylabel("course rate (°/s)\n+ starboard")

    ratio = np.sqrt(shown.nis / 2.0)
    rejected = shown.status == REJECTED
    nis.semilogy(time, np.where(rejected, np.nan, ratio), ".", color=OURS, markersize=2, label="accepted")
    if rejected.any():
        nis.semilogy(time[rejected], ratio[rejected], "x", color=BAD, markersize=5, label="rejected")
    if gate:
        nis.axhline(np.sqrt(FIX_GATE / 2.0), color=BAD, linewidth=0.8, linestyle="--", label="gate")
    nis.set_ylabel("innovation ratio √(NIS/2)")
    nis.set_xlabel("time (UTC)")

    holes = gaps(fixes.time[fixes.has_position], fixes.mmsi is not None)
    quiet = np.isin(shown.status, (NO_COURSE, STARTING))
    for axes in (sog, cog, rate, nis):
        for k, (start, stop) in enumerate(sorted(holes, key=lambda hole: hole[0] - hole[1])[:200]):
            label = "no fixes" if k == 0 and axes is sog else None
            axes.axvspan(_dates(start), _dates(stop), color=BAD, alpha=0.12, linewidth=0, label=label)
        axes.margins(x=0.01)
    if quiet.any():
        bottom = cog.get_xaxis_transform()
        cog.fill_between(time, 0.0, 1.0, where=quiet, transform=bottom, color=QUIET, alpha=0.25, linewidth=0)
        cog.plot([], [], color=QUIET, alpha=0.5, linewidth=6, label="course not defined")
    for axes in (sog, cog, rate, nis):
        axes.legend(loc="upper right", fontsize=8, framealpha=0.85, ncols=4)
        time_axis(axes)
    return figure


def course_axis(axes: Axes, *courses: np.ndarray) -> float:
    """Cut the vertical axis of courses (rad) at the multiple of 90° nearest to the least frequent. Returns degrees."""
    cut = 90.0 * round(course_cut(*courses) / 90.0)
    axes.set_ylim(cut, cut + 360.0)
    axes.set_yticks(cut + np.arange(0.0, 361.0, 90.0))
    axes.yaxis.set_major_formatter(lambda tick, _: f"{tick % 360.0:.0f}")
    return cut


def time_axis(axes: Axes) -> None:
    """Dates (days since 1970) on the horizontal axis, and a grid."""
    locator = AutoDateLocator()
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(ConciseDateFormatter(locator))
    axes.grid(alpha=0.25)


def _reach(motion: Motion) -> float:
    """Limit of the course-rate axis (°/s): shows 99.9 % of the values, and the band of the median σ."""
    rates, deviations = (np.degrees(np.abs(column)) for column in (motion.course_rate, motion.course_rate_std))
    known = np.isfinite(rates)
    if not known.any():
        return 1.0
    return float(max(1.4 * np.quantile(rates[known], 0.999), 2.5 * np.median(deviations[known])) + 0.1)


def _banded(axes: Axes, time: Floats, values: Floats, deviations: Floats, label: str) -> None:
    axes.fill_between(time, values - 2.0 * deviations, values + 2.0 * deviations, color=OURS, alpha=0.2, linewidth=0)
    axes.plot(time, values, color=OURS, linewidth=1.2, label=label)


def _receiver(axes: Axes, time: Floats, values: Floats, label: str) -> None:
    if np.isfinite(values).any():
        axes.plot(time, values, ".", color=THEIRS, markersize=2.5, label=label)


def _dates(time: T) -> T:
    return time / 86400.0  # matplotlib's dates are days since the Unix epoch


def _top(*columns: Floats) -> float:
    highest = [np.nanquantile(column, 0.999) for column in columns if np.isfinite(column).any()]
    return 1.25 * max([*highest, 0.2])


def _degrees(radians: float, positive: str, negative: str) -> str:
    value = np.degrees(radians)
    return f"{abs(value):.4f}° {positive if value >= 0.0 else negative}"
