"""What a pilot has to know of a boat: how it answers the helm, its mass and its propulsion.

No vessel model: a handful of numbers that an afternoon's trials give for any boat. `steerway.vessels` declares them for
the vessels that a scenario can name.
"""

import warnings
from dataclasses import dataclass, replace
from importlib import import_module

from steerway.control.course import AnglePID, place_poles
from steerway.control.handover import HandOver, Helm, Steerageway
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


_MOVED = {
    "OTTER": ("otter", "BOAT"),
    "OTTER_GENTLY": ("otter", "BOAT_FOR_SMALL_MOMENTS"),
    "MARINER": ("mariner", "BOAT"),
}


def __getattr__(name):
    """The boats that are now declared beside their vessels, by their old names."""
    if name not in _MOVED:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    file, present = _MOVED[name]
    warnings.warn(f"{__name__}.{name} is now steerway.vessels.{file}.{present}", FutureWarning, stacklevel=2)
    return getattr(import_module(f"steerway.vessels.{file}"), present)
