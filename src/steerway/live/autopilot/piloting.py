"""The pilot of a mission aboard: the blocks of simulation, with gains from the mission's `[boat]` table.

The course law is one whatever carries it out. Its output is a yaw rate: what the boat settles at in the Nomoto model
T ω̇ + ω = u. A vehicle with a yaw-rate loop of its own is commanded that rate; two propellers get the share of their
full moment that gives it. Gains follow what the course estimate carries (`control.bandwidth.GainSchedule`).
"""

import math

import numpy as np

from steerway.control.allocation import TwoPropellers
from steerway.control.bandwidth import GainSchedule
from steerway.control.course import AnglePID
from steerway.control.handover import Autopilot, HandOver, Steerageway
from steerway.control.heading_plant import HeadingResponse
from steerway.control.heading_steering import steering
from steerway.control.holding import PositionHold
from steerway.control.in_current import InCurrent, YawResponse
from steerway.control.speed_force import ForceLoop
from steerway.control.speed_force import speed_loop as control_speed
from steerway.control.speed_pi import SpeedPI, SpeedPIGains
from steerway.core.checks import one_of
from steerway.core.earth import displacement
from steerway.estimation.profiles import Profile
from steerway.estimation.profiles.inferred import InferredProfile
from steerway.estimation.steering import Response
from steerway.estimation.tables import HeadingEstimatorTable
from steerway.guidance import laws
from steerway.guidance.reference import ReferenceModel
from steerway.guidance.route import Route
from steerway.guidance.waypoints import Mission, Passing
from steerway.live.autopilot.aboard import Aboard
from steerway.live.autopilot.headings import MeasuredHeading
from steerway.live.autopilot.mission import BoatTable, GeodeticRoute
from steerway.pilot import Pilot

YAW_RATE, PROPELLERS = ACTUATIONS = ("yaw-rate", "propellers")
"""What takes the commands: a vehicle with a yaw-rate loop, or two propellers side by side."""
MAX_BANDWIDTH = 0.5
"""rad/s of the course loop, however good the estimate."""
DEFAULT_KINDS = "pole-placement", "pi"
"""Of the autopilot and of the speed controller."""
_SAMPLE = 0.2
"""s between two steps of a predictive or LQG autopilot."""
_STEERED_BANDWIDTH = 1.2
"""rad/s of its loop."""
_COURSE_STD = math.radians(1.0)
"""1σ of an estimated course, as it takes it."""
SPEED_BANDWIDTH = 0.3
"""rad/s of the speed loop: what the estimate of the speed carries, roughly."""
SLOWEST = 0.6
"""Share of the route's speed that is kept through the water in a following current."""
ACCELERATION = {YAW_RATE: 0.5, PROPELLERS: 0.15}
"""m/s² at which another speed is approached: the speed loop of a vehicle, and that of this autopilot. Chosen."""
_CORNER = 1.5
"""Radius of a corner's curve over that of the tightest turn."""
_TIME_STD = 0.5
"""1σ of `rate_time`, as a share: vehicles' own loops answer in 0.1 to 1.3 s. Chosen."""
_INTEGRAL = 0.1
"""1/s at which the integral of such a loop adds what is missing of an ordered yaw rate. Chosen: of a motorboat by
ArduPilot's Rover it is 0.1 to 0.26 1/s, and many loops have none. With 0.2 boats without one are lost in a current.
"""
_WANDER = 0.1
"""Yaw rate of a hull beside its first-order response to propellers, 1σ as a share of the largest. Chosen: sideslip,
propellers in a turn and a damping that changes with the speed are not declared; of the Otter's estimated course 95 %
are within 2σ (with 0.02, 70 %).
"""
_SLIP = 0.2
"""Share of its speed that a vehicle loses in its tightest turn before its own loop makes it up. Chosen: an Otter loses
0.3 at 15°/s."""
_TURN_TIME = 1.0
"""s in which the reference reaches its largest yaw rate."""
_TURN_SHARE = 0.8
"""Share of the largest yaw rate at which turns are made; the rest is left to the controller."""
_GIVE_UP = 0.9
"""Share of the profile's steerageway below which the course is no longer steered by."""


class BoatActuation:
    """Commands of a boat known by its `[boat]` table: yaw rate (rad/s), thrust, port and starboard propeller.

    Thrust is a fraction of full thrust, propeller commands are of full speed: T = n|n|. `takes`, one of `ACTUATIONS`,
    says whose limits count.
    """

    def __init__(self, boat: BoatTable, takes: str = YAW_RATE):
        self._takes = one_of("actuation", takes, ACTUATIONS)
        self._max_rate = math.radians(boat.max_yaw_rate_dps)
        self._full_rate = math.radians(boat.full_yaw_rate_dps)
        self._propellers = TwoPropellers(0.5, 1.0, 1.0, 1.0, -1.0 if boat.reverse else 0.0)

    def step(self, surge_force: float, yaw: float) -> tuple[float, ...]:
        """(yaw rate, thrust, port, starboard, achieved force, achieved yaw rate) for a force and a yaw rate."""
        rate = max(-self._max_rate, min(self._max_rate, yaw))
        driven = self._propellers.step(2.0 * surge_force, yaw / self._full_rate)
        achieved = surge_force, rate
        if self._takes == PROPELLERS:
            achieved = 0.5 * driven.surge_force, driven.yaw_moment * self._full_rate
        return rate, surge_force, driven.port, driven.starboard, *achieved


