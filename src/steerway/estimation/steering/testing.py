"""Names for this package's tests; not part of the public API."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.estimation.steering.receiver import ReceiverNoise

__getattr__, __dir__ = on_demand(__name__)
