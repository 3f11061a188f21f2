"""Speed over ground, course over ground and course rate from GNSS positions, with honest uncertainty.

fixes = steerway.read("sortie.nmea")
motion = steerway.estimate(fixes)
steerway.write(motion, "sortie.csv")

A name is loaded when it is first asked for: a process that estimates nothing, as that of the helm page, is half as big.
"""

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING

from steerway.core.moved import redirect_moved_modules

if TYPE_CHECKING:
    from steerway.core.errors import InputError
    from steerway.core.records import Fixes, Motion
    from steerway.estimation import FiveStateFilter, Profile, estimate, tune
    from steerway.formats.reading import read, survey
    from steerway.formats.writing import write

__all__ = ["FiveStateFilter", "Fixes", "InputError", "Motion", "Profile", "estimate", "read", "survey", "tune", "write"]
_HOMES = {
    "core.errors": ("InputError",),
    "estimation": ("FiveStateFilter", "Profile", "estimate", "tune"),
    "formats.reading": ("read", "survey"),
    "formats.writing": ("write",),
    "core.records": ("Fixes", "Motion"),
}


redirect_moved_modules()


def __getattr__(name):
    """A public name, or a room of the house."""
    for home, names in _HOMES.items():
        if name in names:
            globals()[name] = getattr(import_module(f"steerway.{home}"), name)
            return globals()[name]
    if not name.startswith("_") and find_spec(f"steerway.{name}") is not None:
        return import_module(f"steerway.{name}")
    raise AttributeError(f"module 'steerway' has no attribute {name!r}")


def __dir__():
    return sorted({*globals(), *__all__})
