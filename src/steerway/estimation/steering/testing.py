"""Names for this package's tests; not part of the public API."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.estimation.steering.correction import fold
    from steerway.estimation.steering.motion import moved_by_orders
    from steerway.estimation.steering.prediction import predict_bank
    from steerway.estimation.steering.receiver import ReceiverNoise

__getattr__, __dir__ = on_demand(__name__)
