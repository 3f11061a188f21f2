"""What the captions of P1's figures 5–8 name, and the Lyapunov decrease. Each gives (figure, caption)."""

import numpy as np
from matplotlib.figure import Figure

from steerway.report import BAD, OURS, QUIET, THEIRS
from steerway.vessels import MARINER_RUDDER as RUDDER
from steerway_studies.mariner_los.ship import (
    STATED_NOISE,
    SWITCH_RADIUS,
    ShipCase,
    asked_rudder_rate,
    route,
    rudder,
    voyage,
)

_COLOURS = {"true states": QUIET, "printed filter": THEIRS, "product filter": OURS}
_NOISE = "noise of 0.0634 m a step, 4.7 m in the long run; T_lp = 40 s"


def all_figures(seed: int) -> dict:
    """Figures 5 to 8, (figure, caption) by stem, of one seed."""
    runs = {
        "true states": voyage(ShipCase("truth"))[0],
        "printed filter": voyage(ShipCase("printed", STATED_NOISE, seed=seed))[0],
        "product filter": voyage(ShipCase("product", STATED_NOISE, seed=seed))[0],
    }
    return {
        "figure_5_track": track(runs),
        "figure_6_course": course(runs),
        "figure_7_speed": speed(runs),
        "figure_8_rudder": rudder_angle(runs),
    }


def track(runs):
    """Figure 5: North–East positions when traversing the waypoints."""
    figure = Figure(figsize=(8.0, 7.0), layout="constrained")
    axes = figure.subplots()
    way = route()
    axes.plot(way.east / 1e3, way.north / 1e3, "--", color="black", linewidth=0.8, label="route")
    axes.plot(way.east / 1e3, way.north / 1e3, "o", color=BAD, markersize=5, label="waypoints")
    for name, run in runs.items():
        axes.plot(run["true_east"] / 1e3, run["true_north"] / 1e3, color=_COLOURS[name], linewidth=1.4, label=name)
    axes.set_xlabel("east (km)")
    axes.set_ylabel("north (km)")
    axes.set_aspect("equal")
    _finish(axes)
    caption = (
        "P1 figure 5: the ship's positions while traversing the waypoints, the next one taken when "
        f"{SWITCH_RADIUS:.0f} m remain, steered on true states, on the printed filter and on the product's ({_NOISE})."
    )
    return figure, caption


def course(runs):
    """Figure 6: true, estimated and desired course."""
    figure, panels = _panels(runs)
    for axes, (name, run) in zip(panels, runs.items(), strict=True):
        axes.plot(run.time, _unwrapped(run["reference_angle"]), "--", color=BAD, linewidth=1.0, label="desired")
        axes.plot(run.time, _unwrapped(run.true_cog), color="black", linewidth=1.2, label="true")
        if name != "true states":
            estimated = _unwrapped(run["estimated_cog"])
            axes.plot(run.time, estimated, color=_COLOURS[name], linewidth=1.0, alpha=0.8, label="estimated")
        axes.set_ylim(-45.0, 175.0)
        axes.set_yticks(range(-30, 151, 30))
        axes.set_ylabel("course (°)")
        axes.set_title(name, loc="left", fontsize=10)
        _finish(axes)
    panels[-1].set_xlabel("time (s)")
    return figure, f"P1 figure 6: true, estimated and desired course ({_NOISE})."


def speed(runs):
    """Figure 7: true and estimated speed."""
    figure, panels = _panels(runs)
    for axes, (name, run) in zip(panels, runs.items(), strict=True):
        if name != "true states":
            axes.plot(run.time, run["estimated_sog"], color=_COLOURS[name], linewidth=0.8, label="estimated")
        axes.plot(run.time, run.true_sog, color="black", linewidth=1.2, label="true")
        axes.set_ylim(4.0, 9.0)
        axes.set_ylabel("speed (m/s)")
        axes.set_title(name, loc="left", fontsize=10)
        _finish(axes)
    panels[-1].set_xlabel("time (s)")
    return figure, f"P1 figure 7: true and estimated speed over ground; the speed drops in the turns ({_NOISE})."


