"""Builds the pilot of a mission aboard, for the boat of its `[boat]` table, with an estimator that takes rows.

The control law is the same for every actuation. Its output u is the steady yaw rate of the Nomoto model T ω̇ + ω = u.
A vehicle with a yaw-rate loop of its own receives this rate as a command. Two propellers receive the fraction of their
full moment that yields it. The gains follow the bandwidth of the course estimate (`control.bandwidth.GainSchedule`).
"""

import math
from typing import Any

import numpy as np

from steerway.control.allocation import TwoPropellers
from steerway.control.boats import Boat
from steerway.control.course import YawResponse
from steerway.control.handover import Steerageway
from steerway.control.speed_pi import SpeedPIGains
from steerway.core.checks import one_of
from steerway.estimation.estimator_tables import HeadingEstimatorTable
from steerway.estimation.vessel.profile import Profile, profile_of
from steerway.live.autopilot.guide import Guide
from steerway.live.autopilot.limits import UNTOLD
from steerway.live.autopilot.measured import MeasuredHeading
from steerway.live.autopilot.mission import BoatTable, GeodeticRoute
from steerway.live.autopilot.steering_estimate import SteeringEstimate
from steerway.pilot import DEFAULT_KINDS, Observer, Pilot, build_pilot, response_of

YAW_RATE, PROPELLERS = ACTUATIONS = ("yaw-rate", "propellers")
"""Receivers of the commands: a vehicle with a yaw-rate loop, or two propellers side by side."""
MAX_BANDWIDTH = 0.5
"""Largest bandwidth of the course loop, rad/s, however good the estimate."""
_SAMPLE = 0.2
"""Interval between two steps of a predictive or LQG autopilot, s."""
SPEED_BANDWIDTH = 0.3
"""Bandwidth of the speed loop, rad/s: roughly the largest that the speed estimate allows."""
ACCELERATION = {YAW_RATE: 0.5, PROPELLERS: 0.15}
"""Acceleration towards a new speed, m/s²: of a vehicle's own speed loop, and of this autopilot with propellers."""
_WANDER = 0.1
"""1σ of the yaw rate that a first-order response to propellers does not explain, as a fraction of the largest yaw rate.
The mission does not declare the causes: sideslip, propellers in a turn, damping that changes with the speed. Chosen: 95
% of the Otter's estimated courses are within 2σ; with 0.02, 70 %."""
_TURN_TIME = 1.0
"""Time in which the reference reaches its largest yaw rate, s."""
_TURN_SHARE = 0.8
"""Yaw rate of planned turns as a fraction of the largest; the rest is left to the controller."""
_GIVE_UP = 0.9
"""Speed below which steering by course ends, as a fraction of the profile's steerageway."""


class BoatActuation:
    """Commands of a boat known by its `[boat]` table: yaw rate (rad/s), thrust, port and starboard propeller.

    Thrust is a fraction T of full thrust, a propeller command a fraction n of full speed: T = n|n|. `takes`, one of
    `ACTUATIONS`, selects whose limits apply. `max_rate` (rad/s) and `max_thrust` may be set.
    """

    def __init__(self, boat: BoatTable, takes: str = YAW_RATE):
        self._takes = one_of("actuation", takes, ACTUATIONS)
        self.max_rate, self.max_thrust = largest_yaw_rate(boat), 1.0
        self._full_rate = math.radians(boat.full_yaw_rate_dps)
        self._propellers = TwoPropellers(0.5, 1.0, 1.0, 1.0, -1.0 if boat.reverse else 0.0)

    def step(self, surge_force: float, yaw: float) -> tuple[float, ...]:
        """(yaw rate, thrust, port, starboard, achieved force, achieved yaw rate) for a force and a yaw rate."""
        rate, surge_force = max(-self.max_rate, min(self.max_rate, yaw)), min(surge_force, self.max_thrust)
        driven = self._propellers.step(2.0 * surge_force, yaw / self._full_rate)
        achieved = surge_force, rate
        if self._takes == PROPELLERS:
            achieved = 0.5 * driven.surge_force, driven.yaw_moment * self._full_rate
        return rate, surge_force, driven.port, driven.starboard, *achieved


