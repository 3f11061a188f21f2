"""What a scenario may not ask for: combinations that no boat can sail, and keys that mean nothing to this one."""

import math

from steerway.core.errors import InputError
from steerway.guidance.route import LONGEST_LEG
from steerway.simulation import assembly
from steerway.simulation.scenario import Scenario

MOST_STEPS = 20_000_000

_OF_VESSEL = {
    "otter": ("payload_mass", "payload_position", "edition", "propeller_lag"),
    "mariner": ("cruise_speed",),
    "nomoto": ("gain", "time_constant", "speed", "rudder_limit_deg"),
}


def check(scenario: Scenario) -> None:
    """Raise InputError, one sentence with the key's path, for the first that is found; then build every block once,
    since each checks its own."""
    assembly.begins(scenario)
    for rule in (_vessel_keys, _steps, _rates, _places, _speeds, _compass, _propulsion):
        rule(scenario)
    assembly.assemble(scenario)


def _vessel_keys(scenario):
    kind = scenario.vessel.kind
    allowed = ("kind", "method", *_OF_VESSEL[kind])
    for key in scenario.vessel.model_fields_set:
        if key not in allowed:
            raise InputError(
                f"vessel.{key} means nothing to a vessel of kind {kind}, expected one of {', '.join(allowed)}"
            )
    if kind == "nomoto" and scenario.vessel.gain == 0.0:
        raise InputError("vessel.gain is 0, expected a number other than 0")


def _steps(scenario):
    steps = scenario.duration / scenario.step
    if steps > MOST_STEPS:
        raise InputError(
            f"duration of {scenario.duration:g} s in steps of {scenario.step:g} s is {steps:.2g} steps, "
            f"expected at most {MOST_STEPS:.0e}"
        )


def _rates(scenario):
    fastest = 1.0 / scenario.step
    for name in ("gnss", "compass", "gyro", "log"):
        table = getattr(scenario, name)
        if table is not None and table.rate > fastest * 1.001 and (name == "gnss" or "rate" in table.model_fields_set):
            raise InputError(f"{name}.rate is {table.rate:g} Hz, expected at most the {fastest:g} Hz of the steps")
    for index, fault in enumerate(scenario.gnss.faults):
        if (fault.start is None) == (fault.per_hour is None):
            raise InputError(f"gnss.faults[{index}] of kind {fault.kind} needs one of start and per_hour, expected one")


def _places(scenario):
    origin = (scenario.origin.latitude_deg, scenario.origin.longitude_deg)
    for index in range(len(scenario.route.waypoints)):
        north, east = assembly.place_of(scenario, index)
        if math.hypot(north, east) > LONGEST_LEG:
            raise InputError(
                f"route.waypoints[{index}] is {math.hypot(north, east) / 1e3:.0f} km from the origin at "
                f"{origin[0]:g}°, {origin[1]:g}°, expected at most {LONGEST_LEG / 1e3:.0f} km (metres, degrees?)"
            )


def _speeds(scenario):
    her = assembly.boat(scenario)
    asked = {"speed.cruise": her.cruise} if scenario.vessel.kind == "otter" else {}
    if scenario.vessel.kind != "otter":
        for key in ("cruise", "bandwidth"):
            if key in scenario.speed.model_fields_set:
                raise InputError(
                    f"speed.{key} means nothing to a vessel of kind {scenario.vessel.kind}, whose speed is her own"
                )
    waypoints = scenario.route.waypoints
    speeds = {f"route.waypoints[{k}].speed": each.speed for k, each in enumerate(waypoints) if each.speed is not None}
    if all(each.speed is not None for each in waypoints[1:]):
        asked = {}
    least = assembly.STEERAGEWAY.take if assembly.steer_by(scenario) == "course" else 0.0
    for place, speed in (asked | speeds).items():
        if speed <= least:
            why = (
                f"expected more than {least:g} m/s: below steerageway a course cannot be steered"
                if least
                else "expected more than 0"
            )
            raise InputError(f"{place} is {speed:g} m/s, {why}")
        if speed > her.top_speed:
            raise InputError(f"{place} is {speed:g} m/s, expected at most the vessel's {her.top_speed:g} m/s")


def _compass(scenario):
    if scenario.estimator.kind == "truth":
        return
    for aid, table in (("heading", scenario.compass), ("yaw_rate", scenario.gyro), ("water_speed", scenario.log)):
        if aid in scenario.estimator.aid and table is None:
            raise InputError(f"estimator.aid names {aid}, expected its instrument too")
    if scenario.compass is not None:
        return
    by = assembly.steer_by(scenario)
    if by == "heading":
        raise InputError(f"guidance.law {scenario.guidance.law} steers by heading, expected a table [compass]")
    if scenario.route.at_end == "hold":
        raise InputError('route.at_end is "hold", expected a table [compass] too: at rest only it tells the heading')
    for index, each in enumerate(scenario.route.waypoints):
        if each.stay > 0.0:
            raise InputError(
                f"route.waypoints[{index}].stay is {each.stay:g} s, "
                "expected a table [compass] too: at rest only it tells the heading"
            )


def _propulsion(scenario):
    if scenario.vessel.kind == "otter":
        return
    holds = scenario.route.at_end == "hold" or any(each.stay > 0.0 for each in scenario.route.waypoints)
    if holds:
        raise InputError(
            f"route keeps station with a vessel of kind {scenario.vessel.kind}, "
            "expected an otter: the others have no propellers to hold with"
        )
