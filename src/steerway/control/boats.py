"""What the controllers need to know of a boat: its yaw response, its mass and drag, its actuators.

No vessel model: a handful of numbers that an afternoon of trials gives for any boat. `steerway.vessels` declares them
for the vessels that a scenario can name.
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
"""Share of the cruise speed, through the water, that is kept in a following current. Chosen: a rudder has a third of
its force there, which goes with the square of speed."""
_CORNER = 1.5
"""Radius of a corner's curve over that of the tightest turn."""
SAMPLED_SHARE = 2.4
"""Bandwidth of a predictive or LQG loop that follows the reference model of steering in a current, over that of pole
placement, which also gets the reference rate. Chosen."""


@dataclass(frozen=True)
class Boat:
    """A boat as its controllers see it, with defaults for them.

    nomoto_gain K and nomoto_time T as in T ω̇ + ω = K u, u being the autopilot's output (N·m, or rad of rudder);
    yaw_limit of |u|; bandwidth ω_n of the autopilot, rad/s; lookahead Δ and acceptance, m; cruise and top_speed, m/s;
    speed and station None for a boat whose thrust is not controlled. full_shaft: shaft speed (rev/s) of full thrust,
    where one shaft drives the boat. response: the heading's own, where it is known better than by K and T; yaw_slew:
    what the autopilot's output can change by in a second. steers: whether the boat can turn. turn_rate: the largest
    that is ordered, rad/s; yaw: the response to orders where K and T alone do not describe it; pivot: m from the
    receiver ahead to the point that moves along the bow in a turn too. yaw_wander: RMS of the yaw rate that the
    response leaves unexplained, rad/s; 0 where that is not known. yaw_doubt: 1σ of the response's gain, damping and
    bias over that of a boat whose response is a guess.

    In a current: turn_acceleration (rad/s²) of the reference, by default half of what the limit of the output gives;
    turn_share: of `turn_rate` at which turns are planned, the rest being left to the controller; surge_time: time
    constant of the speed in a planned turn, s; slip_time: that of the motion through the water, which follows the bow
    there, s. takes_rates: whether the boat is a vehicle with loops of its own, which is ordered a yaw rate and a speed
    over ground. pivot_angle: corners (rad) from which on it stops and turns on the spot. sample: s between the steps of
    a predictive or LQG autopilot, by default as of `HeadingResponse.of_nomoto`.
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
        """An autopilot behind a shaper of references, of one of `heading_steering.KINDS`.

        angle_std: 1σ of the estimated course or heading (rad), for the kinds that have an observer.
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
        """An autopilot behind a reference model that the boat can follow; arguments as of `autopilot`.

        estimate: spectral density of the course acceleration (rad²/s³) and 1σ of a fix (m) of the course estimate that
        is steered by while the current is not known; the gains follow what it carries (`bandwidth.GainSchedule`).
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
        """A predictive or LQG controller; its bandwidth follows from the limits where the response is known."""
        response = self.response
        if response is None:
            time = max(self.nomoto_time, self.sample or 0.0)
            response = HeadingResponse.of_nomoto(self.nomoto_gain, time, self.sample)
        wanted = bandwidth if self.response is None else None
        return steering(kind, response, self.yaw_limit, self.yaw_slew, angle_std, wanted)

    def in_current(self) -> InCurrent:
        """What steering in a current knows of the boat."""
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
        """What holds a position within a radius (m) by the estimated current; None for a boat without a speed loop."""
        return PositionHold(radius, _SLOWEST * self.cruise) if self.speed else None

    def spot_turn(self) -> SpotTurn | None:
        """What turns the boat on the spot; None for one that turns under way, or has no speed loop."""
        if self.speed is None or self.pivot_angle == math.inf:
            return None
        braking = min(self.speed.acceleration, self.cruise / self.speed_time)
        return SpotTurn(self.pivot_angle, braking, self.acceptance)

    @property
    def speed_time(self) -> float:
        """s in which the speed follows an ordered one; infinite where none can be ordered."""
        return math.inf if self.speed is None else self.speed.mass / max(self.speed.linear_drag, 1e-9)

    @property
    def corner_radius(self) -> float:
        """Radius (m) of a corner's curve where a route gives none."""
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
