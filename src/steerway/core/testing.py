"""Names for this package's tests; not part of the public API."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.core import compiled, files, kernel_cache
    from steerway.core.angles import sinc
    from steerway.core.earth import KNOT, NAUTICAL_MILE, displaced, displaced_all, displacement
    from steerway.core.kinematics import (
        GroundMotion,
        course_per_heading,
        heading_for,
        in_body,
        over_ground,
        turning_rate,
        water_speed_for,
    )
    from steerway.core.leg import Leg, LegState
    from steerway.core.locks import only_writer
    from steerway.core.magnetic import model_of, variation
    from steerway.core.records import LOST, MOTION_COLUMNS, NO_COURSE, PREDICTED, REPORTED, STARTING, STATUSES
    from steerway.core.settings import Table, description_of, unit_of
    from steerway.core.timestamps import iso, unix_times
    from steerway.core.wheel_over import off_path, turn_path, wheel_over
    from steerway.core.workers import in_workers

__getattr__, __dir__ = on_demand(__name__)
