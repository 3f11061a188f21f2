"""Speed over ground, course over ground and course rate from GNSS positions, with honest uncertainty.

fixes = steerway.read("sortie.nmea")
motion = steerway.estimate(fixes)
steerway.write(motion, "sortie.csv")
"""

from steerway.errors import InputError
from steerway.estimation import FiveStateFilter, Profile, estimate, tune
from steerway.formats.reading import read, survey
from steerway.formats.writing import write
from steerway.records import Fixes, Motion

__all__ = ["FiveStateFilter", "Fixes", "InputError", "Motion", "Profile", "estimate", "read", "survey", "tune", "write"]
