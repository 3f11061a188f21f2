"""Identification: parameters of a vessel, with confidence intervals, from a log of its motion."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.identification.compass import IdentifiedCompass, identify_compass
    from steerway.identification.heading import IdentifiedHeading, identify_heading
    from steerway.identification.surge import SurgeIdentification, SurgeModel, identify_surge
    from steerway.identification.yaw import YawModel, identify_yaw, identify_yaw_from_fixes

__all__ = [
    "IdentifiedCompass",
    "IdentifiedHeading",
    "SurgeIdentification",
    "SurgeModel",
    "YawModel",
    "identify_compass",
    "identify_heading",
    "identify_surge",
    "identify_yaw",
    "identify_yaw_from_fixes",
]
__getattr__, __dir__ = on_demand(__name__)
