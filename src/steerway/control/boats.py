"""Parameters of a boat for its controllers: yaw response, mass and drag, actuators.

You can measure these few numbers of any boat in an afternoon of trials. They are no vessel model. `steerway.vessels`
has them for the vessels of scenarios.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

from steerway.control.allocation import Actuation
from steerway.control.bandwidth import GainSchedule
from steerway.control.course import AnglePID, YawResponse, place_poles
from steerway.control.handover import Autopilot, HandOver, Shaper, Steerageway
from steerway.control.heading_plant import HeadingResponse
from steerway.control.heading_steering import KINDS, SampledSteering, steering
from steerway.control.holding import PositionHold
from steerway.control.in_current import InCurrent
from steerway.control.speed_force import ForceLoop, speed_loop
from steerway.control.speed_pi import SpeedPI, SpeedPIGains
from steerway.control.spot_turn import SpotTurn
from steerway.control.station import StationGains, StationKeeper
from steerway.core.reference import ReferenceModel

_SLOWEST = 0.6
"""Smallest speed through the water in a following current, as a fraction of cruise speed. Rudder force grows with the
square of the speed: at 0.6 it is a third of the force at cruise speed."""
_CORNER = 1.5
"""Default radius of a curved corner, as a multiple of the radius of the tightest turn."""
SAMPLED_SHARE = 2.4
"""Ratio of the bandwidth of an MPC or LQG loop in a current to that of pole placement. Only pole placement receives the
rate of the reference model."""


@dataclass(frozen=True)
class Boat:
    """Parameters of a boat for its controllers, with their defaults.

    nomoto_gain K and nomoto_time T: of T ω̇ + ω = K u, with u the autopilot's output (N·m, or rad of rudder);
    yaw_limit: largest |u|; yaw_slew: largest change of u per second; bandwidth: ω_n of the autopilot, rad/s; lookahead
    Δ and acceptance, m; cruise and top_speed, m/s. speed and station are None for a boat whose thrust is not
    controlled. full_shaft: shaft speed (rev/s) at full thrust, if one shaft drives the boat. response: identified
    heading response, for MPC and LQG in place of K and T. steers: whether the boat can turn. turn_rate: largest ordered
    yaw rate, rad/s. yaw: yaw response, if K and T do not describe it; pivot: distance (m) from the receiver forward to
    the pivot point, which moves along the bow also in a turn. yaw_wander: RMS yaw rate (rad/s) that the response does
    not explain; 0 if unknown. yaw_doubt: factor on the σ of gain, damping and bias of a guessed yaw response;
    speed_doubt: factor on the σ of a guessed boat's speed at an order. turn_loss: share of the speed lost in a turn at
    `turn_rate`.

    For steering in a current. turn_acceleration: largest yaw acceleration of the reference (rad/s²), by default half of
    the acceleration at yaw_limit. turn_share: yaw rate of planned turns as a fraction of `turn_rate`; the rest is a
    margin for the controller. surge_time: time constant of the speed in a planned turn, s. slip_time: time constant (s)
    with which the motion through the water follows the bow. takes_rates: whether the boat has its own inner loops for
    yaw rate and speed over ground. pivot_angle: smallest corner (rad) at which the boat stops and turns on the spot.
    sample: step (s) of an MPC or LQG autopilot, by default that of `HeadingResponse.of_nomoto`.
    """

    nomoto_gain: float
    nomoto_time: float
    yaw_limit: float
    bandwidth: float
    propulsion: Actuation
    lookahead: float
    acceptance: float
    cruise: float
    top_speed: float
    profile: str
    damping: float = 1.0
    turn_rate: float = math.radians(15.0)
    yaw: YawResponse | None = None
    speed: SpeedPIGains | None = None
    station: StationGains | None = None
    full_shaft: float = math.nan
    response: HeadingResponse | None = None
    yaw_slew: float = math.inf
    steers: bool = True
    pivot: float = 0.0
    yaw_wander: float = 0.0
    yaw_doubt: float = 1.0
    speed_doubt: float = 1.0
    turn_loss: float = 0.0
    turn_acceleration: float | None = None
    turn_share: float = 1.0
    surge_time: float = 2.0
    slip_time: float = 0.0
    takes_rates: bool = False
    pivot_angle: float = math.inf
    sample: float | None = None

    def autopilot(
        self, shaper: Shaper, steerageway: Steerageway | None = None, kind: str = KINDS[0], angle_std: float = 0.0
    ) -> Autopilot:
        """An autopilot of one of `heading_steering.KINDS` behind a reference filter.

        angle_std: 1σ of the estimated course or heading (rad), for kinds with an observer.
        """
        if kind != KINDS[0]:
            return Autopilot(self._sampled(kind, angle_std, self.bandwidth), shaper, HandOver(steerageway))
        gains = place_poles(self.nomoto_gain, self.nomoto_time, self.bandwidth, self.damping, self.yaw_limit)
        return Autopilot(AnglePID(gains), shaper, HandOver(steerageway))

    def autopilot_in_current(
        self,
        kind: str = KINDS[0],
        angle_std: float = 0.0,
        steerageway: Steerageway | None = None,
        estimate: tuple[float, float] | None = None,
    ) -> Autopilot:
        """An autopilot behind a reference model within the boat's limits; arguments as in `autopilot`.

        estimate: spectral density of the course acceleration (rad²/s³) and 1σ of a fix (m) of the course estimate that
        is used while the current is unknown. The gains then follow its bandwidth (`bandwidth.GainSchedule`).
        """
        bandwidth, response = 2.0 * self.bandwidth, self.yaw_response
        quickest = self.turn_acceleration
        if quickest is None:
            quickest = min(0.5 * response.gain * self.yaw_limit / response.time, bandwidth * self.turn_rate)
        model, hand_over = ReferenceModel(bandwidth, 1.0, self.turn_rate, quickest), HandOver(steerageway)
        if kind != KINDS[0]:
            return Autopilot(self._sampled(kind, angle_std, SAMPLED_SHARE * self.bandwidth), model, hand_over)
        if estimate is None:
            return Autopilot(AnglePID(response.gains(self.bandwidth, 0.0, self.yaw_limit)), model, hand_over)
        schedule = GainSchedule(None if self.takes_rates else self.nomoto_time, *estimate, self.bandwidth)
        return Autopilot(AnglePID(schedule.gains(math.nan)), model, hand_over, schedule)

    def _sampled(self, kind: str, angle_std: float, bandwidth: float) -> SampledSteering:
        """An MPC or LQG controller. For an identified response the weights follow from the limits instead."""
        response = self.response
        if response is None:
            time = max(self.nomoto_time, self.sample or 0.0)
            response = HeadingResponse.of_nomoto(self.nomoto_gain, time, self.sample)
        wanted = bandwidth if self.response is None else None
        return steering(kind, response, self.yaw_limit, self.yaw_slew, angle_std, wanted)

    def in_current(self) -> InCurrent:
        """Steering in a current, with this boat's parameters."""
        slowest = _SLOWEST * self.cruise
        fastest = max(self.cruise, min(self.top_speed, self.yaw_response.stable_speed))
        return InCurrent(
            self.yaw_response,
            fastest,
            slowest,
            self.turn_share * self.turn_rate,
            self.bandwidth,
            self.yaw_limit,
            self.takes_rates,
            self.pivot,
            self.surge_time,
            self.slip_time,
            self.lookahead,
            self.acceptance,
        )

    def position_hold(self, radius: float) -> PositionHold | None:
        """Position holding within a radius (m) by the estimated current; None for a boat without a speed loop."""
        return PositionHold(radius, _SLOWEST * self.cruise) if self.speed else None

    def spot_turn(self) -> SpotTurn | None:
        """Turning on the spot at sharp corners; None for a boat that turns under way or has no speed loop."""
        if self.speed is None or self.pivot_angle == math.inf:
            return None
        braking = min(self.speed.acceleration, self.cruise / self.speed_time)
        return SpotTurn(self.pivot_angle, braking, self.acceptance)

    @property
    def speed_time(self) -> float:
        """Time constant (s) of the boat's speed, mass over linear drag; infinite without a speed loop."""
        return math.inf if self.speed is None else self.speed.mass / max(self.speed.linear_drag, 1e-9)

    @property
    def corner_radius(self) -> float:
        """Radius (m) of a curved corner for a route that gives none."""
        return _CORNER * self.cruise / self.turn_rate

    @property
    def yaw_response(self) -> YawResponse:
        """The response of the yaw rate to the autopilot's output."""
        return self.yaw or YawResponse(self.nomoto_gain, self.nomoto_time)

    def speed_loop(self, kind: str = "pi") -> SpeedPI | ForceLoop | None:
        """A speed loop of one of `speed_force.CONTROLLERS`, None for a boat without one."""
        return speed_loop(kind, self.speed, self.full_shaft) if self.speed else None

    def station_keeper(self) -> StationKeeper | None:
        """A station keeper, None for a boat that cannot keep station."""
        return StationKeeper(self.station) if self.station else None

    def but(self, **changes: Any) -> "Boat":
        """The same boat with other numbers."""
        return replace(self, **changes)
