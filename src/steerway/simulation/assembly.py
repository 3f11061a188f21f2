"""From a scenario to the blocks: vessel, sea, instruments, pilot. What cannot be built is refused here."""

import math
from datetime import datetime
from typing import NamedTuple

import numpy as np

from steerway.control import boats
from steerway.control.boats import Boat
from steerway.control.handover import Steerageway
from steerway.control.rudder import Rudder
from steerway.core.earth import displacement
from steerway.core.errors import InputError
from steerway.estimation.course.filter import FiveStateFilter
from steerway.estimation.course.onboard import AtFaceValue, FilterEstimator
from steerway.estimation.profiles import Profile
from steerway.guidance import laws
from steerway.guidance.reference import LowPass, ReferenceModel, TrackingFilter
from steerway.guidance.route import Route
from steerway.guidance.voyage import Voyage
from steerway.guidance.waypoints import Passing
from steerway.pilot import Pilot
from steerway.sensors.compass import Compass
from steerway.sensors.doppler import DopplerLog
from steerway.sensors.faults import Fault
from steerway.sensors.gnss import Gnss
from steerway.sensors.inertial import gyro
from steerway.sensors.instrument import Instrument
from steerway.sensors.suite import Suite, Truth
from steerway.simulation.loop import Start
from steerway.simulation.scenario import Scenario
from steerway.vessels import Mariner, Nomoto, Otter
from steerway.vessels.actuators import Actuator
from steerway.vessels.environment import Current, Environment, Waves, Wind
from steerway.vessels.vessel import Vessel

STEERAGEWAY = Steerageway()


class Assembly(NamedTuple):
    """Everything `loop.sail` wants. Vessel, instruments and environment hold no state; a pilot sails once."""

    vessel: Vessel
    pilot: Pilot
    instruments: Suite | Truth
    start: Start
    environment: Environment


def assemble(scenario: Scenario) -> Assembly:
    """Fresh blocks for one run."""
    return Assembly(vessel(scenario), pilot(scenario), instruments(scenario), start(scenario), environment(scenario))


def vessel(scenario: Scenario) -> Vessel:
    """Who sails."""
    table = scenario.vessel
    if table.kind == "otter":
        return Otter(table.payload_mass, table.payload_position, table.edition, table.propeller_lag, table.method)
    if table.kind == "mariner":
        return Mariner(table.cruise_speed, table.method)
    limit = math.radians(table.rudder_limit_deg)
    rudder = Actuator("rudder", -limit, limit)
    return Nomoto(table.gain, table.time_constant, table.speed, actuator=rudder, method=table.method)


def boat(scenario: Scenario) -> Boat:
    """What the pilot is told of her, with what the scenario changes of it."""
    kind, table, autopilot = scenario.vessel.kind, scenario.vessel, scenario.autopilot
    if kind == "otter":
        known = boats.OTTER
    elif kind == "mariner":
        known = boats.MARINER.but(cruise=table.cruise_speed)
    else:
        limit = math.radians(table.rudder_limit_deg)
        known = boats.MARINER.but(
            nomoto_gain=table.gain,
            nomoto_time=table.time_constant,
            yaw_limit=limit,
            bandwidth=2.0 / table.time_constant,
            propulsion=Rudder(limit),
            lookahead=5.0 * table.speed * table.time_constant,
            acceptance=table.speed * table.time_constant,
            cruise=table.speed,
            top_speed=table.speed,
            profile="small-usv",
        )
    changes = {name: value for name, value in autopilot.model_dump().items() if value is not None}
    if scenario.guidance.lookahead is not None:
        changes["lookahead"] = scenario.guidance.lookahead
    if scenario.route.acceptance is not None:
        changes["acceptance"] = scenario.route.acceptance
    if known.speed is not None:
        speed, station = scenario.speed, scenario.station
        if speed.bandwidth is not None:
            changes["speed"] = _replaced(known.speed, bandwidth=speed.bandwidth)
        changes["station"] = _replaced(known.station, bandwidth=station.bandwidth, radius=station.radius)
        changes["cruise"] = known.cruise if speed.cruise is None else speed.cruise
    return known.but(**changes)


def _replaced(gains, **changes):
    return type(gains)(**(vars(gains) | changes))


def start(scenario: Scenario) -> Start:
    """Where she begins."""
    table = scenario.start
    own = {"otter": 0.0, "mariner": None, "nomoto": None}[scenario.vessel.kind]
    return Start(table.north, table.east, math.radians(table.heading_deg), own if table.speed is None else table.speed)


def environment(scenario: Scenario) -> Environment:
    """The sea."""
    table = scenario.environment
    return Environment(
        Current(**_radians(table.current)),
        Wind(**_radians(table.wind)),
        Waves(**_radians(table.waves)),
        table.force,
        table.moment,
    )


