"""Estimation for a boat whose orders are known: motion through the water, current, and response to orders."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.estimation.steering.filter import SteeringFilter
    from steerway.estimation.steering.onboard import SteeringEstimator
    from steerway.estimation.steering.response import Response

__all__ = ["Response", "SteeringEstimator", "SteeringFilter"]
__getattr__, __dir__ = on_demand(__name__)
