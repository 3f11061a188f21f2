"""Names that the tests of this package need and no user does."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.estimation.heading.aboard import HeadingAboard, model_of
    from steerway.estimation.heading.aided import PRODUCT
    from steerway.estimation.heading.compass_alarm import gain_range
    from steerway.estimation.heading.interval import arithmetic
    from steerway.estimation.heading.interval.weighting import shipped
    from steerway.estimation.heading.models import TICK

__getattr__, __dir__ = on_demand(__name__)
