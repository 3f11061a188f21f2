"""Sensors: models of instruments, one a file, and the suite that samples them together."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.estimation.heading.models import (
        STATE_VARIANCE,
        TCM2,
        TICKS,
        TRUE_TCM2,
        CompassModel,
        random_compass,
        stability_limit,
    )
    from steerway.sensors.compass import Compass, DynamicCompass
    from steerway.sensors.doppler import DopplerLog
    from steerway.sensors.gnss import Gnss, low_cost, white
    from steerway.sensors.inertial import accelerometer, gyro
    from steerway.sensors.instrument import Instrument
    from steerway.sensors.suite import Suite, Truth

__all__ = [
    "STATE_VARIANCE",
    "TCM2",
    "TICKS",
    "TRUE_TCM2",
    "Compass",
    "CompassModel",
    "DopplerLog",
    "DynamicCompass",
    "Gnss",
    "Instrument",
    "Suite",
    "Truth",
    "accelerometer",
    "gyro",
    "low_cost",
    "random_compass",
    "stability_limit",
    "white",
]
__getattr__, __dir__ = on_demand(__name__)
