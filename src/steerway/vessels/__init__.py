"""Vessels: one a file, each with her `derivatives` and an object that the loop can step."""

from steerway.vessels.actuators import Actuator
from steerway.vessels.cybership2 import CyberShip2
from steerway.vessels.kinematics import GroundMotion
from steerway.vessels.mariner import Mariner
from steerway.vessels.nomoto import Nomoto
from steerway.vessels.otter import Otter
from steerway.vessels.vessel import CALM, Vessel, conditions

__all__ = ["CALM", "Actuator", "CyberShip2", "GroundMotion", "Mariner", "Nomoto", "Otter", "Vessel", "conditions"]
