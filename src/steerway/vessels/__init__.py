"""Vessels, one per file, each with its `derivatives` and a class that the loop can step."""

from steerway.core.kinematics import GroundMotion
from steerway.vessels.actuators import Actuator
from steerway.vessels.caldas import Caldas
from steerway.vessels.cybership2 import CyberShip2
from steerway.vessels.mariner import Mariner
from steerway.vessels.nomoto import Nomoto
from steerway.vessels.otter import Otter
from steerway.vessels.propeller import Propeller
from steerway.vessels.surge import Surge
from steerway.vessels.vessel import CALM, Vessel, conditions

__all__ = [
    "CALM",
    "Actuator",
    "Caldas",
    "CyberShip2",
    "GroundMotion",
    "Mariner",
    "Nomoto",
    "Otter",
    "Propeller",
    "Surge",
    "Vessel",
    "conditions",
]
