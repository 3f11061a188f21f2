"""Scenarios from TOML files, checked before the run.

The checks refuse unknown keys, combinations that cannot be simulated, keys without effect on the chosen vessel, and
legs that are shorter than the turns at their ends in the current. The error is one sentence with the key's path, the
value and what was expected.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from steerway.core.errors import InputError
from steerway.core.settings import kind_of, parse_toml, read_toml
from steerway.guidance.route import LONGEST_LEG
from steerway.sensors.gnss import GnssTable
from steerway.sensors.instrument import InstrumentTable
from steerway.sensors.kinds import INSTRUMENTS
from steerway.simulation import assembly
from steerway.simulation.corners import short_leg
from steerway.simulation.positioning import KINDS as POSITIONING_KINDS
from steerway.simulation.scenario import Scenario
from steerway.vessels.kinds import TABLES

MOST_STEPS = 20_000_000


def load_scenario(path: str | Path, changes: Mapping[str, object] | None = None) -> Scenario:
    """A scenario from a TOML file, checked by building every block. Raises InputError, one sentence.

    changes: values that replace those of the file; None keeps the file's.
    """
    changed = {name: value for name, value in (changes or {}).items() if value is not None}
    return _checked(read_toml(path, "scenario") | changed, f"scenario {path}", Path(path).parent)


def parse_scenario(text: str, place: str = "scenario", folder: Path | None = None) -> Scenario:
    """A scenario from TOML text; `place` names it in errors, `folder` contains the file of a profile."""
    return _checked(parse_toml(text, place), place, folder)


def _checked(tables: dict[str, Any], place: str, folder: Path | None) -> Scenario:
    scenario = Scenario.made_of(tables, place)
    profile = scenario.estimator.profile
    if folder is not None and profile is not None and profile.endswith(".toml") and not Path(profile).is_absolute():
        found = scenario.estimator.model_copy(update={"profile": str(folder / profile)})
        scenario = scenario.model_copy(update={"estimator": found})
    try:
        check(scenario)
    except InputError as error:
        raise InputError(f"{place}: {error}") from None
    return scenario


def check(scenario: Scenario) -> None:
    """Check a scenario and build every block once. Raises InputError for the first fault, one sentence with the key."""
    assembly.begins(scenario)
    if scenario.manoeuvre is not None:
        _manoeuvre(scenario)
        return
    for rule in (_steps, _rates, _places, _speeds, _steering, _positioning, _estimators, _instruments, _propulsion):
        rule(scenario)
    assembly.assemble(scenario)
    _legs(scenario)


def _manoeuvre(scenario: Scenario) -> None:
    """Checks for a manoeuvre, which uses neither route nor estimator."""
    _steps(scenario)
    _rates(scenario)
    if not assembly.boat(scenario).steers:
        raise InputError(f"manoeuvre needs a steered vessel, which kind {scenario.vessel.kind} is not")
    assembly.assemble(scenario)


def _steps(scenario: Scenario) -> None:
    steps = scenario.duration / scenario.step
    if steps > MOST_STEPS:
        raise InputError(
            f"duration of {scenario.duration:g} s in steps of {scenario.step:g} s is {steps:.2g} steps, "
            f"expected at most {MOST_STEPS:.0e}"
        )


def _rates(scenario: Scenario) -> None:
    fastest = 1.0 / scenario.step
    tables: dict[str, GnssTable | InstrumentTable] = {"gnss": scenario.gnss, **scenario.instruments()}
    for name, table in tables.items():
        given = name == "gnss" or "rate" in table.model_fields_set
        if given and table.rate > fastest * 1.001:
            raise InputError(f"{name}.rate is {table.rate:g} Hz, expected at most the step rate, {fastest:g} Hz")


def _places(scenario: Scenario) -> None:
    table = scenario.route
    if scenario.orders:
        for key in sorted(table.model_fields_set):
            raise InputError(f"route.{key} has no effect with [[orders]], expected one of the two")
        assembly.orders(scenario)
        return
    if len(table.points) < 2:
        raise InputError(
            f"route.waypoints is {list(table.waypoints)}, expected at least 2 entries, a table [route.survey] "
            "or [[orders]]"
        )
    if table.corner_radius is not None and table.corners == "exact":
        raise InputError('route.corner_radius has no effect on exact corners, expected corners = "arc" or "clothoid"')
    origin = (scenario.origin.latitude_deg, scenario.origin.longitude_deg)
    for index, (north, east) in enumerate(assembly.places(scenario)):
        if math.hypot(north, east) > LONGEST_LEG:
            raise InputError(
                f"route.waypoints[{index}] is {math.hypot(north, east) / 1e3:.0f} km from the origin at "
                f"{origin[0]:g}°, {origin[1]:g}°, expected at most {LONGEST_LEG / 1e3:.0f} km (metres or degrees?)"
            )


def _legs(scenario: Scenario) -> None:
    """Refuse legs shorter than their turns, for a boat that uses the estimated current to turn early."""
    known = assembly.boat(scenario)
    if scenario.estimator.kind != "steering" or not known.steers or scenario.orders:
        return
    flow = scenario.environment.current.velocity
    if trouble := short_leg(known, assembly.route(scenario, known), flow, assembly.stays(scenario)):
        raise InputError(trouble)


def _speeds(scenario: Scenario) -> None:
    if assembly.holds_places(scenario):
        for key in sorted(scenario.speed.model_fields_set):
            raise InputError(f"speed.{key} has no effect where orders hold a position")
        return
    known, waypoints = assembly.boat(scenario), scenario.route.points
    commanded = {}
    if known.speed is None:
        for key in ("cruise", "bandwidth", "force"):
            if key in scenario.speed.model_fields_set:
                raise InputError(
                    f"speed.{key} has no effect on a vessel of kind {scenario.vessel.kind}, which has no speed control"
                )
    elif scenario.speed.force is not None:
        for key in sorted(scenario.speed.model_fields_set - {"force"}):
            raise InputError(f"speed.{key} has no effect with speed.force, expected one of the two")
    elif any(each.speed is None for each in waypoints[1:]) or any(each.speed is None for each in scenario.orders[:1]):
        commanded["speed.cruise"] = known.cruise
    for k, each in enumerate(scenario.orders):
        if each.speed is not None:
            commanded[f"orders[{k}].speed"] = each.speed
    for k, waypoint in enumerate(waypoints):
        if waypoint.speed is not None:
            commanded[f"route.waypoints[{k}].speed"] = waypoint.speed
    least = assembly.STEERAGEWAY.take if scenario.guidance.angle == "course" else 0.0
    for place, speed in commanded.items():
        if speed <= least:
            below = ": below steerageway course is undefined" if least else ""
            raise InputError(f"{place} is {speed:g} m/s, expected more than {least:g} m/s{below}")
        if speed > known.top_speed:
            raise InputError(f"{place} is {speed:g} m/s, expected at most the vessel's {known.top_speed:g} m/s")


def _steering(scenario: Scenario) -> None:
    """Requirements of a boat that cannot turn, or is unstable in yaw."""
    kind, known = scenario.vessel.kind, assembly.boat(scenario)
    if not known.steers:
        if scenario.autopilot.model_fields_set:
            raise InputError(f"autopilot has no effect on a vessel of kind {kind}, which cannot turn")
        heading = math.radians(scenario.start.heading_deg)
        for index, (north, east) in enumerate(assembly.places(scenario)):
            north, east = north - scenario.start.north, east - scenario.start.east
            across = abs(east * math.cos(heading) - north * math.sin(heading))
            if across > known.acceptance:
                raise InputError(
                    f"route.waypoints[{index}] is {across:.0f} m to the side of the boat's heading, expected at most "
                    f"{known.acceptance:g} m for a vessel of kind {kind}, which cannot turn"
                )
    if kind == "caldas" and scenario.estimator.kind != "truth":
        if scenario.compass is None or scenario.gyro is None:
            raise InputError("vessel.kind caldas is unstable in yaw, expected tables [compass] and [gyro]")
        if scenario.guidance.angle != "heading":
            raise InputError(
                f"guidance.law {scenario.guidance.law} commands a course, expected one that commands a heading: "
                "vessel.kind caldas is unstable in yaw"
            )
    if kind == "caldas" and scenario.autopilot.kind != "pole-placement":
        raise InputError(
            f"autopilot.kind {scenario.autopilot.kind} predicts a stable response, "
            "expected pole-placement for vessel.kind caldas, which is unstable in yaw"
        )


def _positioning(scenario: Scenario) -> None:
    """Orders of positions need an estimator that uses the forces, and such an estimator takes no other orders."""
    kind, holds = scenario.estimator.kind, assembly.holds_places(scenario)
    if holds and kind not in (*POSITIONING_KINDS, "truth"):
        able = ", ".join((*POSITIONING_KINDS, "truth"))
        raise InputError(f'estimator.kind is "{kind}", expected one of {able} where orders hold a position')
    if not holds and kind in POSITIONING_KINDS:
        raise InputError(f'estimator.kind "{kind}" needs positions to hold, expected [[orders]] with north and east')
    if not holds and scenario.positioning.model_fields_set:
        raise InputError("[positioning] has no effect, expected [[orders]] with north and east")
    if kind in POSITIONING_KINDS and scenario.compass is None:
        raise InputError(f'estimator.kind "{kind}" needs a compass, expected a table [compass]')
    for index, each in enumerate(scenario.orders):
        if holds and each.speed is not None:
            raise InputError(f"orders[{index}].speed has no effect where orders hold a position")


def _estimators(scenario: Scenario) -> None:
    heading, speed = scenario.estimator.heading, scenario.estimator.speed
    kind = scenario.vessel.kind
    of_vessel = scenario.estimator.kind in POSITIONING_KINDS
    if not of_vessel and scenario.estimator.positioning.model_fields_set:
        raise InputError(f'estimator.positioning has no effect with estimator.kind "{scenario.estimator.kind}"')
    if of_vessel or scenario.estimator.kind in ("truth", "steering"):
        for name, table in (("heading", heading), ("speed", speed)):
            if table.model_fields_set:
                raise InputError(f'estimator.{name} has no effect with estimator.kind "{scenario.estimator.kind}"')
    if of_vessel or scenario.estimator.kind == "truth":
        return
    if heading.kind != "tracker":
        if not assembly.boat(scenario).steers:
            raise InputError(f"estimator.heading.kind {heading.kind} needs a steered vessel, which kind {kind} is not")
        if heading.kind == "aided" and scenario.gnss.velocity_std is None:
            raise InputError("estimator.heading.kind aided needs the receiver's velocity, expected gnss.velocity_std")
        if heading.kind != "aided" and scenario.compass is None:
            raise InputError(f"estimator.heading.kind {heading.kind} needs a compass, expected a table [compass]")
        if kind == "caldas":
            raise InputError(
                f"estimator.heading.kind {heading.kind} predicts a stable response, "
                "expected tracker for vessel.kind caldas, which is unstable in yaw"
            )
    measured = scenario.gnss.velocity_std is not None or scenario.log is not None or scenario.bottom_log is not None
    if speed.kind == "fusion" and not measured:
        raise InputError(
            "estimator.speed.kind fusion needs a measured speed, "
            "expected gnss.velocity_std or a table [log] or [bottom_log]"
        )
    if scenario.speed.controller != "pi" and assembly.boat(scenario).speed is None:
        raise InputError(f"speed.controller has no effect on a vessel of kind {kind}, which has no speed control")
    if scenario.tachometer is not None and math.isnan(assembly.boat(scenario).full_shaft):
        raise InputError(f"tachometer has no effect on a vessel of kind {kind}, whose model has no single shaft")


def _instruments(scenario: Scenario) -> None:
    if scenario.estimator.kind == "truth":
        return
    instruments = scenario.instruments()
    for name, table in INSTRUMENTS.items():
        if table.measures in scenario.estimator.aid and name not in instruments:
            raise InputError(f"estimator.aid names {table.measures}, expected a table [{name}]")
    if any(table.measures == "heading" for table in instruments.values()):
        return
    if scenario.estimator.kind == "steering":
        return
    if scenario.guidance.angle == "heading":
        raise InputError(f"guidance.law {scenario.guidance.law} commands a heading, expected a table [compass]")
    if scenario.route.at_end == "hold":
        raise InputError('route.at_end is "hold", expected a table [compass]: at rest only a compass measures heading')
    for index, each in enumerate(scenario.route.points):
        if each.stay > 0.0:
            raise InputError(
                f"route.waypoints[{index}].stay is {each.stay:g} s, "
                "expected a table [compass]: at rest only a compass measures heading"
            )


def _propulsion(scenario: Scenario) -> None:
    holds = scenario.route.at_end == "hold" or any(each.stay > 0.0 for each in scenario.route.points)
    by_current = scenario.estimator.kind == "steering" and assembly.boat(scenario).speed is not None
    if holds and not by_current and scenario.vessel.boat().station is None:
        able = ", ".join(kind_of(each) for each in TABLES if each().boat().station is not None)
        raise InputError(
            f"route needs station keeping, which a vessel of kind {scenario.vessel.kind} cannot do, "
            f"expected one of {able}"
        )
