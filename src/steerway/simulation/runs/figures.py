"""Figures of a run: the track, the estimate against the truth, steering, and the actuators."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from steerway.core.arrays import Floats
from steerway.pilot import Mode
from steerway.report.drawing import BAD, OURS, QUIET, THEIRS, broken, on_axis
from steerway.report.plots import TRUTH, Band, Curve, Panel, series, track
from steerway.simulation import outcome
from steerway.simulation.loop import Run
from steerway.vessels.vessel import Actuator

_MOST_POINTS = 6000
_DEGREE = np.degrees(1.0)


def track_figure(run: Run, waypoints: tuple[Floats, Floats]) -> Figure:
    """True and estimated track with the route; waypoints (n, 2) north and east in m, with acceptance radii (n,)."""
    places, radii = waypoints
    run = _thinned(run)
    north, east, holding = run["true_north"], run["true_east"], run["mode"] == Mode.HOLDING
    stays = [Curve(east[holding], north[holding], "on station", BAD, ".")] if holding.any() else []
    figure = track(
        [
            Curve(places[:, 1], places[:, 0], "route", QUIET, "--"),
            Curve(run["read_east"], run["read_north"], "fixes", THEIRS, "."),
            Curve(run["estimated_east"], run["estimated_north"], "estimated"),
            Curve(east, north, "true", TRUTH),
            *stays,
            Curve(east[:1], north[:1], "start", TRUTH, "o"),
        ]
    )
    (axes,) = figure.axes
    for number, ((north, east), radius) in enumerate(zip(places, radii, strict=True)):
        axes.add_patch(Circle((east, north), radius, fill=False, edgecolor=QUIET, linewidth=0.8))
        axes.annotate(str(number), (east, north), textcoords="offset points", xytext=(7, 7), fontsize=9)
    return figure


def errors_figure(run: Run) -> Figure:
    """Errors of the estimate, with the estimator's ± 2σ; the heading is included if it is estimated."""
    run = _thinned(run)
    errors = outcome.errors(run)
    settled = run.time > outcome.SETTLING
    panels = []
    for name, label, scale in (
        ("sog", "SOG (m/s)", 1.0),
        ("cog", "COG (°)", _DEGREE),
        ("course_rate", "course rate (°/s)", _DEGREE),
        *([("heading", "heading (°)", _DEGREE)] if np.isfinite(errors["heading"]).any() else []),
        ("position", "position (m),\nlength of the error", 1.0),
    ):
        error, band = scale * errors[name], 2.0 * scale * run[f"estimated_{name}_std"]
        reach = 1.0
        if np.isfinite(error[settled]).any():
            reach = float(np.nanquantile(np.abs(np.concatenate([error[settled], band[settled]])), 0.995))
        low, least = (0.0 * band, 0.0) if name == "position" else (-band, -1.25 * reach)
        within = Band(run.time, low, band, "± 2σ of the estimator", OURS)
        curves = [Curve(run.time, error, "estimated − true")]
        panels.append(Panel(label, curves, ylim=(least, 1.25 * reach + 1e-9), bands=[within]))
    return series(panels)


def steering_figure(run: Run) -> Figure:
    """True and commanded course, speed, cross-track error and crab angle."""
    run = _thinned(run)
    course = {
        "commanded": (_compass(run["desired_angle"]), THEIRS),
        "true course": (_compass(run.true_cog), TRUTH),
        "true heading": (_compass(run["true_heading"]), QUIET),
    }
    speed = {"commanded": (_known_speed(run), THEIRS), "true SOG": (run.true_sog, TRUTH)}
    cross = {"estimated": (run["leg_cross_track"], OURS), "true": (run.true_cross_track, TRUTH)}
    moving = np.where(run.true_sog > 0.3, np.degrees(outcome.crab_angle(run)), np.nan)
    figure = series(
        [
            Panel("course, heading (°)", _curves(run, course), ylim=(0.0, 360.0)),
            Panel("SOG (m/s)", _curves(run, speed), ylim=(0.0, None)),
            Panel("cross-track (m)\n+ starboard", _curves(run, cross)),
            Panel("crab angle (°)\n+ starboard", [Curve(run.time, broken(moving), "course − heading, true", TRUTH)]),
        ]
    )
    figure.axes[0].set_yticks(range(0, 361, 90))
    return figure


