"""Identification: what a vessel is, with intervals, from a log of what she did."""

from steerway.identification.heading import IdentifiedHeading, identify_heading
from steerway.identification.surge import SurgeIdentification, SurgeModel, identify_surge
from steerway.identification.yaw import YawModel, identify_yaw, identify_yaw_from_fixes

__all__ = [
    "IdentifiedHeading",
    "SurgeIdentification",
    "SurgeModel",
    "YawModel",
    "identify_heading",
    "identify_surge",
    "identify_yaw",
    "identify_yaw_from_fixes",
]