def _radians(table) -> dict:
    """A table's values by name, the angles in rad and without their ending."""
    values = {}
    for name, value in table.model_dump().items():
        if name.endswith("_deg") and value is not None:
            values[name.removesuffix("_deg")] = math.radians(value)
        else:
            values[name.removesuffix("_deg")] = value
    return values


def instruments(scenario: Scenario) -> Suite | Truth:
    """What looks at the truth."""
    if scenario.estimator.kind == "truth":
        return Truth()
    table, compass, log = scenario.gnss, scenario.compass, scenario.log
    receiver = Gnss(
        rate=table.rate,
        white=table.white,
        markov=table.markov,
        settled=table.settled,
        faults=tuple(Fault(**_radians(each)) for each in table.faults),
        latency=table.latency,
        lever_arm=table.lever_arm,
        velocity_std=table.velocity_std,
    )
    return Suite(
        receiver,
        compass
        and Compass(
            Instrument(rate=compass.rate, white=math.radians(compass.std_deg), bias=math.radians(compass.bias_deg)),
            tuple(map(math.radians, compass.deviation_deg)),
        ),
        scenario.gyro and gyro(**scenario.gyro.model_dump()),
        log and DopplerLog(Instrument(rate=log.rate, white=log.std, bias=log.bias)),
    )


def profile(scenario: Scenario) -> Profile:
    """The filter's tuning."""
    name = scenario.estimator.profile or boat(scenario).profile
    return Profile.load(name) if name.endswith(".toml") else Profile.named(name)


def pilot(scenario: Scenario) -> Pilot:
    """A pilot that has seen nothing yet."""
    her = boat(scenario)
    truth = scenario.estimator.kind == "truth"
    filtering = None if truth else FiveStateFilter(profile(scenario), scenario.estimator.aid)
    return Pilot(
        AtFaceValue() if truth else FilterEstimator(filtering),
        voyage(scenario, her),
        law(scenario, her),
        her.autopilot(shaper(scenario), STEERAGEWAY),
        her.propulsion,
        her.speed_loop(),
        her.station_keeper(),
        cruise=her.cruise,
        steer_by=steer_by(scenario),
    )


def steer_by(scenario: Scenario) -> str:
    """Whether the law gives a course or a heading."""
    guidance = scenario.guidance
    return guidance.steer_by or laws.LAWS[guidance.law].steers_by


def law(scenario: Scenario, her: Boat):
    """The guidance law."""
    table = scenario.guidance
    return laws.law(table.law, her.lookahead, her.cruise, _radians(table))


def shaper(scenario: Scenario):
    """What the command goes through."""
    table = scenario.reference
    kind = table.kind or ("tracking" if scenario.vessel.kind == "otter" else "low-pass")
    if kind == "tracking":
        return TrackingFilter(table.bandwidth or 1.0, table.damping)
    if kind == "model":
        return ReferenceModel(table.bandwidth or 0.5, table.damping, math.radians(table.max_rate_deg))
    return LowPass(table.time_constant)


def voyage(scenario: Scenario, her: Boat) -> Voyage:
    """The route with its stays."""
    table = scenario.route
    places = [place_of(scenario, index) for index in range(len(table.waypoints))]
    route = Route(
        np.array([north for north, _ in places]),
        np.array([east for _, east in places]),
        np.array([math.nan if each.acceptance is None else each.acceptance for each in table.waypoints]),
        np.array([math.nan if each.speed is None else each.speed for each in table.waypoints]),
        her.acceptance,
    )
    stays = [each.stay for each in table.waypoints]
    return Voyage(route, stays, Passing(rule=table.passing), at_end=table.at_end)


def place_of(scenario: Scenario, index: int) -> tuple[float, float]:
    """North and east (m) of a waypoint, however it is given."""
    waypoint, place = scenario.route.waypoints[index], f"route.waypoints[{index}]"
    plane, globe = (waypoint.north, waypoint.east), (waypoint.latitude_deg, waypoint.longitude_deg)
    if None not in plane and globe == (None, None):
        return plane
    if None not in globe and plane == (None, None):
        origin = (scenario.origin.latitude_deg, scenario.origin.longitude_deg)
        return displacement(*map(math.radians, (*globe, *origin)))
    given = [name for name, value in waypoint.model_dump().items() if value is not None and name in _COORDINATES]
    raise InputError(
        f"{place} gives {' and '.join(given) or 'no place'}, "
        "expected north and east in m, or latitude_deg and longitude_deg"
    )


_COORDINATES = ("north", "east", "latitude_deg", "longitude_deg")


def begins(scenario: Scenario) -> float:
    """Unix time of the scenario's beginning."""
    try:
        time = datetime.fromisoformat(scenario.begins)
    except ValueError:
        raise InputError(f"begins is {scenario.begins!r}, expected an ISO 8601 time as 2026-06-01T12:00:00Z") from None
    if time.tzinfo is None:
        raise InputError(f"begins is {scenario.begins!r}, expected a time with its zone, as 2026-06-01T12:00:00Z")
    return time.timestamp()
