"""What the controllers need to know of a boat: its yaw response, its mass and drag, its actuators.

No vessel model: a handful of numbers that an afternoon of trials gives for any boat; here for the vessels included.
"""

import math
import warnings
from dataclasses import dataclass, replace

from steerway.control.allocation import OTTER_PROPELLERS
from steerway.control.course import AnglePID, place_poles
from steerway.control.handover import Autopilot, HandOver, Steerageway
from steerway.control.rudder import Rudder
from steerway.control.speed_pi import SpeedPI, SpeedPIGains
from steerway.control.station import StationGains, StationKeeper


@dataclass(frozen=True)
class Boat:
    """A boat as its controllers see it, with defaults for them.

    nomoto_gain K and nomoto_time T as in T ω̇ + ω = K u, u being the autopilot's output (N·m, or rad of rudder);
    yaw_limit of |u|; bandwidth ω_n of the autopilot, rad/s; lookahead Δ and acceptance, m; cruise and top_speed, m/s;
    speed and station None for a boat whose thrust is not controlled.
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

    def autopilot(self, shaper, steerageway: Steerageway | None = None) -> Autopilot:
        """An autopilot behind a shaper of references."""
        gains = place_poles(self.nomoto_gain, self.nomoto_time, self.bandwidth, self.damping, self.yaw_limit)
        return Autopilot(AnglePID(gains), shaper, HandOver(steerageway))

    def helm(self, shaper, steerageway: Steerageway | None = None) -> Autopilot:
        """The old name of `autopilot`."""
        warnings.warn("Boat.helm is now Boat.autopilot", FutureWarning, stacklevel=2)
        return self.autopilot(shaper, steerageway)

    def speed_loop(self) -> SpeedPI | None:
        """A speed loop, None for a boat without one."""
        return SpeedPI(self.speed) if self.speed else None

    def station_keeper(self) -> StationKeeper | None:
        """A station keeper, None for a boat that cannot keep station."""
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

Small moments at 1.3 m/s give a larger K and T (`OTTER_GENTLY`) with the same K/T.
"""

OTTER_GENTLY = OTTER.but(nomoto_gain=0.05, nomoto_time=2.5, bandwidth=0.35)
"""The Otter for poor fixes on long legs: K and T of small moments allow a lower bandwidth. Turns are wide."""

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
