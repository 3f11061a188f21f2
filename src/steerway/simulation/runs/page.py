"""The report page of a run, and its interactive page."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from steerway.core.earth import displaced_all
from steerway.core.records import NO_COURSE, OK, Fixes, Motion
from steerway.report.page import ReportContents, Table, write_page
from steerway.simulation.assembly import begins, holds_places
from steerway.simulation.manoeuvres import ManoeuvringPilot, limits, measured
from steerway.simulation.run import Sailed

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_TRACK = "Route with acceptance circles, true and estimated track, and the fixes of the receiver."
_ERRORS = (
    "Error of the estimate, with the ± 2σ of the estimator. Slow errors of a receiver are not distinguishable from "
    "motion of the boat by positions alone: they appear in the position, hardly in SOG and COG."
)
_STEERING = (
    "Commanded course, course made good and heading; speed; cross-track error. The crab angle, from the bow to the "
    "course made good, is caused by current and wind; course control compensates it without measuring it."
)
_ORDERS = "Ordered course (or heading) and speed, the reference that the autopilot follows, and the true motion."
_PLACES = "Position and heading, ordered, estimated and true; errors of the estimate and of the receiver's fixes."
_MANOEUVRE = "The track from the point at which the helm is first put over."
_TURNED = "The heading, and the helm."
_ACTUATORS = "Commands of the actuators, with their limits."


def write_run_page(sailed: Sailed, path: Path, remarks: Sequence[str] = ()) -> None:
    """Write the page of a `run.Sailed`: track, errors, steering with crab angle, actuators, numbers."""
    scenario = sailed.scenario
    passages = [
        (each.waypoint, "reached" if each.reached else "missed", each.why, f"{each.time:.1f}", f"{each.distance:.1f}")
        for each in sailed.assembly.mission.passages
    ]
    tables: list[Table] = [
        ("Estimated against true", COMPARED, comparison(sailed.numbers)),
        ("Summary", ("", ""), summary(sailed.numbers)),
    ]
    if isinstance(sailed.assembly.pilot, ManoeuvringPilot):
        columns = "", "measured", "IMO limit, for ships of 100 m and more"
        tables = [(scenario.manoeuvre or "", columns, manoeuvred(sailed, sailed.assembly.pilot))]
    elif passages:
        tables.append(("Waypoints", ("waypoint", "", "by", "under way (s)", "distance (m)"), passages))
    write_page(path, scenario.name, tables, lambda: _figures(sailed), remarks, scenario.description)


def _figures(sailed: Sailed) -> list[tuple["Figure", str]]:
    from steerway.simulation.runs import figures

    run, pilot = sailed.run, sailed.assembly.pilot
    if isinstance(pilot, ManoeuvringPilot):
        place, turned = figures.manoeuvre_figures(run, pilot.mission.orders[0].course)
        steered = [(place, _MANOEUVRE), (turned, _TURNED)]
    elif holds_places(sailed.scenario):
        steered = [(figures.places_figure(run), _PLACES)]
    elif sailed.scenario.orders:
        steered = [(figures.orders_figure(run), _ORDERS), (figures.errors_figure(run), _ERRORS)]
    else:
        steered = [
            (figures.track_figure(run, route_of(sailed)), _TRACK),
            (figures.errors_figure(run), _ERRORS),
            (figures.steering_figure(run), _STEERING),
        ]
    return [
        *steered,
        (figures.actuators_figure(run, sailed.assembly.vessel.actuators), _ACTUATORS),
    ]


def manoeuvred(sailed: Sailed, pilot: ManoeuvringPilot) -> list[tuple[str, str, str]]:
    """(name, measured value, limit) of a manoeuvre's results."""
    vessel = sailed.scenario.vessel
    allowed = limits(pilot.manoeuvre, vessel.length, pilot.mission.cruise)
    units = {"deg": "°", "dps": "°/s", "m": "m", "s": "s", "lengths": "lengths", "pct": "%"}
    rows = []
    for key, value in measured(sailed.run, pilot, vessel.length).items():
        words, unit = key.rsplit("_", 1)
        limit = f"{allowed[key]:.1f}" if math.isfinite(allowed.get(key, math.nan)) else ""
        rows.append((words.replace("_", " "), _with_unit(value, units[unit], 2), limit))
    return rows


def route_of(sailed: Sailed) -> tuple[np.ndarray, np.ndarray]:
    """Waypoints (n, 2), north and east, and their radii (n,)."""
    routes = [mission.route for mission in sailed.assembly.mission.missions]
    rows: dict[tuple[float, float], float] = {}
    for route in routes:
        for north, east, radius in zip(route.north, route.east, route.acceptance, strict=True):
            rows.setdefault((float(north), float(east)), float(radius))
    ordered = [(float(n), float(e)) for route in routes for n, e in zip(route.north, route.east, strict=True)]
    places = [place for k, place in enumerate(ordered) if k == 0 or place != ordered[k - 1]]
    return np.array(places), np.array([rows[place] for place in places])


COMPARED = ("", "RMS error", "true within ± 2σ (95 % expected)")
"""Titles of the columns of `comparison`."""


