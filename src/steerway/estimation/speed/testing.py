"""Names that the tests of this package need and no user does."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.estimation.speed.fusion import AIDS

__getattr__, __dir__ = on_demand(__name__)
