"""Old names of modules, methods and arguments: each gives what it became, with one line of warning."""

import functools
import sys
import warnings
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

_COURSE = "comparison filter forecast latency onboard replay tracking"
_RENAMED = {
    "acceleration": "motion.acceleration",
    "accuracy": "update.reported_accuracy",
    "aiding": "update.aids",
    "five_state": "motion.five_state",
    "mixture": "imm",
    "model": "motion.layout",
    "position_update": "update.position",
    "smoothing": "smoothing.rauch_tung_striebel",
    "way": "steerageway",
    "yawing": "motion.oscillation",
}
MOVED = (
    {
        f"steerway.{name}": f"steerway.core.{name}"
        for name in "angles checks compiled earth errors magnetic noise records timestamps".split()
    }
    | {f"steerway.estimation.{name}": f"steerway.estimation.course.{name}" for name in _COURSE.split()}
    | {f"steerway.estimation.{old}": f"steerway.estimation.course.{new}" for old, new in _RENAMED.items()}
    | {
        "steerway.estimation.linear_algebra": "steerway.core.linear_algebra",
        "steerway.estimation.heading.h_infinity": "steerway_studies.springer_mission.h_infinity",
        "steerway.estimation.heading.interval.literal": "steerway_studies.papers.interval_filter",
        "steerway.guidance.leg": "steerway.core.leg",
        "steerway.cli": "steerway.commands.cli",
        "steerway.vessels.kinematics": "steerway.core.kinematics",
        "steerway.simulation.demo": "steerway.commands.demo",
        "steerway.simulation.run_figures": "steerway.simulation.runs.figures",
        "steerway.simulation.run_files": "steerway.simulation.runs.files",
        "steerway.simulation.run_page": "steerway.simulation.runs.page",
        "steerway.simulation.summary": "steerway.simulation.runs.campaign",
        "steerway.live.clock": "steerway.live.base.clock",
        "steerway.live.decoding": "steerway.live.links.decoding",
        "steerway.live.heard": "steerway.live.base.rows",
        "steerway.live.links.foxglove": "steerway.live.outputs.foxglove",
        "steerway.live.links.mavlink": "steerway.live.mavlink.link",
        "steerway.live.uri": "steerway.live.base.uri",
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

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        return None if present_name(fullname) is None else ModuleSpec(fullname, self)

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        new = present_name(spec.name) or spec.name
        warnings.warn(f"{spec.name} is now {new}", FutureWarning, stacklevel=2)
        module = import_module(new)
        for name in [each for each in sys.modules if each.startswith(f"{new}.")]:
            sys.modules.setdefault(spec.name + name[len(new) :], sys.modules[name])
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Nothing runs a second time; the import system has replaced the module's own specification."""
        module.__spec__ = module.__spec__.loader_state if module.__spec__ else None


def redirect_moved_modules() -> None:
    """Make the old names importable."""
    if not any(isinstance(finder, _MovedModules) for finder in sys.meta_path):
        sys.meta_path.insert(0, _MovedModules())


def formerly(old: str, function: Callable[P, R]) -> Callable[P, R]:
    """A method under an old name: the same, with one line of warning."""

    @functools.wraps(function)
    def renamed(*args: P.args, **kwargs: P.kwargs) -> R:
        warnings.warn(f"{old} is now {function.__qualname__}", FutureWarning, stacklevel=2)
        return function(*args, **kwargs)

    return renamed


def renamed_argument(old: str, new: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """For a function whose argument `old` is now `new`: takes either by name."""

    def decorator(function: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(function)
        def taking_either(*args: P.args, **kwargs: P.kwargs) -> R:
            if old in kwargs:
                warnings.warn(f"the argument {old} is now {new}", FutureWarning, stacklevel=2)
                kwargs[new] = kwargs.pop(old)
            return function(*args, **kwargs)

        return taking_either

    return decorator