def rudder_angle(runs):
    """Figure 8: rudder angle and rudder rate."""
    figure = Figure(figsize=(11.0, 10.0), layout="constrained")
    panels = figure.subplots(len(runs), 2, sharex=True)
    for (angle, rate), (name, run) in zip(panels, runs.items(), strict=True):
        angle.plot(run.time, np.degrees(rudder(run)), color=OURS, linewidth=0.9, label="rudder")
        angle.set_ylabel("rudder (°)\n+ starboard")
        angle.set_ylim(-45.0, 45.0)
        rate.plot(run.time, np.degrees(asked_rudder_rate(run)), color=OURS, linewidth=0.6, label="asked of the machine")
        rate.set_ylabel("rudder rate (°/s)")
        rate.set_ylim(-12.0, 12.0)
        for axes, limit in ((angle, RUDDER.high), (rate, RUDDER.rate)):
            axes.axhline(np.degrees(limit), color=BAD, linestyle="--", linewidth=0.8, label="limit")
            axes.axhline(-np.degrees(limit), color=BAD, linestyle="--", linewidth=0.8)
            axes.set_title(name, loc="left", fontsize=10)
            _finish(axes)
    for axes in panels[-1]:
        axes.set_xlabel("time (s)")
    caption = (
        f"P1 figure 8: rudder angle and rudder rate ({_NOISE}). The paper's is from the loop with the filter; the "
        "rate is what the autopilot asks for, (command − rudder)/1 s, of which the machine gives 5 °/s. Peaks beyond "
        "±12 °/s are cut off."
    )
    return figure, caption


def saturation(table):
    """Time at a limit and the largest deviation over T_lp; table: name → [(T_lp, rudder max, time %, |y_e| max)]."""
    figure = Figure(figsize=(11.0, 4.5), layout="constrained")
    limited, deviation = figure.subplots(1, 2)
    for name, rows in table.items():
        low_pass, _, time, error = np.array(rows).T
        colour = next(colour for start, colour in _COLOURS.items() if name.startswith(start))
        style = "--" if "0.0634" in name else "-"
        limited.semilogy(low_pass, np.maximum(time, 0.02), style, marker="o", markersize=4, color=colour, label=name)
        deviation.plot(low_pass, error, style, marker="o", markersize=4, color=colour, label=name)
    limited.set_ylabel("time with the rudder or its rate at a limit (%)\nnever: drawn at 0.02")
    deviation.set_ylabel("largest cross-track error (m)")
    for axes in (limited, deviation):
        axes.set_xlabel("T_lp (s)")
        _finish(axes)
    limited.get_legend().remove()
    caption = (
        "Whether saturation is avoided: the part of the voyage in which the autopilot asks for more than 40° or 5 °/s, "
        "and what a slower reference costs, over the time constant of the low-pass that P1 leaves open."
    )
    return figure, caption


def lyapunov(ideal, ship):
    """The decrease of V along two approaches."""
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    axes = figure.subplots()
    for approach, name, colour in ((ideal, "on the desired course", QUIET), (ship, "the ship as steered", OURS)):
        axes.semilogy(approach.time, np.maximum(approach.lyapunov, 1e-3), color=colour, linewidth=1.6, label=name)
    axes.set_ylim(1e-2, 1e6)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("V = y_e²/2 (m²)")
    _finish(axes)
    caption = (
        "The Lyapunov function of P1 (37)–(38) along an approach from 600 m beside the path. With χ = χ_d it falls as "
        "(38) has it. The ship, whose autopilot needs time and whose command is low-passed, goes out on her parallel "
        "course first, crosses the path and swings back: the proof supposes perfect tracking."
    )
    return figure, caption


def _panels(runs):
    figure = Figure(figsize=(10.0, 9.0), layout="constrained")
    return figure, figure.subplots(len(runs), 1, sharex=True)


def _unwrapped(angle):
    """Degrees, laid so that the route's courses do not jump."""
    degrees = np.degrees(angle)
    return np.where(degrees < -90.0, degrees + 360.0, degrees)


def _finish(axes):
    axes.grid(alpha=0.25)
    axes.margins(x=0.01)
    axes.legend(loc="best", fontsize=8, framealpha=0.85)
