"""The pilot: one step of estimation, guidance and control, and the builder that makes a pilot for a boat."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.control.allocation import Actuation
    from steerway.pilot.build import ANGLE_STD, DEFAULT_KINDS, build_pilot, response_of
    from steerway.pilot.orders import LegSource, Mode, Orders, SpeedLoop, SteadyForce, Steered
    from steerway.pilot.pilot import Lookout, Observer, Pilot

__all__ = [
    "ANGLE_STD",
    "DEFAULT_KINDS",
    "Actuation",
    "LegSource",
    "Lookout",
    "Mode",
    "Observer",
    "Orders",
    "Pilot",
    "SpeedLoop",
    "SteadyForce",
    "Steered",
    "build_pilot",
    "response_of",
]
__getattr__, __dir__ = on_demand(__name__)
