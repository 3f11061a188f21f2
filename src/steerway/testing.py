"""Names that the tests of this package need and no user does."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.build import build_pilot, response_of
    from steerway.pilot import Lookout, Mode, Pilot

__getattr__, __dir__ = on_demand(__name__)
