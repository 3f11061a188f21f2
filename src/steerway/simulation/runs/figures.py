"""Figures of a run: the track, the estimate against the truth, steering, and the actuators."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from steerway.core.arrays import Floats
from steerway.pilot import Mode
from steerway.report.drawing import BAD, OURS, QUIET, THEIRS
from steerway.simulation import outcome
from steerway.simulation.loop import Run
from steerway.vessels.vessel import Actuator

if TYPE_CHECKING:
    from matplotlib.patches import Circle

_MOST_POINTS = 6000
TRUE = "#222222"


def track_figure(run: Run, waypoints: tuple[Floats, Floats]) -> Figure:
    """True and estimated track with the route; waypoints (n, 2) north and east in m, with acceptance radii (n,)."""
    places, radii = waypoints
    run = _thinned(run)
    figure = Figure(figsize=(9.0, 7.5), layout="constrained")
    axes = figure.subplots()
    axes.plot(places[:, 1], places[:, 0], "--", color=QUIET, linewidth=1.2, label="route")
    for (north, east), radius in zip(places, radii, strict=True):
        axes.add_patch(_circle(east, north, radius))
    for number, (north, east) in enumerate(places):
        axes.annotate(
            str(number), (east, north), textcoords="offset points", xytext=(7, 7), fontsize=9, color="#52606d"
        )
    axes.plot(run["read_east"], run["read_north"], ".", color=THEIRS, markersize=2.0, alpha=0.5, label="fixes")
    axes.plot(run["estimated_east"], run["estimated_north"], color=OURS, linewidth=1.2, label="estimated")
    axes.plot(run["true_east"], run["true_north"], color=TRUE, linewidth=1.2, label="true")
    holding = run["mode"] == Mode.HOLDING
    if holding.any():
        axes.plot(
            run["true_east"][holding], run["true_north"][holding], ".", color=BAD, markersize=2, label="on station"
        )
    axes.plot(run["true_east"][0], run["true_north"][0], "o", color=TRUE, markersize=6, label="start")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("east (m)")
    axes.set_ylabel("north (m)")
    axes.grid(alpha=0.25)
    axes.legend(loc="best", framealpha=0.85)
    return figure


def _circle(east: float, north: float, radius: float) -> "Circle":
    from matplotlib.patches import Circle

    return Circle((east, north), radius, fill=False, edgecolor=QUIET, linewidth=0.8)


def errors_figure(run: Run) -> Figure:
    """Errors of the estimate, of the heading too where there is one, with the ± 2σ of the estimator."""
    run = _thinned(run)
    errors = outcome.errors(run)
    panels = [
        ("sog", "SOG (m/s)", 1.0),
        ("cog", "COG (°)", np.degrees(1.0)),
        ("course_rate", "course rate (°/s)", np.degrees(1.0)),
        *([("heading", "heading (°)", np.degrees(1.0))] if np.isfinite(errors["heading"]).any() else []),
        ("position", "position (m)", 1.0),
    ]
    figure = Figure(figsize=(11.0, 1.5 + 2.0 * len(panels)), layout="constrained")
    axes = figure.subplots(len(panels), 1, sharex=True)
    for each, (name, label, scale) in zip(axes, panels, strict=True):
        band = 2.0 * scale * run[f"estimated_{name}_std"]
        low = -band if name != "position" else np.zeros(len(run))
        each.fill_between(run.time, low, band, color=OURS, alpha=0.18, linewidth=0, label="± 2σ of the estimator")
        each.plot(run.time, scale * errors[name], color=OURS, linewidth=0.9, label="estimated − true")
        each.set_ylabel(label)
        settled = run.time > outcome.SETTLING
        reach = (
            np.nanquantile(np.abs(np.concatenate([scale * errors[name][settled], band[settled]])), 0.995)
            if (np.isfinite(errors[name][settled]).any())
            else 1.0
        )
        each.set_ylim(-1.25 * reach if name != "position" else 0.0, 1.25 * reach + 1e-9)
    axes[-1].set_ylabel("position (m),\nlength of the error")
    return _finished(figure, axes)


def steering_figure(run: Run) -> Figure:
    """Course made good and commanded course, speed, cross-track error and crab angle."""
    run = _thinned(run)
    figure = Figure(figsize=(11.0, 9.5), layout="constrained")
    course, speed, cross, crab = axes = figure.subplots(4, 1, sharex=True)
    course.plot(run.time, _compass(run["desired_angle"]), color=THEIRS, linewidth=1.0, label="commanded")
    course.plot(run.time, _compass(run.true_cog), color=TRUE, linewidth=1.0, label="true course")
    course.plot(run.time, _compass(run["true_heading"]), color=QUIET, linewidth=1.0, label="true heading")
    course.set_ylim(0.0, 360.0)
    course.set_yticks(range(0, 361, 90))
    course.set_ylabel("course, heading (°)")
    speed.plot(run.time, _known_speed(run), color=THEIRS, linewidth=1.0, label="commanded")
    speed.plot(run.time, run.true_sog, color=TRUE, linewidth=1.0, label="true SOG")
    speed.set_ylim(bottom=0.0)
    speed.set_ylabel("SOG (m/s)")
    cross.plot(run.time, run["leg_cross_track"], color=OURS, linewidth=1.0, label="estimated")
    cross.plot(run.time, outcome.true_cross_track(run), color=TRUE, linewidth=1.0, label="true")
    cross.axhline(0.0, color=QUIET, linewidth=0.8)
    cross.set_ylabel("cross-track (m)\n+ starboard")
    moving = np.where(run.true_sog > 0.3, np.degrees(outcome.crab_angle(run)), np.nan)
    crab.plot(run.time, _lifted(moving), color=TRUE, linewidth=1.0, label="course − heading, true")
    crab.axhline(0.0, color=QUIET, linewidth=0.8)
    crab.set_ylabel("crab angle (°)\n+ starboard")
    return _finished(figure, axes)


def orders_figure(run: Run) -> Figure:
    """Course or heading and speed, as ordered and as made good."""
    run = _thinned(run)
    figure = Figure(figsize=(11.0, 7.0), layout="constrained")
    course, speed = axes = figure.subplots(2, 1, sharex=True)
    by_course = np.full(len(run), np.mean(run["by_course"]) > 0.5)
    estimated = np.where(by_course, run["estimated_cog"], run["estimated_heading"])
    true = np.where(by_course, run.true_cog, run["true_heading"])
    shown = (
        (run["desired_angle"], THEIRS, "ordered"),
        (run["reference_angle"], QUIET, "reference"),
        (estimated, OURS, "estimated"),
        (true, TRUE, "true"),
    )
    for angle, color, label in shown:
        course.plot(run.time, _unwound(angle), color=color, linewidth=1.0, label=label)
    course.set_ylabel("course (°)" if by_course.all() else "heading (°)")
    for values, color, label in (
        (_known_speed(run), THEIRS, "ordered"),
        (run["estimated_sog"], OURS, "estimated"),
        (run.true_sog, TRUE, "true"),
    ):
        speed.plot(run.time, values, color=color, linewidth=1.0, label=label)
    speed.set_ylabel("SOG (m/s)")
    return _finished(figure, axes)


def manoeuvre_figure(run: Run, course: float) -> Figure:
    """Track and heading of a manoeuvre that begins on a course (rad)."""
    began = int(np.argmax(run["yaw"] != 0.0))
    run = _thinned(run.rows(slice(max(began - 1, 0), None)))
    figure = Figure(figsize=(11.0, 9.0), layout="constrained")
    place, turned, yaw = figure.subplot_mosaic([["place"], ["turned"], ["yaw"]], height_ratios=[2.2, 1.0, 0.7]).values()
    place.plot(run["true_east"], run["true_north"], color=TRUE, linewidth=1.2)
    place.plot(run["true_east"][0], run["true_north"][0], "o", color=TRUE, markersize=6, label="helm put over")
    place.set_aspect("equal", adjustable="datalim")
    place.set_xlabel("east (m)")
    place.set_ylabel("north (m)")
    turned.plot(run.time, _unwound(run["true_heading"] - course), color=TRUE, linewidth=1.0, label="change of heading")
    turned.set_ylabel("change of\nheading (°)")
    yaw.plot(run.time, run["yaw"], color=OURS, linewidth=1.0, label="helm, as the autopilot's output")
    turned.sharex(yaw)
    return _finished(figure, [place, turned, yaw])


def places_figure(run: Run) -> Figure:
    """Place and heading in dynamic positioning, and the errors of what is estimated and of what the receiver reads."""
    run = _thinned(run)
    figure = Figure(figsize=(11.0, 11.0), layout="constrained")
    axes = figure.subplots(5, 1, sharex=True)
    away, bearing = run["leg_distance"], run["leg_bearing"]
    ordered = {
        "north": run["estimated_north"] + away * np.cos(bearing),
        "east": run["estimated_east"] + away * np.sin(bearing),
        "heading": _unwound(run["desired_angle"]),
    }
    for each, (name, values) in zip(axes, ordered.items(), strict=False):
        each.plot(run.time, values, color=THEIRS, linewidth=1.0, label="ordered")
        for whose, color in (("estimated", OURS), ("true", TRUE)):
            shown = run[f"{whose}_{name}"]
            each.plot(
                run.time, _unwound(shown) if name == "heading" else shown, color=color, linewidth=1.0, label=whose
            )
        each.set_ylabel("heading (°)" if name == "heading" else f"{name} (m)")
    for each, name in zip(axes[3:], ("north", "east"), strict=True):
        true = run[f"true_{name}"]
        each.plot(run.time, run[f"read_{name}"] - true, ".", color=THEIRS, markersize=3.0, label="fix − true")
        each.plot(run.time, run[f"estimated_{name}"] - true, color=OURS, linewidth=0.9, label="estimated − true")
        each.set_ylabel(f"{name} error (m)")
    return _finished(figure, axes)


def _unwound(angle: Floats) -> Floats:
    """Degrees without jumps, (n,)."""
    known = np.isfinite(angle)
    unwound = np.full(len(angle), np.nan)
    unwound[known] = np.degrees(np.unwrap(angle[known]))
    return unwound


def actuators_figure(run: Run, actuators: Sequence[Actuator]) -> Figure:
    """The commands of the actuators."""
    run = _thinned(run)
    figure = Figure(figsize=(11.0, 2.0 + 2.0 * len(actuators)), layout="constrained")
    axes = np.atleast_1d(figure.subplots(len(actuators), 1, sharex=True))
    for each, actuator, command in zip(axes, actuators, run.command.T, strict=True):
        rudder = actuator.name == "rudder"
        scale = np.degrees(1.0) if rudder else 1.0
        each.plot(run.time, scale * command, color=OURS, linewidth=0.8, label="command")
        for limit in (actuator.low, actuator.high):
            if np.isfinite(limit):
                each.axhline(scale * limit, color=BAD, linewidth=0.8, linestyle="--")
        each.plot([], [], color=BAD, linewidth=0.8, linestyle="--", label="limits")
        each.set_ylabel(actuator.name + _unit(actuator.name))
    return _finished(figure, axes)


def _unit(name: str) -> str:
    """Of an actuator, by the last word of its name."""
    units = {"rudder": "°", "force": "N", "moment": "N·m"}
    if name.startswith("thruster"):
        return "\n(N)"
    return f"\n({'rev/s' if name == 'shaft speed' else units.get(name.split()[-1], 'rad/s')})"


def _finished(figure: Figure, axes: Sequence[Axes] | np.ndarray) -> Figure:
    for each in axes:
        each.grid(alpha=0.25)
        each.margins(x=0.01)
        each.legend(loc="best", fontsize=8, framealpha=0.85, ncols=3)
    axes[-1].set_xlabel("time (s)")
    return figure


def _thinned(run: Run) -> Run:
    return run.rows(slice(None, None, max(1, -(-len(run) // _MOST_POINTS))))


def _known_speed(run: Run) -> Floats:
    return np.where(np.isin(run["mode"], (Mode.UNDER_WAY,)), run["asked_speed"], np.nan)


def _compass(radians: Floats) -> Floats:
    return _lifted(np.mod(np.degrees(radians), 360.0))


def _lifted(degrees: Floats) -> Floats:
    """The line interrupted where it jumps by more than half a turn."""
    return np.where(np.abs(np.diff(degrees, prepend=degrees[:1])) > 180.0, np.nan, degrees)
