"""Profiles: schema and TOML files, packing into the arrays of the kernels, built-in ones."""

from steerway.estimation.course.update.aids import AIDS
from steerway.estimation.profiles.presets import BUILT_IN
from steerway.estimation.profiles.schema import Profile

__all__ = ["AIDS", "BUILT_IN", "Profile"]
