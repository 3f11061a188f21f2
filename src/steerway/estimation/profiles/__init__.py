"""Profiles: schema and TOML files, packing into the arrays of the kernels, built-in ones."""

from steerway.estimation.course.update.aids import AIDS
from steerway.estimation.profiles.schema import BUILT_IN, Profile

__all__ = ["AIDS", "BUILT_IN", "Profile"]
