"""Vessel, environment, instruments and pilot of a scenario. Raises InputError for what cannot be built."""

import math
from dataclasses import replace
from datetime import datetime
from typing import NamedTuple

from steerway.control.boats import Boat
from steerway.control.handover import Steerageway
from steerway.control.heading_plant import HeadingResponse
from steerway.core.errors import InputError
from steerway.core.estimate import Estimator
from steerway.core.reference import SHAPERS
from steerway.core.settings import kind_of
from steerway.core.slow_error import USUAL_STD
from steerway.estimation.aboard import AtFaceValue, ComposedEstimator, FilterEstimator
from steerway.estimation.heading.aboard import HeadingAboard, model_of
from steerway.estimation.speed import SurgeFusion, SurgeTuning
from steerway.estimation.steering import SteeringEstimator, SteeringFilter
from steerway.estimation.stream import FiveStateFilter
from steerway.estimation.vessel.profile import Profile, profile_of
from steerway.guidance.line_of_sight import GuidanceLaw
from steerway.guidance.ordered import Order, Ordered, orders_of
from steerway.guidance.route import Route
from steerway.guidance.route_table import route_of
from steerway.guidance.voyage import Voyage
from steerway.guidance.waypoints import Passing
from steerway.pilot import ANGLE_STD, DEFAULT_KINDS, LegSource, Pilot, SteadyForce, build_pilot, response_of
from steerway.sensors.suite import Suite, Truth
from steerway.simulation.loop import Start
from steerway.simulation.manoeuvres import ManoeuvringPilot, manoeuvre_of
from steerway.simulation.positioning import PositioningEstimator, PositioningPilot
from steerway.simulation.scenario import Scenario
from steerway.vessels.environment import Environment
from steerway.vessels.kinds import TABLES
from steerway.vessels.vessel import Vessel

STEERAGEWAY = Steerageway()


class Assembly(NamedTuple):
    """The arguments of `loop.sail`. Vessel, instruments and environment hold no state; a pilot serves one run."""

    vessel: Vessel
    pilot: Pilot | PositioningPilot | ManoeuvringPilot
    instruments: Suite | Truth
    start: Start
    environment: Environment

    @property
    def mission(self) -> Ordered | Voyage:
        """The orders or the voyage of the pilot."""
        mission = self.pilot.mission
        if not isinstance(mission, Ordered | Voyage):
            raise TypeError(f"a scenario sails a {type(mission).__name__}, expected orders or a voyage")
        return mission


def assemble(scenario: Scenario) -> Assembly:
    """Fresh blocks for one run."""
    return Assembly(
        scenario.vessel.build(), pilot(scenario), instruments(scenario), start(scenario), scenario.environment
    )


def boat(scenario: Scenario) -> Boat:
    """Parameters of the vessel for its controllers, with the scenario's changes."""
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
    """The receiver with the further instruments, or instruments without errors."""
    if scenario.estimator.kind == "truth" or scenario.manoeuvre is not None:
        return Truth()
    return Suite(scenario.gnss, **{name: table.build() for name, table in scenario.instruments().items()})


def profile(scenario: Scenario) -> Profile:
    """The filter's profile; by default the boat's profile with the errors of the simulated receiver."""
    if scenario.estimator.profile:
        return profile_of(scenario.estimator.profile)
    return Profile.named(boat(scenario).profile).model_copy(update=scenario.gnss.noise)


def holds_places(scenario: Scenario) -> bool:
    """Whether orders contain positions: dynamic positioning."""
    return any(each.north is not None or each.east is not None for each in scenario.orders)


def positioning_pilot(scenario: Scenario) -> PositioningPilot:
    """A pilot for dynamic positioning in its initial state. Raises InputError for a vessel without thrusters for it."""
    vessel, kind, began = scenario.vessel.positioned(), scenario.estimator.kind, start(scenario)
    if vessel is None:
        able = ", ".join(kind_of(each) for each in TABLES if each().positioned())
        raise InputError(
            f"orders hold a position, which a vessel of kind {scenario.vessel.kind} cannot, expected one of {able}"
        )
    estimator: Estimator = AtFaceValue()
    if kind != "truth":
        observer = scenario.estimator.positioning.observer(kind, vessel, 1.0 / scenario.gnss.rate)
        estimator = PositioningEstimator(observer, began.north, began.east, began.heading)
    return PositioningPilot(
        estimator, Ordered(orders(scenario)), scenario.positioning.controller(vessel), vessel.thrusters
    )


