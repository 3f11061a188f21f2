"""What a pilot has to know of a boat: how she answers her helm, what she weighs, what drives her.

No vessel model: a handful of numbers that an afternoon's trials give for any boat, here for those that come along.
"""

import math
from dataclasses import dataclass, replace

from steerway.control.allocation import OTTER_PROPELLERS
from steerway.control.course import AnglePID, place_poles
from steerway.control.handover import HandOver, Helm, Steerageway
from steerway.control.rudder import Rudder
from steerway.control.speed_pi import SpeedPI, SpeedPIGains
from steerway.control.station import StationGains, StationKeeper


@dataclass(frozen=True)
class Boat:
    """A boat as her pilot sees her, with defaults for her controllers.

    nomoto_gain K and nomoto_time T as in T ω̇ + ω = K u, u being the autopilot's output (N·m, or rad of rudder);
    yaw_limit of |u|; bandwidth ω_n of the autopilot, rad/s; lookahead Δ and acceptance, m; cruise and top_speed, m/s;
    speed and station None for a boat whose thrust is not the pilot's business.
    """

    nomoto_gain: float
    nomoto_time: float
    yaw_limit: float
    bandwidth: float
    propulsion: object
    lookahead: float
    acceptance: float
    cruise: float
    top_speed: float
    profile: str
    damping: float = 1.0
    speed: SpeedPIGains | None = None
    station: StationGains | None = None

    def helm(self, shaper, steerageway: Steerageway | None = None) -> Helm:
        """Her autopilot behind a shaper of references."""
        gains = place_poles(self.nomoto_gain, self.nomoto_time, self.bandwidth, self.damping, self.yaw_limit)
        return Helm(AnglePID(gains), shaper, HandOver(steerageway))

    def speed_loop(self) -> SpeedPI | None:
        """Her speed loop, where she has one."""
        return SpeedPI(self.speed) if self.speed else None

    def station_keeper(self) -> StationKeeper | None:
        """Her station keeper, where she can."""
        return StationKeeper(self.station) if self.station else None

    def but(self, **changes) -> "Boat":
        """The same boat with other numbers."""
        return replace(self, **changes)


OTTER = Boat(
    nomoto_gain=0.0242,
    nomoto_time=1.0,
    yaw_limit=OTTER_PROPELLERS.max_moment,
    bandwidth=0.5,
    propulsion=OTTER_PROPELLERS,
    lookahead=12.0,
    acceptance=4.0,
    cruise=1.2,
    top_speed=3.0,
    profile="otter",
    speed=SpeedPIGains(mass=85.0, linear_drag=77.5, bandwidth=0.4, limit=200.0, acceleration=0.15),
    station=StationGains(mass=85.0, limit=200.0, limit_astern=100.0),
)
"""The Otter with 25 kg of payload. K and T are P0's (64)–(65), right for turns with some 4 N·m.

Small moments at 1.3 m/s find her slower and more willing (`OTTER_GENTLY`), K/T staying the same.
"""

OTTER_GENTLY = OTTER.but(nomoto_gain=0.05, nomoto_time=2.5, bandwidth=0.35)
"""The Otter for poor fixes on long legs: K and T of small moments allow a lower bandwidth. Her turns are wide."""

MARINER = Boat(
    nomoto_gain=0.185,
    nomoto_time=107.3,
    yaw_limit=math.radians(40.0),
    bandwidth=0.05,
    propulsion=Rudder(math.radians(40.0)),
    lookahead=800.0,
    acceptance=50.0,
    cruise=7.7175,
    top_speed=10.0,
    profile="ship",
)
"""The Mariner-class ship of P1 §4: K in 1/s and T in s, a mid-range fit."""