def comparison(numbers: dict[str, float]) -> list[tuple[str, str, str]]:
    """(quantity, RMS error, share of the rows within ± 2σ) of the estimate; the first 30 s are excluded."""
    return [
        (words, _with_unit(numbers[rms], unit, digits), within(numbers[f"{rms.split('_rms')[0]}_within_2sigma_pct"]))
        for words, rms, unit, digits in (
            ("speed over ground", "sog_rms_mps", "m/s", 3),
            ("course over ground", "cog_rms_deg", "°", 2),
            ("course rate", "course_rate_rms_dps", "°/s", 2),
            ("position", "position_rms_m", "m", 2),
        )
    ]


def within(share: float) -> str:
    """A coverage in words."""
    return _with_unit(share, "% of the time", 1)


def summary(numbers: dict[str, float]) -> list[tuple[str, str]]:
    """The run as (quantity, value) pairs."""
    return [
        ("duration", _with_unit(numbers["duration_s"], "s", 1)),
        *_answers(numbers),
        *_under_way(numbers),
    ]


_ANSWERS: dict[str, tuple[str, str, int]] = {
    "settling_s": ("settling after an order, longest", "s", 1),
    "position_mae_m": ("estimated position, mean |error| over north and east", "m", 4),
    "overshoot_pct": ("overshoot, largest", "%", 1),
    "rudder_max_deg": ("largest rudder", "°", 1),
    "rudder_rate_max_dps": ("largest demanded rudder rate", "°/s", 2),
}


def _answers(numbers: dict[str, float]) -> list[tuple[str, str]]:
    """Rows of the summary for results that only some runs have."""
    answers = ((numbers[key], *each) for key, each in _ANSWERS.items() if key in numbers)
    return [(words, _with_unit(value, unit, decimals)) for value, words, unit, decimals in answers]


def _under_way(numbers: dict[str, float]) -> list[tuple[str, str]]:
    """Rows of the summary of a run that does not hold positions: its legs, if it has any, and its steering."""
    if "position_mae_m" in numbers:
        return []
    steered = [
        ("largest crab angle", _with_unit(numbers["crab_angle_max_deg"], "°", 1)),
        ("switches between course and heading control", f"{numbers['hand_overs']:.0f}"),
    ]
    if not math.isfinite(numbers["cross_track_rms_m"]) and not numbers["waypoints_reached"]:
        return steered
    return [
        ("waypoints", f"{numbers['waypoints_reached']:.0f} reached, {numbers['waypoints_missed']:.0f} missed"),
        (
            "cross-track error, true",
            f"{numbers['cross_track_rms_m']:.2f} m RMS, {numbers['cross_track_max_m']:.1f} m at most",
        ),
        ("cross-track error, as estimated", _with_unit(numbers["estimated_cross_track_rms_m"], "m RMS", 2)),
        *steered,
    ]


def _with_unit(value: float, unit: str, decimals: int) -> str:
    return "unknown" if not math.isfinite(value) else f"{value:.{decimals}f} {unit}".replace(" °", "°")


def write_story(sailed: Sailed, path: Path, remarks: Sequence[str] = ()) -> None:
    """Write the interactive page of a `run.Sailed`: truth and estimate at every fix."""
    from steerway.report.interactive import write_interactive_page

    run = sailed.run
    run = run.rows(np.isfinite(run["read_north"]))
    time = begins(sailed.scenario) + run.time
    known = np.isfinite(run["estimated_cog"])
    unknown = np.full(len(run), np.nan)
    estimate = Motion(
        time,
        *displaced_all(*sailed.origin, run["estimated_north"], run["estimated_east"]),
        **{name: run[f"estimated_{name}"] for name in ("sog", "cog", "course_rate", "sog_std", "cog_std")},
        course_rate_std=run["estimated_course_rate_std"],
        position_std=run["estimated_position_std"],
        position_relative_std=run["estimated_position_relative_std"],
        nis=unknown,
        status=np.where(known, OK, NO_COURSE).astype(np.uint8),
    )
    zero = np.zeros(len(run))
    truth = Motion(
        time,
        *displaced_all(*sailed.origin, run["true_north"], run["true_east"]),
        sog=run.true_sog,
        cog=run.true_cog,
        course_rate=run["true_course_rate"],
        **{name: zero for name in ("sog_std", "cog_std", "course_rate_std", "position_std")},
        nis=unknown,
        status=np.full(len(run), OK, np.uint8),
    )
    fixes = Fixes(time, *displaced_all(*sailed.origin, run["read_north"], run["read_east"]))
    numbers = sailed.numbers
    lead = (
        f"{sailed.scenario.description} Errors of the estimate: SOG {numbers['sog_rms_mps']:.2f} m/s, "
        f"COG {numbers['cog_rms_deg']:.1f}° RMS; the true course lies within the ±2σ band "
        f"{within(numbers['cog_within_2sigma_pct'])} (95 % expected)."
    )
    tables: list[Table] = [
        ("Estimated against true", COMPARED, comparison(numbers)),
        ("Summary", ("", ""), summary(numbers)),
    ]
    report = ReportContents(sailed.scenario.name, fixes, estimate, tables, remarks, truth=truth, lead=lead.strip())
    write_interactive_page(path, report)
