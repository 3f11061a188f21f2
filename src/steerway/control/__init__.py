"""Control: autopilots for course, heading, speed and position, and the allocation of thrust to propellers."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.control.allocation import OTTER_PROPELLERS, Rudder, Thrusters, TwoPropellers, thruster_matrix
    from steerway.control.bandwidth import carried_bandwidth
    from steerway.control.course import AnglePID, AnglePIDGains, place_poles
    from steerway.control.handover import Autopilot
    from steerway.control.heading_mpc import HeadingLqg, HeadingMpc
    from steerway.control.heading_plant import BiasObserver, HeadingResponse, InputLimits, LinearPlant
    from steerway.control.positioning import PositioningGains, PositionPID
    from steerway.control.positioning import by_bandwidth as positioning_gains
    from steerway.control.speed import AdaptiveSpeed, AdaptiveSpeedGains
    from steerway.control.speed_force import ForceLoop, speed_loop
    from steerway.control.speed_observer import ObservedSpeed, SpeedObserverGains
    from steerway.control.speed_pi import SpeedPI, SpeedPIGains
    from steerway.control.station import StationGains, StationKeeper

__all__ = [
    "OTTER_PROPELLERS",
    "AdaptiveSpeed",
    "AdaptiveSpeedGains",
    "AnglePID",
    "AnglePIDGains",
    "Autopilot",
    "BiasObserver",
    "ForceLoop",
    "HeadingLqg",
    "HeadingMpc",
    "HeadingResponse",
    "InputLimits",
    "LinearPlant",
    "ObservedSpeed",
    "PositionPID",
    "PositioningGains",
    "Rudder",
    "SpeedObserverGains",
    "SpeedPI",
    "SpeedPIGains",
    "StationGains",
    "StationKeeper",
    "Thrusters",
    "TwoPropellers",
    "carried_bandwidth",
    "place_poles",
    "positioning_gains",
    "speed_loop",
    "thruster_matrix",
]
__getattr__, __dir__ = on_demand(__name__)
