"""Guidance: routes, missions, the laws that follow them, and reference models."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.core.reference import LowPass, Reference, ReferenceModel, TrackingFilter
    from steerway.guidance.line_of_sight import (
        AdaptiveLineOfSight,
        GuidanceLaw,
        IntegralLineOfSight,
        LineOfSight,
        PurePursuit,
        VectorField,
    )
    from steerway.guidance.mission_log import MissionLog
    from steerway.guidance.ordered import Order, Ordered
    from steerway.guidance.route import Route
    from steerway.guidance.route_table import lawnmower
    from steerway.guidance.waypoints import Mission, Passing, Phase

__all__ = [
    "AdaptiveLineOfSight",
    "GuidanceLaw",
    "IntegralLineOfSight",
    "LineOfSight",
    "LowPass",
    "Mission",
    "MissionLog",
    "Order",
    "Ordered",
    "Passing",
    "Phase",
    "PurePursuit",
    "Reference",
    "ReferenceModel",
    "Route",
    "TrackingFilter",
    "VectorField",
    "lawnmower",
]
__getattr__, __dir__ = on_demand(__name__)