def pilot(scenario: Scenario) -> Pilot | PositioningPilot | ManoeuvringPilot:
    """A pilot in its initial state."""
    if scenario.manoeuvre is not None:
        has_rudder = [each.name for each in scenario.vessel.build().actuators] == ["rudder"]
        manoeuvre = manoeuvre_of(scenario.manoeuvre)
        return ManoeuvringPilot(manoeuvre, boat(scenario), has_rudder, start(scenario).heading)
    if holds_places(scenario):
        return positioning_pilot(scenario)
    known, guidance = boat(scenario), scenario.guidance
    law = guidance.design(known.lookahead, known.cruise)
    mission = Ordered(orders(scenario), known.cruise) if scenario.orders else voyage(scenario, known)
    kinds = scenario.autopilot.kind, scenario.speed.controller
    if scenario.estimator.kind == "steering":
        std = profile(scenario).position_std
        stds, radius = (std, scenario.gnss.slow_std), scenario.station.radius
        return steering_pilot(known, mission, law, stds, radius=radius, kinds=kinds, steer_by=guidance.angle)
    truth, shaper = scenario.estimator.kind == "truth", SHAPERS[scenario.reference.kind or scenario.vessel.reference]
    crabs = scenario.estimator.heading.kind == "aided" and guidance.angle == "course"
    return build_pilot(
        known,
        mission,
        law,
        AtFaceValue() if truth else composed(scenario, known),
        kinds=kinds,
        shaper=shaper(scenario.reference, known.bandwidth),
        steerageway=STEERAGEWAY,
        angle_std=0.0 if truth else ANGLE_STD,
        steer_by="crab" if crabs else guidance.angle,
        speed=None if scenario.speed.force is None else SteadyForce(scenario.speed.force),
    )


def composed(scenario: Scenario, known: Boat) -> Estimator:
    """The filter of the motion over ground, combined with filters of heading and speed if the scenario selects them."""
    filtering = FiveStateFilter(profile(scenario), scenario.estimator.aid)
    ground = FilterEstimator(filtering, slow_std=scenario.gnss.slow_std)
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
            speed_time=known.speed_time,
            slew=known.yaw_slew,
        )
    if speeds.kind == "fusion":
        speed = SurgeFusion(SurgeTuning(**speeds.model_dump(exclude={"kind"})))
    return ground if heading is None and speed is None else ComposedEstimator(ground, heading, speed)


def steering_pilot(
    known: Boat,
    mission: LegSource,
    law: GuidanceLaw,
    position_stds: tuple[float, float] = (0.3, USUAL_STD),
    *,
    radius: float = 5.0,
    learn: bool = True,
    kinds: tuple[str, str] = DEFAULT_KINDS,
    steer_by: str = "course",
) -> Pilot:
    """A pilot that steers by the estimated current; its estimator receives the orders.

    position_stds: 1σ (m) of a fix's white noise and of the receiver's slow error; learn: whether to learn the white
    noise, starting from the given one; radius: of position holding, m; kinds: of the autopilot and of the speed
    controller; steer_by: see `Pilot`.
    """
    position_std, slow_std = position_stds
    filtering = SteeringFilter(response_of(known), position_std, learn=learn)
    estimator = SteeringEstimator(filtering, known.yaw_response.gain, slow_std)
    return build_pilot(known, mission, law, estimator, kinds=kinds, radius=radius, steer_by=steer_by)


def route(scenario: Scenario, known: Boat) -> Route:
    """The waypoints with their radii of acceptance and speeds."""
    return route_of(scenario.route, places(scenario), scenario.route.points, known)


def stays(scenario: Scenario) -> list[float]:
    """Duration at each waypoint, s."""
    return [each.stay for each in scenario.route.points]


def voyage(scenario: Scenario, known: Boat) -> Voyage:
    """The route with its stays, as a mission."""
    table = scenario.route
    return Voyage(route(scenario, known), stays(scenario), Passing(rule=table.passing), at_end=table.at_end)


def orders(scenario: Scenario) -> tuple[Order, ...]:
    """The orders, () with a route. Before the first order the boat keeps its initial heading and position."""
    began = start(scenario)
    return orders_of(scenario.orders, Order(0.0, began.heading, math.nan, began.north, began.east))


def places(scenario: Scenario) -> list[tuple[float, float]]:
    """North and east (m) of the waypoints, from metres or from latitude and longitude."""
    origin = scenario.origin.place
    return [each.plane(origin, f"route.waypoints[{index}]") for index, each in enumerate(scenario.route.points)]


def begins(scenario: Scenario) -> float:
    """Unix time of the scenario's beginning."""
    try:
        time = datetime.fromisoformat(scenario.begins)
    except ValueError:
        raise InputError(f"begins is {scenario.begins!r}, expected ISO 8601 such as 2026-06-01T12:00:00Z") from None
    if time.tzinfo is None:
        raise InputError(f"begins is {scenario.begins!r}, expected a time with a zone, such as 2026-06-01T12:00:00Z")
    return time.timestamp()
