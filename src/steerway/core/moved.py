"""Old module names: an import of one gives the module under its present name, with one line of warning."""

import sys
import warnings
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec

_COURSE = (
    "acceleration accuracy aiding comparison filter five_state forecast latency onboard position_update prediction "
    "replay smoothing tracking"
)
MOVED = (
    {
        f"steerway.{name}": f"steerway.core.{name}"
        for name in "angles checks compiled earth errors magnetic noise records timestamps".split()
    }
    | {f"steerway.estimation.{name}": f"steerway.estimation.course.{name}" for name in _COURSE.split()}
    | {
        "steerway.estimation.linear_algebra": "steerway.core.linear_algebra",
        "steerway.estimation.heading.h_infinity": "steerway_studies.springer_mission.h_infinity",
        "steerway.estimation.heading.interval.literal": "steerway_studies.papers.interval_filter",
        "steerway.estimation.tuning": "steerway.estimation.selection",
        "steerway.guidance.leg": "steerway.core.leg",
        "steerway.papers": "steerway_studies.papers",
        "steerway.studies": "steerway_studies",
    }
)
"""Old name → present name; what lies inside a package moved with it."""


def present_name(name: str) -> str | None:
    """The present name of a module that moved, None of any other."""
    for old, new in MOVED.items():
        if name == old or name.startswith(f"{old}."):
            return new + name[len(old) :]
    return None


class _MovedModules(MetaPathFinder, Loader):
    """Finds a module by its old name and loads the one it became."""

    def find_spec(self, fullname, path=None, target=None):
        return None if present_name(fullname) is None else ModuleSpec(fullname, self)

    def create_module(self, spec):
        new = present_name(spec.name)
        warnings.warn(f"{spec.name} is now {new}", FutureWarning, stacklevel=2)
        module = import_module(new)
        for name in [each for each in sys.modules if each.startswith(f"{new}.")]:
            sys.modules.setdefault(spec.name + name[len(new) :], sys.modules[name])
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module):
        """Nothing runs a second time; the import system has replaced the module's own specification."""
        module.__spec__ = module.__spec__.loader_state


def redirect_moved_modules() -> None:
    """Make the old names importable."""
    if not any(isinstance(finder, _MovedModules) for finder in sys.meta_path):
        sys.meta_path.insert(0, _MovedModules())
