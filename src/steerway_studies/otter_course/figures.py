"""What the captions of P0's figures 4–6 name, and what noise does. Each gives (figure, caption)."""

import numpy as np
from matplotlib.figure import Figure

from steerway.report import BAD, OURS, QUIET, THEIRS
from steerway_studies.otter_course.boat import BACK_AT, RUN_IN, commanded

_ZOOM = (6.0, 7.0)  # s: the estimate of the turn, fix by fix


def all_figures(published, failing, runs) -> dict:
    """(figure, caption) by stem: the published run, the one with 1 cm of noise, and the product's by name."""
    return {
        "figure_4_positions": positions(published),
        "figure_5_propellers": propellers(published),
        "figure_6_states": states(published),
        "noise": noise(failing, runs),
    }


def positions(record):
    """Figure 4: North–East positions."""
    figure = Figure(figsize=(7.0, 8.0), layout="constrained")
    axes = figure.subplots()
    axes.plot(record.estimated_east, record.estimated_north, color=OURS, linewidth=2.5, alpha=0.5, label="estimated")
    axes.plot(record.east, record.north, color="black", linewidth=1.0, label="true")
    turn = np.searchsorted(record.time, BACK_AT)
    axes.plot(record.east[turn], record.north[turn], "o", color=BAD, markersize=6, label="command back to 0°")
    axes.set_xlabel("east (m)")
    axes.set_ylabel("north (m)")
    axes.set_aspect("equal", adjustable="datalim")
    _finish(axes)
    caption = "P0 figure 4: North–East positions for a course command of 20°, changed back to 0° at 20 s."
    return figure, caption


def propellers(record):
    """Figure 5: propeller revolutions."""
    figure = Figure(figsize=(9.0, 5.5), layout="constrained")
    panels = figure.subplots(2, 1, sharex=True)
    for k, (axes, name) in enumerate(zip(panels, ("n₁, left", "n₂, right"), strict=True)):
        axes.plot(record.time, record.commanded[:, k], color=QUIET, linewidth=0.8, label="command")
        axes.plot(record.time, record.turning[:, k], color=OURS, linewidth=1.4, label="propeller")
        axes.set_ylabel(f"{name} (rad/s)")
        _finish(axes)
    panels[-1].set_xlabel("time (s)")
    caption = (
        "P0 figure 5: propeller revolutions during autopilot control, allocated by (61)–(63); the propellers follow "
        "their commands with 1 s."
    )
    return figure, caption


def states(record):
    """Figure 6: SOG, COG and course rate, with windows that show the fixes."""
    figure = Figure(figsize=(11.0, 8.5), layout="constrained")
    panels = figure.subplots(3, 2, sharex="col", width_ratios=(2.2, 1.0))
    rows = (
        ("SOG (m/s)", record.sog, record.estimated_sog, None),
        ("COG (°)", np.degrees(record.cog), np.degrees(record.estimated_cog), np.degrees(record.desired)),
        ("course rate (°/s)", np.degrees(record.course_rate), np.degrees(record.estimated_rate), None),
    )
    inside = (record.time >= _ZOOM[0]) & (record.time <= _ZOOM[1])
    for (whole, window), (name, true, estimated, desired) in zip(panels, rows, strict=True):
        for axes, chosen in ((whole, slice(None)), (window, inside)):
            axes.plot(record.time[chosen], estimated[chosen], color=OURS, linewidth=1.6, label="estimated")
            axes.plot(record.time[chosen], true[chosen], color="black", linewidth=1.0, label="true")
            if desired is not None:
                axes.plot(record.time[chosen], desired[chosen], "--", color=BAD, linewidth=0.9, label="desired")
            _finish(axes)
        settled = record.time > 1.0
        low, high = true[settled].min(), true[settled].max()
        whole.set_ylim(low - 0.25 * (high - low), high + 0.25 * (high - low))
        whole.axvspan(*_ZOOM, color=QUIET, alpha=0.2, linewidth=0)
        whole.set_ylabel(name)
        window.get_legend().remove()
    for axes in panels[-1]:
        axes.set_xlabel("time (s)")
    caption = (
        "P0 figure 6: estimated SOG, COG and course rate. The windows to the right show one second: fixes at 5 Hz "
        "correct, the predictor runs at 50 Hz between them. The first second, in which the filter finds the speed from "
        "zero, leaves the figure."
    )
    return figure, caption


def noise(record, runs):
    """What becomes of it with noise; runs: name → product run."""
    figure = Figure(figsize=(9.0, 8.5), layout="constrained")
    panels = figure.subplots(1 + len(runs), 1)
    axes = panels[0]
    axes.plot(record.time, np.degrees(record.cog), ".", color=THEIRS, markersize=1.5, label="true course")
    axes.plot(record.time, np.degrees(record.desired), "--", color=BAD, linewidth=1.0, label="desired")
    axes.set_title("published tuning, 0.01 m of noise", loc="left", fontsize=10)
    for axes, (name, run) in zip(panels[1:], runs.items(), strict=True):
        time = run.time - RUN_IN
        shown = time > -5.0
        axes.plot(time[shown], np.degrees(run["estimated_cog"][shown]), color=QUIET, linewidth=0.8, label="estimated")
        axes.plot(time[shown], np.degrees(run.true_cog[shown]), color=OURS, linewidth=1.4, label="true course")
        desired = run["reference_angle"][shown]
        axes.plot(time[shown], np.degrees(desired), "--", color=BAD, linewidth=1.0, label="desired")
        command = np.degrees([commanded(each) for each in time[shown]])
        axes.plot(time[shown], command, ":", color="black", linewidth=0.8, label="command")
        axes.set_title(name, loc="left", fontsize=10)
    for axes in panels:
        axes.set_ylabel("course (°)")
        _finish(axes)
    panels[-1].set_xlabel("time (s)")
    caption = (
        "The same order with noise in the fixes. Above, the published tuning, which believes every fix: at 1 cm it "
        "steers in all directions. Below, the product's filter and autopilot."
    )
    return figure, caption


def _finish(axes):
    axes.grid(alpha=0.25)
    axes.margins(x=0.01)
    axes.legend(loc="best", fontsize=8, framealpha=0.85)