def orders_figure(run: Run) -> Figure:
    """Course or heading and speed: ordered, estimated and true."""
    run = _thinned(run)
    by_course = bool(np.mean(run["by_course"]) > 0.5)
    course = {
        "ordered": (run["desired_angle"], THEIRS),
        "reference": (run["reference_angle"], QUIET),
        "estimated": (run["estimated_cog" if by_course else "estimated_heading"], OURS),
        "true": (run.true_cog if by_course else run["true_heading"], TRUTH),
    }
    speed = {
        "ordered": (_known_speed(run), THEIRS),
        "estimated": (run["estimated_sog"], OURS),
        "true": (run.true_sog, TRUTH),
    }
    angles = {label: (_unwound(angle), colour) for label, (angle, colour) in course.items()}
    name = "course (°)" if by_course else "heading (°)"
    return series([Panel(name, _curves(run, angles)), Panel("SOG (m/s)", _curves(run, speed))])


def manoeuvre_figures(run: Run, course: float) -> tuple[Figure, Figure]:
    """Track, and heading with helm, of a manoeuvre that begins on a course (rad)."""
    began = int(np.argmax(run["yaw"] != 0.0))
    run = _thinned(run.rows(slice(max(began - 1, 0), None)))
    north, east = run["true_north"], run["true_east"]
    turned = Curve(run.time, _unwound(run["true_heading"] - course), "change of heading", TRUTH)
    helm = Curve(run.time, run["yaw"], "helm, as the autopilot's output")
    place = track([Curve(east, north, colour=TRUTH), Curve(east[:1], north[:1], "helm put over", TRUTH, "o")])
    return place, series([Panel("change of\nheading (°)", [turned]), Panel("", [helm])])


def places_figure(run: Run) -> Figure:
    """Position and heading in dynamic positioning, and the errors of the estimate and of the fixes."""
    run = _thinned(run)
    away, bearing = run["leg_distance"], run["leg_bearing"]
    ordered = {
        "north": run["estimated_north"] + away * np.cos(bearing),
        "east": run["estimated_east"] + away * np.sin(bearing),
        "heading": run["desired_angle"],
    }
    panels = []
    for name, wanted in ordered.items():
        lines = {
            "ordered": (wanted, THEIRS),
            "estimated": (run[f"estimated_{name}"], OURS),
            "true": (run[f"true_{name}"], TRUTH),
        }
        if name == "heading":
            lines = {label: (_unwound(angle), colour) for label, (angle, colour) in lines.items()}
        panels.append(Panel("heading (°)" if name == "heading" else f"{name} (m)", _curves(run, lines)))
    for name in ("north", "east"):
        true = run[f"true_{name}"]
        fixes = Curve(run.time, run[f"read_{name}"] - true, "fix − true", THEIRS, ".")
        estimated = Curve(run.time, run[f"estimated_{name}"] - true, "estimated − true")
        panels.append(Panel(f"{name} error (m)", [fixes, estimated]))
    return series(panels)


def actuators_figure(run: Run, actuators: Sequence[Actuator]) -> Figure:
    """The commands of the actuators, with their limits."""
    run = _thinned(run)
    panels = []
    for each, command in zip(actuators, run.command.T, strict=True):
        scale = _DEGREE if each.name == "rudder" else 1.0
        limits = [scale * limit for limit in (each.low, each.high) if np.isfinite(limit)]
        panels.append(Panel(each.name + _unit(each.name), [Curve(run.time, scale * command, "command")], limits=limits))
    return series(panels)


def _unit(name: str) -> str:
    """The unit of an actuator, by the last word of its name."""
    units = {"rudder": "°", "force": "N", "moment": "N·m"}
    if name.startswith("thruster"):
        return "\n(N)"
    return f"\n({'rev/s' if name == 'shaft speed' else units.get(name.split()[-1], 'rad/s')})"


def _curves(run: Run, lines: dict[str, tuple[Floats, str]]) -> list[Curve]:
    """Curves over time of {label: (values, colour)}."""
    return [Curve(run.time, values, label, colour) for label, (values, colour) in lines.items()]


def _thinned(run: Run) -> Run:
    return run.rows(slice(None, None, max(1, -(-len(run) // _MOST_POINTS))))


def _known_speed(run: Run) -> Floats:
    return np.where(run["mode"] == Mode.UNDER_WAY, run["asked_speed"], np.nan)


def _compass(radians: Floats) -> Floats:
    return broken(on_axis(radians, 0.0))


def _unwound(angle: Floats) -> Floats:
    """Degrees without jumps, (n,)."""
    known = np.isfinite(angle)
    unwound = np.full(len(angle), np.nan)
    unwound[known] = np.degrees(np.unwrap(angle[known]))
    return unwound