def pilot_of(
    line: GeodeticRoute,
    profile: Profile | InferredProfile | str = "small-usv",
    takes: str = YAW_RATE,
    max_dead_reckoning: float = 10.0,
    kinds: tuple[str, str] = DEFAULT_KINDS,
    heading: HeadingEstimatorTable = HeadingEstimatorTable(),  # noqa: B008
) -> Pilot:
    """The pilot of a route; its estimator takes rows.

    profile: of the course estimator, which limits the bandwidth of the loop. takes: one of `ACTUATIONS`. kinds: one of
    `control.heading_steering.KINDS` and one of `control.speed_force.CONTROLLERS`. heading: of the filter that takes
    the compass's place, "tracker" for none.
    Raises InputError for a route that cannot be sailed.
    """
    profile = Profile.named(profile) if isinstance(profile, str) else profile
    origin = float(line.latitude[0]), float(line.longitude[0])
    places = [displacement(*place, *origin) for place in zip(line.latitude, line.longitude, strict=True)]
    north, east = np.array(places).T
    radius = line.corner_radius
    if radius is None:
        radius = _CORNER * float(np.mean(line.speed)) / math.radians(line.boat.max_yaw_rate_dps)
    route = Route(north, east, acceptance=line.acceptance, speed=line.speed, corners=line.corners, corner_radius=radius)
    steering = in_current(line, takes)
    return Pilot(
        Aboard(origin, response_of(line, takes), profile.position_std, measured_heading(line, takes, heading)),
        Mission(route, Passing(time_factor=None)),
        laws.law(line.law, line.lookahead, float(np.mean(line.speed))),
        autopilot(line.boat, profile, takes, kinds[0]),
        BoatActuation(line.boat, takes),
        speed_loop(line.boat, takes, kinds[1]),
        PositionHold(line.hold_radius, steering.slowest),
        in_current=steering,
        max_dead_reckoning=max_dead_reckoning,
    )


def measured_heading(line: GeodeticRoute, takes: str, table: HeadingEstimatorTable) -> MeasuredHeading | None:
    """The filter that takes the compass's place; None for the compass itself."""
    if table.kind == "tracker":
        return None
    boat, response = line.boat, yaw_response(line.boat, takes)
    return MeasuredHeading(
        table, response.time, math.radians(boat.max_yaw_rate_dps), float(np.mean(line.speed)), boat.surge_time
    )


def yaw_response(boat: BoatTable, takes: str) -> YawResponse:
    """The response to the ordered yaw rate, of a vehicle's own loop or of the hull to its propellers."""
    if takes == YAW_RATE:
        return YawResponse(1.0, boat.rate_time)
    return YawResponse(1.0, boat.yaw_time, 1.0, boat.yaw_munk, boat.yaw_quadratic)


def response_of(line: GeodeticRoute, takes: str) -> Response:
    """What the steering filter knows of the boat."""
    boat = line.boat
    _, time, *damping = yaw_response(boat, takes)
    rate, cruise = math.radians(boat.max_yaw_rate_dps), float(np.mean(line.speed))
    response = Response(time, rate, cruise, boat.top_speed_mps, *damping, speed_time=boat.surge_time)
    if takes == PROPELLERS:
        return response._replace(wander=_WANDER)
    # One number of the damping, the time constant and the gain is free.
    return response._replace(over_ground=True, time_std=_TIME_STD, damping_std=0.0, slip=_SLIP, integral=_INTEGRAL)


def in_current(line: GeodeticRoute, takes: str) -> InCurrent:
    """What steering in a current knows of the boat."""
    boat, cruise = line.boat, float(np.mean(line.speed))
    response = yaw_response(boat, takes)
    fastest = max(cruise, min(boat.top_speed_mps, response.stable_speed))
    rate = _TURN_SHARE * math.radians(boat.max_yaw_rate_dps)
    over_ground = takes == YAW_RATE
    return InCurrent(
        response, fastest, SLOWEST * cruise, rate, MAX_BANDWIDTH, over_ground=over_ground, speed_time=boat.surge_time
    )


def autopilot(
    boat: BoatTable, profile: Profile | InferredProfile, takes: str = YAW_RATE, kind: str = DEFAULT_KINDS[0]
) -> Autopilot:
    """The course autopilot of a boat, its gains limited by what the profile's estimate carries."""
    most = math.radians(boat.max_yaw_rate_dps)
    nomoto_time = boat.yaw_time if takes == PROPELLERS else None
    schedule = GainSchedule(nomoto_time, profile.agility, profile.position_std, MAX_BANDWIDTH)
    least = profile.steerageway
    shaper = ReferenceModel(1.0, max_rate=most, max_acceleration=most / _TURN_TIME)
    hand_over = HandOver(Steerageway(take=least, give=_GIVE_UP * least, dwell=0.0))
    if kind != DEFAULT_KINDS[0]:
        response = HeadingResponse.of_nomoto(1.0, max(yaw_response(boat, takes).time, _SAMPLE), _SAMPLE)
        controller = steering(kind, response, most, angle_std=_COURSE_STD, bandwidth=_STEERED_BANDWIDTH)
        return Autopilot(controller, shaper, hand_over)
    return Autopilot(AnglePID(schedule.gains(math.nan)), shaper, hand_over, schedule)


def speed_loop(boat: BoatTable, takes: str, controller: str = DEFAULT_KINDS[1]) -> SpeedPI | ForceLoop:
    """The speed loop of a boat; its output is a fraction of full thrust."""
    gains = SpeedPIGains(
        mass=boat.surge_time / boat.top_speed_mps,
        linear_drag=1.0 / boat.top_speed_mps,
        bandwidth=SPEED_BANDWIDTH,
        limit=1.0,
        limit_astern=1.0 if boat.reverse else 0.0,
        acceleration=ACCELERATION[takes],
    )
    return control_speed(controller, gains)
