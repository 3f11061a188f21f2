"""From a scenario to the blocks: vessel, environment, instruments, pilot. What cannot be built is refused here."""

import math
from dataclasses import replace
from datetime import datetime
from typing import NamedTuple

import numpy as np

from steerway.control.boats import Boat
from steerway.control.handover import Steerageway
from steerway.control.heading_plant import HeadingResponse
from steerway.core.earth import displacement
from steerway.core.errors import InputError
from steerway.core.estimate import Estimator
from steerway.estimation.aboard import AtFaceValue, ComposedEstimator, FilterEstimator
from steerway.estimation.heading.aboard import HeadingAboard, model_of
from steerway.estimation.profiles import Profile
from steerway.estimation.profiles.inferred import InferredProfile, profile_of
from steerway.estimation.speed import SurgeFusion, SurgeTuning
from steerway.estimation.steering import Response, SteeringEstimator, SteeringFilter
from steerway.estimation.stream import FiveStateFilter
from steerway.guidance.line_of_sight import GuidanceLaw
from steerway.guidance.route import Route
from steerway.guidance.shapers import SHAPERS
from steerway.guidance.voyage import Voyage
from steerway.guidance.waypoints import Passing
from steerway.pilot import LegSource, Pilot
from steerway.sensors.suite import Suite, Truth
from steerway.simulation.loop import Start
from steerway.simulation.scenario import Scenario
from steerway.vessels.environment import Environment
from steerway.vessels.vessel import Vessel

STEERAGEWAY = Steerageway()
ANGLE_STD = math.radians(1.0)
"""1σ of an estimated course or heading, as predictive and LQG autopilots take it."""


CORNER = 1.5
"""Radius of a corner's curve over that of the tightest turn."""


class Assembly(NamedTuple):
    """The arguments of `loop.sail`. Vessel, instruments and environment hold no state; a pilot serves one run."""

    vessel: Vessel
    pilot: Pilot
    instruments: Suite | Truth
    start: Start
    environment: Environment


def assemble(scenario: Scenario) -> Assembly:
    """Fresh blocks for one run."""
    vessel, environment = scenario.vessel.build(), scenario.environment.build()
    return Assembly(vessel, pilot(scenario), instruments(scenario), start(scenario), environment)


def boat(scenario: Scenario) -> Boat:
    """What the controllers use of the vessel, with what the scenario changes of it."""
    steered = scenario.estimator.kind == "steering"
    known = scenario.vessel.boat_in_current() if steered else scenario.vessel.boat()
    numbers = scenario.autopilot.model_dump(exclude={"kind"})
    changes = {name: value for name, value in numbers.items() if value is not None}
    if scenario.guidance.lookahead is not None:
        changes["lookahead"] = scenario.guidance.lookahead
    if scenario.route.acceptance is not None:
        changes["acceptance"] = scenario.route.acceptance
    if known.speed is not None:
        if scenario.speed.bandwidth is not None:
            changes["speed"] = replace(known.speed, bandwidth=scenario.speed.bandwidth)
        if scenario.speed.cruise is not None:
            changes["cruise"] = scenario.speed.cruise
    if known.station is not None:
        changes["station"] = replace(known.station, **scenario.station.model_dump())
    return known.but(**changes)


def start(scenario: Scenario) -> Start:
    """The initial position, heading and speed."""
    table = scenario.start
    return Start(table.north, table.east, math.radians(table.heading_deg), table.speed)


def instruments(scenario: Scenario) -> Suite | Truth:
    """The receiver with the further instruments, or the truth."""
    if scenario.estimator.kind == "truth":
        return Truth()
    return Suite(scenario.gnss.build(), **{name: table.build() for name, table in scenario.instruments().items()})


def profile(scenario: Scenario) -> Profile | InferredProfile:
    """The filter's tuning."""
    return profile_of(scenario.estimator.profile or boat(scenario).profile)


def pilot(scenario: Scenario) -> Pilot:
    """A pilot in its initial state."""
    known, guidance = boat(scenario), scenario.guidance
    if scenario.estimator.kind == "steering":
        law = scenario.guidance.design(known.lookahead, known.cruise)
        std = profile(scenario).position_std
        kinds = scenario.autopilot.kind, scenario.speed.controller
        return steering_pilot(known, voyage(scenario, known), law, std, radius=scenario.station.radius, kinds=kinds)
    truth = scenario.estimator.kind == "truth"
    shaper = SHAPERS[scenario.reference.kind or scenario.vessel.reference]
    estimator = AtFaceValue() if truth else composed(scenario, known, ground_estimator(scenario))
    angle_std = 0.0 if truth else ANGLE_STD
    return Pilot(
        estimator,
        voyage(scenario, known),
        guidance.design(known.lookahead, known.cruise),
        known.autopilot(shaper(scenario.reference), STEERAGEWAY, scenario.autopilot.kind, angle_std),
        known.propulsion,
        known.speed_loop(scenario.speed.controller),
        known.station_keeper(),
        cruise=known.cruise,
        steer_by="crab"
        if scenario.estimator.heading.kind == "aided" and guidance.angle == "course"
        else guidance.angle,
    )


