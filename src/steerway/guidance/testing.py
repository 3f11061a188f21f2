"""Names for this package's tests; not part of the public API."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.core.reference import SHAPERS
    from steerway.core.wheel_over import off_path, passing, turn_path, wheel_over
    from steerway.guidance.corners import corner
    from steerway.guidance.laws import LAWS, GuidanceTable
    from steerway.guidance.line_of_sight import line_of_sight
    from steerway.guidance.ordered import OrderTable
    from steerway.guidance.route_table import PlaceTable, WaypointTable
    from steerway.guidance.voyage import Voyage

__getattr__, __dir__ = on_demand(__name__)
