"""Build the pilot of a boat, for simulation, replay and live runs alike.

The boat is a `control.boats.Boat`, declared by the vessel of a scenario or by the table [boat] of a mission.
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
"""Default kinds of autopilot and speed controller."""
ANGLE_STD = math.radians(1.0)
"""1σ of an estimated course or heading for the observers of MPC and LQG autopilots, rad."""
_LONGEST_SPEED_TIME = 60.0
"""Upper limit of the time constant of speed in the steering filter, s."""
_TIME_STD = 0.5
"""Relative 1σ of the time constant of a vehicle's own yaw-rate loop: such loops respond in 0.1 to 1.3 s."""
_INTEGRAL = 0.1
"""Integral gain assumed for a vehicle's own yaw-rate loop, 1/s. ArduPilot's Rover has 0.1 to 0.26 for a motorboat; many
loops have no integral. Compared: with 0.2, simulated boats without an integral got lost in a current; with 0.1, boats
with and without an integral keep the route."""
_SLIP_STD = 0.25
"""1σ of the time constant of sway, s, for a boat that does not declare its pivot point."""
_SLIP = 0.2
"""Fraction of its speed that a vehicle with its own yaw-rate loop loses in its tightest turn, until its speed loop
compensates the loss. An Otter loses 0.3 at 15°/s."""


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
    """Build a pilot in its initial state.

    kinds: one of `heading_steering.KINDS` and one of `speed_force.CONTROLLERS`. shaper: shapes the references of an
    autopilot that ignores the current. Without a shaper, the pilot compensates the current if the estimator provides
    it, and holds a position within `radius` (m). angle_std: as in `Boat.autopilot`; steer_by, max_dead_reckoning,
    observer: as in `Pilot`; course_estimate: `estimate` of `Boat.autopilot_in_current`. speed: replaces the boat's own
    speed loop.
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
    """The parameters of a boat that the steering filter uses."""
    _, time, linear, munk, quadratic = boat.yaw_response
    slowly = min(boat.speed_time, _LONGEST_SPEED_TIME)
    motion = time, boat.turn_rate, boat.cruise, boat.top_speed, linear, munk, quadratic, slowly
    made = Response(*motion, pivot=boat.pivot)
    if boat.pivot == 0.0:
        made = made._replace(slip_time=boat.slip_time, slip_std=_SLIP_STD)
    doubt = {name: boat.yaw_doubt * getattr(made, name) for name in ("gain_std", "damping_std", "bias_std")}
    doubt |= {name: boat.speed_doubt * getattr(made, name) for name in ("speed_noise", "speed_gain_std")}
    wander = max(made.wander, boat.yaw_wander / boat.turn_rate)
    made = made._replace(wander=wander, loss=boat.turn_loss, **doubt)
    if not boat.takes_rates:
        return made
    # Damping, time constant and gain are known only up to a common factor: the damping is fixed.
    return made._replace(over_ground=True, time_std=_TIME_STD, damping_std=0.0, slip=_SLIP, integral=_INTEGRAL)
