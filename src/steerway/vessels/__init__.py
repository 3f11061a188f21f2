"""Vessel models, one per file, each with its equations of motion and a class that a simulation steps."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.core.kinematics import GroundMotion
    from steerway.estimation.heading.models import PAPER_YAW as SPRINGER_PAPER_YAW
    from steerway.estimation.heading.models import PHYSICAL_YAW as SPRINGER_PHYSICAL_YAW
    from steerway.estimation.heading.models import RPM, HeadingModel
    from steerway.estimation.heading.models import SPEED as SPRINGER_SPEED
    from steerway.vessels.caldas import Caldas
    from steerway.vessels.cybership2 import (
        DAMPING as CYBERSHIP2_DAMPING,
    )
    from steerway.vessels.cybership2 import (
        INERTIA as CYBERSHIP2_INERTIA,
    )
    from steerway.vessels.cybership2 import (
        THRUST as CYBERSHIP2_THRUST,
    )
    from steerway.vessels.cybership2 import (
        CyberShip2,
    )
    from steerway.vessels.environment import Current, Environment
    from steerway.vessels.low_speed import LowSpeedVessel
    from steerway.vessels.mariner import BOAT as MARINER_BOAT
    from steerway.vessels.mariner import BOAT_IN_CURRENT as MARINER_BOAT_IN_CURRENT
    from steerway.vessels.mariner import CRUISE_SPEED as MARINER_CRUISE_SPEED
    from steerway.vessels.mariner import RUDDER as MARINER_RUDDER
    from steerway.vessels.mariner import Mariner
    from steerway.vessels.motorboat import BOAT as MOTORBOAT_BOAT
    from steerway.vessels.motorboat import Motorboat
    from steerway.vessels.nomoto import Nomoto
    from steerway.vessels.otter import BOAT as OTTER_BOAT
    from steerway.vessels.otter import BOAT_IN_CURRENT as OTTER_BOAT_IN_CURRENT
    from steerway.vessels.otter import Otter
    from steerway.vessels.propeller import Propeller
    from steerway.vessels.propeller import thrust as propeller_thrust
    from steerway.vessels.springer import MAX_CHANGE_RPM as SPRINGER_MAX_CHANGE_RPM
    from steerway.vessels.springer import MAX_DIFFERENCE_RPM as SPRINGER_MAX_DIFFERENCE_RPM
    from steerway.vessels.springer import Springer
    from steerway.vessels.surge import (
        CALDAS_LINEAR_DRAG,
        CALDAS_MASS,
        CALDAS_QUADRATIC_DRAG,
        Surge,
        published_surrogate,
    )
    from steerway.vessels.surge import (
        SHAFT as CALDAS_SHAFT,
    )
    from steerway.vessels.vessel import CALM, CURRENT_NORTH, Actuator, Vessel, conditions, runge_kutta

__all__ = [
    "CALDAS_LINEAR_DRAG",
    "CALDAS_MASS",
    "CALDAS_QUADRATIC_DRAG",
    "CALDAS_SHAFT",
    "CALM",
    "CURRENT_NORTH",
    "CYBERSHIP2_DAMPING",
    "CYBERSHIP2_INERTIA",
    "CYBERSHIP2_THRUST",
    "MARINER_BOAT",
    "MARINER_BOAT_IN_CURRENT",
    "MARINER_CRUISE_SPEED",
    "MARINER_RUDDER",
    "MOTORBOAT_BOAT",
    "OTTER_BOAT",
    "OTTER_BOAT_IN_CURRENT",
    "RPM",
    "SPRINGER_MAX_CHANGE_RPM",
    "SPRINGER_MAX_DIFFERENCE_RPM",
    "SPRINGER_PAPER_YAW",
    "SPRINGER_PHYSICAL_YAW",
    "SPRINGER_SPEED",
    "Actuator",
    "Caldas",
    "Current",
    "CyberShip2",
    "Environment",
    "GroundMotion",
    "HeadingModel",
    "LowSpeedVessel",
    "Mariner",
    "Motorboat",
    "Nomoto",
    "Otter",
    "Propeller",
    "Springer",
    "Surge",
    "Vessel",
    "conditions",
    "propeller_thrust",
    "published_surrogate",
    "runge_kutta",
]
__getattr__, __dir__ = on_demand(__name__)
