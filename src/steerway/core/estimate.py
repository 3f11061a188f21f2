"""Inputs and outputs of an estimator at one time step."""

import math
from typing import NamedTuple, Protocol


class Measurements(NamedTuple):
    """Measurements at one step; SI, rad, NaN if not measured. Position in m in the plane of the route."""

    north: float = math.nan
    east: float = math.nan
    sog: float = math.nan
    cog: float = math.nan
    course_rate: float = math.nan  # only in simulations that show the true motion
    heading: float = math.nan
    yaw_rate: float = math.nan
    water_speed: float = math.nan
    bottom_speed: float = math.nan  # along the hull over ground
    acceleration: float = math.nan  # along the hull; contains a component of gravity when the hull pitches
    shaft: float = math.nan  # rev/s
    age: float = 0.0  # age of the position: s since its epoch


NO_MEASUREMENTS = Measurements()


class Estimate(NamedTuple):
    """The motion that guidance and control use; SI, rad, NaN for unknown. 1σ deviations are the estimator's own."""

    north: float
    east: float
    sog: float
    cog: float
    course_rate: float
    sog_std: float
    cog_std: float
    course_rate_std: float
    position_std: float  # includes the receiver's slow error, see `core.slow_error`
    heading: float
    yaw_rate: float
    heading_std: float = math.nan  # from here on: only from an estimator that uses the orders
    water_speed: float = math.nan
    current_north: float = math.nan
    current_east: float = math.nan
    yaw_bias: float = math.nan  # steady yaw rate without an order
    speed_gain: float = math.nan  # speed through the water divided by the ordered speed
    yaw_gain: float = 1.0  # gain of the yaw-rate response to orders, divided by the declared gain
    yaw_damping: float = 0.0  # linear damping of the response, minus the declared damping
    yaw_time: float = 1.0  # time constant of the response, divided by the declared one
    current_std: float = 0.0  # 1σ of the current in its least certain direction
    position_relative_std: float = math.nan  # 1σ of the position without the receiver's slow error
    slip_time: float = 0.0  # time constant with which the motion through the water follows the bow, s
    made_up: float = 1.0  # share of the current along the bow that the vehicle's own speed loop compensates

    @property
    def knows_current(self) -> bool:
        """Whether heading, speed through the water and current are estimated."""
        return not math.isnan(self.current_north)


NOTHING_KNOWN = Estimate(*[math.nan] * 11)


class Estimator(Protocol):
    """Estimates the motion step by step."""

    def step(self, measurements: Measurements, dt: float) -> Estimate:
        """The estimate at the time of these measurements, dt (s) after the last step."""
