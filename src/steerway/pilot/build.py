"""Pilots for boats: one builder for simulation, replay and live.

A boat is a `control.boats.Boat`, whether a vessel of a scenario declares it or the table [boat] of a mission does.
"""

import math

from steerway.control.boats import Boat
from steerway.control.handover import Shaper, Steerageway
from steerway.control.holding import PositionHold
from steerway.control.in_current import InCurrent
from steerway.control.station import StationKeeper
from steerway.core.estimate import Estimator
from steerway.estimation.steering import Response
from steerway.guidance.line_of_sight import GuidanceLaw
from steerway.pilot.orders import LegSource, SpeedLoop
from steerway.pilot.pilot import Observer, Pilot

DEFAULT_KINDS = "pole-placement", "pi"
"""Kinds of autopilot and speed controller."""
ANGLE_STD = math.radians(1.0)
"""1σ of an estimated course or heading, as predictive and LQG autopilots take it."""
_LONGEST_SPEED_TIME = 60.0
"""s, of the speed's response in the steering filter."""
_TIME_STD = 0.5
"""1σ of the time constant of a vehicle's own yaw-rate loop, as a share: they answer in 0.1 to 1.3 s. Chosen."""
_INTEGRAL = 0.1
"""1/s at which the integral of such a loop adds what is missing of an ordered yaw rate. Chosen: of a motorboat by
ArduPilot's Rover it is 0.1 to 0.26 1/s, and many loops have none. With 0.2 boats without one are lost in a current.
"""
_SLIP_STD = 0.25
"""s, 1σ of the time constant of the sway of a boat whose pivot point is not declared. Chosen."""
_SLIP = 0.2
"""Share of its speed that such a vehicle loses in its tightest turn before its own loop makes it up. Chosen: an Otter
loses 0.3 at 15°/s."""


def build_pilot(
    boat: Boat,
    mission: LegSource,
    law: GuidanceLaw,
    estimator: Estimator,
    *,
    kinds: tuple[str, str] = DEFAULT_KINDS,
    shaper: Shaper | None = None,
    steerageway: Steerageway | None = None,
    angle_std: float = ANGLE_STD,
    steer_by: str = "course",
    course_estimate: tuple[float, float] | None = None,
    radius: float = 5.0,
    max_dead_reckoning: float = 10.0,
    observer: Observer | None = None,
    speed: SpeedLoop | None = None,
) -> Pilot:
    """A pilot in its initial state.

    kinds: one of `heading_steering.KINDS` and one of `speed_force.CONTROLLERS`. shaper: of the references of an
    autopilot for course or heading alone; without one the boat is steered by the estimated current, where the
    estimator knows it, and holds a position within `radius` (m). angle_std: as of `Boat.autopilot`; steer_by,
    max_dead_reckoning and observer: as of `Pilot`; course_estimate: as of `Boat.autopilot_in_current`. speed: in place
    of the boat's own speed loop.
    """
    station: StationKeeper | PositionHold | None
    steering: InCurrent | None
    if shaper is None:
        autopilot = boat.autopilot_in_current(kinds[0], angle_std, steerageway, course_estimate)
        station, steering, spot_turn = boat.position_hold(radius), boat.in_current(), boat.spot_turn()
    else:
        autopilot = boat.autopilot(shaper, steerageway, kinds[0], angle_std)
        station, steering, spot_turn = boat.station_keeper(), None, None
    return Pilot(
        estimator,
        mission,
        law,
        autopilot,
        boat.propulsion,
        speed or boat.speed_loop(kinds[1]),
        station,
        cruise=boat.cruise,
        steer_by=steer_by,
        in_current=steering,
        spot_turn=spot_turn,
        max_dead_reckoning=max_dead_reckoning,
        observer=observer,
    )


def response_of(boat: Boat) -> Response:
    """The numbers of a boat that the steering filter uses."""
    _, time, linear, munk, quadratic = boat.yaw_response
    slowly = min(boat.speed_time, _LONGEST_SPEED_TIME)
    motion = time, boat.turn_rate, boat.cruise, boat.top_speed, linear, munk, quadratic, slowly
    made = Response(*motion, pivot=boat.pivot)
    if boat.pivot == 0.0:
        made = made._replace(slip_time=boat.slip_time, slip_std=_SLIP_STD)
    doubt = {name: boat.yaw_doubt * getattr(made, name) for name in ("gain_std", "damping_std", "bias_std")}
    made = made._replace(wander=max(made.wander, boat.yaw_wander / boat.turn_rate), **doubt)
    if not boat.takes_rates:
        return made
    # One number of the damping, the time constant and the gain is free.
    return made._replace(over_ground=True, time_std=_TIME_STD, damping_std=0.0, slip=_SLIP, integral=_INTEGRAL)
