"""Speed over ground, course over ground and course rate from GNSS positions, with honest uncertainty."""

from steerway.errors import InputError
from steerway.records import Fixes, Motion

__all__ = ["Fixes", "InputError", "Motion"]
