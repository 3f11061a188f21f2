"""Names for this package's tests; not part of the public API."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.identification.interval import Interval
    from steerway.identification.logs import read_steering
    from steerway.identification.surge import following
    from steerway.identification.yaw import _under_way
    from steerway.identification.yaw_likelihood import positions_cost, rate_noise

__getattr__, __dir__ = on_demand(__name__)
