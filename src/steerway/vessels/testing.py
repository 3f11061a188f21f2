"""Names for this package's tests; not part of the public API."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.control.speed_guess import follow
    from steerway.estimation.heading.models import PAPER_YAW, PHYSICAL_YAW
    from steerway.vessels import otter
    from steerway.vessels.cybership2 import DAMPING, INERTIA
    from steerway.vessels.cybership2 import derivatives as cybership2_derivatives
    from steerway.vessels.environment import AIR_DENSITY, Waves, Wind
    from steerway.vessels.kinds import TABLES
    from steerway.vessels.mariner import CRUISE_SPEED
    from steerway.vessels.mariner import derivatives as mariner_derivatives
    from steerway.vessels.otter import BOAT as OTTER_BOAT
    from steerway.vessels.otter import OtterTable
    from steerway.vessels.otter import derivatives as otter_derivatives
    from steerway.vessels.otter_hull import mass_matrix
    from steerway.vessels.propeller import thrust as propeller_thrust
    from steerway.vessels.propeller import thrust_coefficient

__getattr__, __dir__ = on_demand(__name__)
