"""Figures of otter-path: what each guidance law makes of a crossing current."""

import numpy as np
from matplotlib.figure import Figure

from steerway.report import BAD, OURS, QUIET, THEIRS
from steerway_studies.otter_path.boat import JUDGED, LEG, LOOKAHEAD, NOISES, PathCase, sailed

_GREEN = "#2e8b57"
_EVERY = 10


def all_figures(seed: int) -> dict:
    """The figures by stem, with their captions, of one seed."""
    laws = ("course", "heading", "integral", "adaptive")
    runs = {(law, speed): _thinned(sailed(PathCase(0.1, speed, law), seed)) for law in laws for speed in LOOKAHEAD}
    course = {
        (noise, speed): runs["course", speed] if noise == 0.1 else _thinned(sailed(PathCase(noise, speed), seed))
        for noise in NOISES
        for speed in LOOKAHEAD
    }
    return {
        "tracks": (
            _tracks(course),
            "Course guidance: distance from the leg along it, true and estimated, and the fixes.",
        ),
        "laws": (
            _laws(runs),
            "Guidance laws in the same current, fixes of 0.1 m. By heading alone an offset of Δ tan β remains "
            "(dashed); integral and adaptive guidance find the crab angle by and by, course guidance needs none.",
        ),
        "crab": (
            _crab(course),
            "Course guidance, fixes of 0.1 m: the bow points into current and wind so that the course lies on the leg. "
            "The pilot is not given the crab angle.",
        ),
    }


def _thinned(run):
    return run.rows(slice(None, None, _EVERY))


def _tracks(course):
    figure = Figure(figsize=(11.0, 8.0), layout="constrained")
    grid = figure.subplots(2, 2, sharex=True, sharey="row")
    for axes, ((noise, speed), run) in zip(grid.flat, course.items(), strict=True):
        north = run["true_north"]
        axes.plot(run["read_north"], run["read_east"], ".", color=THEIRS, markersize=2, alpha=0.6, label="fixes")
        axes.plot(run["estimated_north"], run["estimated_east"], color=OURS, linewidth=0.8, label="estimated")
        axes.plot(north, run["true_east"], color="black", linewidth=1.4, label="true")
        axes.set_title(f"fixes of {noise:g} m, {speed:g} m/s, Δ = {LOOKAHEAD[speed]:g} m", fontsize=10)
        _leg(axes)
    for axes in grid[:, 0]:
        axes.set_ylabel("east of the leg (m)")
    for axes in grid[1]:
        axes.set_xlabel("along the leg (m)")
    grid[0, 0].legend(loc="upper right", fontsize=8, ncols=3)
    return figure


def _laws(runs):
    figure = Figure(figsize=(11.0, 8.0), layout="constrained")
    grid = figure.subplots(2, 1, sharex=True)
    colours = {"course": OURS, "heading": BAD, "integral": THEIRS, "adaptive": _GREEN}
    for axes, (speed, lookahead) in zip(grid, LOOKAHEAD.items(), strict=True):
        for law, colour in colours.items():
            run = runs[law, speed]
            axes.plot(run["true_north"], run["true_east"], color=colour, linewidth=1.3, label=f"{law} LOS")
        run = runs["heading", speed]
        judged = run.rows((run["true_north"] > JUDGED[0]) & (run["true_north"] < JUDGED[1]))
        tangent = np.tan(np.mean(judged.true_cog) - np.mean(judged["true_heading"]))
        axes.plot(JUDGED, [lookahead * tangent] * 2, "--", color=BAD, linewidth=1.2, label="Δ tan β")
        axes.set_title(f"{speed:g} m/s, Δ = {lookahead:g} m", fontsize=10)
        axes.set_ylabel("east of the leg (m)")
        _leg(axes)
    grid[0].legend(loc="center right", fontsize=8, ncols=2)
    grid[1].set_xlabel("along the leg (m)")
    return figure


def _crab(course):
    figure = Figure(figsize=(11.0, 7.0), layout="constrained")
    grid = figure.subplots(2, 1, sharex=True)
    for axes, speed in zip(grid, LOOKAHEAD, strict=True):
        run = course[0.1, speed]
        north = run["true_north"]
        axes.plot(
            north, np.degrees(run["estimated_cog"]), color=OURS, linewidth=0.7, alpha=0.7, label="estimated course"
        )
        axes.plot(north, np.degrees(run.true_cog), color="black", linewidth=1.3, label="true course")
        axes.plot(north, np.degrees(run["true_heading"]), color=BAD, linewidth=1.3, label="true heading")
        axes.set_ylim(-45.0, 35.0)
        axes.set_title(f"{speed:g} m/s", fontsize=10)
        axes.set_ylabel("from north (°)")
        _leg(axes)
    grid[0].legend(loc="upper right", fontsize=8, ncols=3)
    grid[1].set_xlabel("along the leg (m)")
    return figure


def _leg(axes):
    axes.axhline(0.0, color=QUIET, linewidth=0.8)
    axes.axvspan(*JUDGED, color=QUIET, alpha=0.12, linewidth=0)
    axes.set_xlim(0.0, LEG)
    axes.grid(alpha=0.25)