def largest_yaw_rate(boat: BoatTable) -> float:
    """Largest yaw rate (rad/s) to order before the vehicle reports its own limit."""
    return UNTOLD if boat.max_yaw_rate_dps is None else math.radians(boat.max_yaw_rate_dps)


def limit_turns(pilot: Pilot, rate: float) -> None:
    """Limit the ordered yaw rate (rad/s) from now on."""
    actuation: Any = pilot.actuation
    shaper: Any = pilot.autopilot.shaper
    if rate != actuation.max_rate and pilot.in_current is not None:
        actuation.max_rate, shaper.max_acceleration = rate, rate / _TURN_TIME
        pilot.in_current.limit, pilot.in_current.turn_rate = rate, _TURN_SHARE * rate


def limit_thrust(pilot: Pilot, most: float) -> None:
    """Limit the ordered fraction of full thrust from now on."""
    actuation: Any = pilot.actuation
    actuation.max_thrust = most


def boat_of(route: GeodeticRoute, takes: str = YAW_RATE) -> Boat:
    """The boat of a mission as the controllers see it; `takes`: one of `ACTUATIONS`."""
    table, settings, cruise = route.settings.boat, route.settings, float(np.mean(route.speed))
    rate, by_rate = largest_yaw_rate(table), takes == YAW_RATE
    response = YawResponse(1.0, table.yaw_time, 1.0, table.yaw_munk, table.yaw_quadratic)
    if by_rate:
        response = YawResponse(1.0, table.rate_time)
    speed = SpeedPIGains(
        mass=table.surge_time / table.top_speed_mps,
        linear_drag=1.0 / table.top_speed_mps,
        bandwidth=SPEED_BANDWIDTH,
        limit=1.0,
        limit_astern=1.0 if table.reverse else 0.0,
        acceleration=ACCELERATION[takes],
    )
    return Boat(
        nomoto_gain=1.0,
        nomoto_time=response.time,
        yaw_limit=rate,
        bandwidth=MAX_BANDWIDTH,
        propulsion=BoatActuation(table, takes),
        lookahead=settings.lookahead_m,
        acceptance=settings.acceptance,
        cruise=cruise,
        top_speed=table.top_speed_mps,
        profile="small-usv",
        turn_rate=rate,
        yaw=response,
        speed=speed,
        yaw_wander=0.0 if by_rate else _WANDER * rate,
        turn_acceleration=rate / _TURN_TIME,
        turn_share=_TURN_SHARE,
        surge_time=table.surge_time,
        slip_time=table.slip_time,
        takes_rates=by_rate,
        pivot_angle=math.inf if table.pivot_angle_deg is None else math.radians(table.pivot_angle_deg),
        sample=_SAMPLE,
    )


def pilot_of(
    route: GeodeticRoute,
    profile: Profile | str | None = None,
    takes: str = YAW_RATE,
    kinds: tuple[str, str] = DEFAULT_KINDS,
    heading: HeadingEstimatorTable = HeadingEstimatorTable(),  # noqa: B008
    observer: Observer | None = None,
) -> tuple[SteeringEstimate, Guide, Pilot]:
    """The estimator (which takes rows), the mission and the pilot of a route.

    profile: profile of the course estimator, None for the prior; it limits the bandwidth of the loop. takes: one of
    `ACTUATIONS`. kinds: as in `build_pilot`. heading: the filter that replaces the compass; "tracker" for no filter.
    Raises InputError for a route that cannot be sailed.
    """
    profile = profile_of(profile)
    boat, least, guidance = boat_of(route, takes), profile.steerageway, route.settings.guided
    compass = None
    if heading.kind != "tracker":
        compass = MeasuredHeading(heading, boat.nomoto_time, boat.turn_rate, boat.cruise, boat.surge_time)
    estimator = SteeringEstimate(route.places[0], response_of(boat), profile.position_std, compass)
    guide = Guide(route, boat)
    pilot = build_pilot(
        boat,
        guide,
        guidance.design(boat.lookahead, boat.cruise),
        estimator,  # type: ignore[arg-type]  # rows pass through the pilot
        kinds=kinds,
        steer_by=guidance.angle,
        steerageway=Steerageway(take=least, give=_GIVE_UP * least, dwell=0.0),
        course_estimate=(profile.agility, profile.position_std),
        radius=route.settings.hold_radius,
        observer=observer,
    )
    return estimator, guide, pilot
