"""Names for this package's tests; not part of the public API."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.control.allocation import thrust
    from steerway.control.bandwidth import COMFORTABLE, RATE_SHARE, advice, comfortable_bandwidth, loop_damping
    from steerway.control.handover import HandOver, Steerageway
    from steerway.control.heading_steering import steering
    from steerway.control.holding import PositionHold
    from steerway.control.turns import TurnLimits, TurnSpeeds, plan_turn

__getattr__, __dir__ = on_demand(__name__)
