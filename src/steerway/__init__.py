"""Speed over ground, course over ground and course rate from GNSS positions, with their standard deviations.

Estimate the motion in a log, and write it to a file:

    fixes = steerway.read("sortie.nmea")
    motion = steerway.estimate(fixes)
    steerway.write(motion, "sortie.csv")
"""

from typing import TYPE_CHECKING

from steerway.core.on_demand import from_above, on_demand

if TYPE_CHECKING:
    from steerway.core.errors import InputError
    from steerway.core.records import Fixes, Motion
    from steerway.estimation import FiveStateFilter, Profile, estimate, tune
    from steerway.formats.reading import read, survey
    from steerway.formats.writing import write
    from steerway.report.figures import plot

__version__ = "0.1.0"
__all__ = [
    "FiveStateFilter",
    "Fixes",
    "InputError",
    "Motion",
    "Profile",
    "estimate",
    "plot",
    "read",
    "survey",
    "tune",
    "write",
]
__getattr__, __dir__ = on_demand(__name__)
from_above["read"] = lambda frame: __getattr__("read")(frame)  # type: ignore[operator]
