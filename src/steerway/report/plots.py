"""The plots that runs and studies share, each a matplotlib figure: a track, series one above the other, and bars."""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from steerway.report.drawing import BAD, OURS, QUIET, THEIRS

TRUTH = "black"
PALETTE = OURS, THEIRS, BAD, "#38761d", QUIET


class Curve(NamedTuple):
    """A line, or points where the style is a marker."""

    x: ArrayLike
    y: ArrayLike
    label: str = ""
    colour: str = OURS
    style: str = "-"
    width: float = 1.3


class Band(NamedTuple):
    """A shaded band between two lines; for level lines, `x` is the pair of their ends."""

    x: ArrayLike
    low: ArrayLike
    high: ArrayLike
    label: str = ""
    colour: str = QUIET


class Panel(NamedTuple):
    """One pair of axes of `series`. `limits`: dashed horizontal lines; `marks`: dashed vertical lines."""

    y: str
    curves: Sequence[Curve]
    title: str = ""
    ylim: tuple[float | None, float | None] | None = None
    xlim: tuple[float, float] | None = None
    bands: Sequence[Band] = ()
    limits: Sequence[float] = ()
    marks: Sequence[float] = ()
    log: bool = False


def track(curves: Sequence[Curve], x: str = "east (m)", y: str = "north (m)") -> Figure:
    """Paths seen from above, to one scale on both axes."""
    figure = Figure(figsize=(7.5, 7.0), layout="constrained")
    axes = figure.subplots()
    _draw(axes, curves)
    axes.set(xlabel=x, ylabel=y)
    axes.set_aspect("equal", adjustable="datalim")
    _finish(axes)
    return figure


def series(
    panels: Sequence[Panel],
    x: str = "time (s)",
    columns: int = 1,
    share: bool | Literal["col"] = True,
    widths: Sequence[float] | None = None,
) -> Figure:
    """Panels of curves and bands over a common axis, row by row; `share`: sharex of matplotlib's subplots."""
    rows = -(-len(panels) // columns)
    figure = Figure(figsize=(9.0 if columns == 1 else 11.0, 1.5 + 2.3 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, sharex=share, squeeze=False, width_ratios=widths)
    for axes, panel in zip(grid.flat, panels, strict=True):
        for band in panel.bands:
            label = band.label or None
            axes.fill_between(band.x, band.low, band.high, color=band.colour, alpha=0.18, linewidth=0.0, label=label)
        _draw(axes, panel.curves)
        for level in panel.limits:
            axes.axhline(level, color=BAD, linestyle="--", linewidth=0.8)
        for moment in panel.marks:
            axes.axvline(moment, color=QUIET, linestyle="--", linewidth=0.8)
        if panel.log:
            axes.set_yscale("log")
        axes.set_ylabel(panel.y)
        axes.set_title(panel.title, loc="left", fontsize=10)
        axes.margins(x=0.01)
        if panel.ylim:
            axes.set_ylim(*panel.ylim)
        if panel.xlim:
            axes.set_xlim(*panel.xlim)
        _finish(axes)
    for axes in grid[-1]:
        axes.set_xlabel(x)
    return figure


def bars(
    names: Sequence[str],
    groups: dict[str, tuple[ArrayLike, ArrayLike | None]],
    x: str,
    log: bool = False,
    line: float | None = None,
) -> Figure:
    """A bar for each name in each group: label → (values, their error bars or None). `line`: a vertical line's x."""
    figure = Figure(figsize=(9.0, 1.5 + 0.38 * len(names) * max(1.0, 0.6 * len(groups))), layout="constrained")
    axes = figure.subplots()
    places, height = np.arange(len(names)), 0.8 / len(groups)
    for i, (label, (values, spread)) in enumerate(groups.items()):
        at = places + height * (i - 0.5 * (len(groups) - 1))
        axes.barh(at, values, 0.9 * height, xerr=spread, color=PALETTE[i], label=label or None, error_kw={"lw": 1.0})
    if line is not None:
        axes.axvline(line, color=TRUTH, linestyle="--", linewidth=1.0)
    axes.set_yticks(places, list(names))
    axes.invert_yaxis()
    axes.set_xlabel(x)
    if log:
        axes.set_xscale("log")
    _finish(axes)
    return figure


def _draw(axes: Axes, curves: Sequence[Curve]) -> None:
    for x, y, label, colour, style, width in curves:
        axes.plot(x, y, style, color=colour, linewidth=width, markersize=4.0, label=label or None)


def _finish(axes: Axes) -> None:
    axes.grid(alpha=0.25)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="best", fontsize=8, framealpha=0.85)