def ground_estimator(scenario: Scenario) -> FilterEstimator:
    """The filter of the motion over ground, by a profile of either kind."""
    return FilterEstimator(FiveStateFilter(profile(scenario), scenario.estimator.aid))


def composed(scenario: Scenario, known: Boat, ground: Estimator) -> Estimator:
    """The estimator with heading and speed by filters of their own, where the scenario asks for them."""
    table, speeds = scenario.estimator.heading, scenario.estimator.speed
    heading = speed = None
    if table.kind != "tracker":
        response = known.response or HeadingResponse.of_nomoto(known.nomoto_gain, known.nomoto_time)
        yaw = model_of(response.poles, response.gains, response.sample, known.yaw_limit)
        stds = math.radians(table.compass_std_deg), math.radians(table.deviation_std_deg)
        heading = HeadingAboard(
            table.kind,
            yaw,
            known.yaw_limit,
            known.cruise,
            *stds,
            weight=table.weight,
            speed_time=speed_time(known),
            slew=known.yaw_slew,
        )
    if speeds.kind == "fusion":
        speed = SurgeFusion(SurgeTuning(**speeds.model_dump(exclude={"kind"})))
    return ground if heading is None and speed is None else ComposedEstimator(ground, heading, speed)


def steering_pilot(
    known: Boat,
    mission: LegSource,
    law: GuidanceLaw,
    position_std: float = 0.3,
    *,
    radius: float = 5.0,
    learn: bool = True,
    follows_orders: bool = True,
    kinds: tuple[str, str] = ("pole-placement", "pi"),
) -> Pilot:
    """A pilot that steers by the estimated current, its estimator knowing what is ordered.

    position_std (m) of a fix is where learning the receiver's noise begins; radius (m) in which a position is held;
    `learn` and `follows_orders` False take
    that away, and the knowledge of the orders, to see what they are worth; kinds of the autopilot and of the speed
    controller.
    """
    filtering = SteeringFilter(response_of(known), position_std, learn=learn)
    return Pilot(
        SteeringEstimator(filtering, known.yaw_response.gain, follows_orders),
        mission,
        law,
        known.autopilot_in_current(kinds[0], ANGLE_STD),
        known.propulsion,
        known.speed_loop(kinds[1]),
        known.position_hold(radius),
        cruise=known.cruise,
        in_current=known.in_current(),
    )


def response_of(known: Boat) -> Response:
    """What the steering filter knows of a boat."""
    _, time, *damping = known.yaw_response
    speeds, slowly = (known.cruise, known.top_speed), min(speed_time(known), 60.0)
    made = Response(time, known.turn_rate, *speeds, *damping, speed_time=slowly, pivot=known.pivot)
    doubt = {name: known.yaw_doubt * getattr(made, name) for name in ("gain_std", "damping_std", "bias_std")}
    return made._replace(wander=max(made.wander, known.yaw_wander / known.turn_rate), **doubt)


def speed_time(known: Boat) -> float:
    """s in which the speed of a boat follows an ordered one; infinite where none can be ordered."""
    return math.inf if known.speed is None else known.speed.mass / max(known.speed.linear_drag, 1e-9)


def voyage(scenario: Scenario, known: Boat) -> Voyage:
    """The route with its stays."""
    table = scenario.route
    places = [place_of(scenario, index) for index in range(len(table.points))]
    route = Route(
        np.array([north for north, _ in places]),
        np.array([east for _, east in places]),
        np.array([math.nan if each.acceptance is None else each.acceptance for each in table.points]),
        np.array([math.nan if each.speed is None else each.speed for each in table.points]),
        known.acceptance,
        table.corners,
        CORNER * known.cruise / known.turn_rate if table.corner_radius is None else table.corner_radius,
    )
    stays = [each.stay for each in table.points]
    return Voyage(route, stays, Passing(rule=table.passing), at_end=table.at_end)


def place_of(scenario: Scenario, index: int) -> tuple[float, float]:
    """North and east (m) of a waypoint, however it is given."""
    waypoint, place = scenario.route.points[index], f"route.waypoints[{index}]"
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
