"""Lazy names of a package or of its `testing` module: importing it loads no other module until a name is used."""

import ast
import pkgutil
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from_above: dict[str, Callable[..., Any]] = {}
"""Functions that core calls but a package above it defines. The package root adds them."""


def on_demand(module: str) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` (PEP 562) for a package or another module that only lists names.

    The module imports its names under `if TYPE_CHECKING`, for editors and type checkers. At run time these lines are
    parsed to find where a name comes from. Modules of a package load as attributes too, but are not listed.
    """

    def load(name: str) -> object:
        if name in _homes(module):
            home, name_there = _homes(module)[name]
            value = _imported(home, name_there)
            setattr(sys.modules[module], name, value)
            return value
        if not name.startswith("_") and _is_module(module, name):
            return import_module(f"{module}.{name}")
        raise AttributeError(f"module {module!r} has no attribute {name!r}")

    return load, lambda: sorted(_homes(module))


def _imported(home: str, name: str) -> object:
    """The object that `from home import name` would bind."""
    return import_module(f"{home}.{name}") if _is_module(home, name) else getattr(import_module(home), name)


def _is_module(package: str, name: str) -> bool:
    return hasattr(import_module(package), "__path__") and find_spec(f"{package}.{name}") is not None


@cache
def _homes(module: str) -> dict[str, tuple[str, str]]:
    """Listed name → its module and its name there, parsed from the source of the module that lists it."""
    homes: dict[str, tuple[str, str]] = {}
    source = pkgutil.get_data(module, Path(sys.modules[module].__file__ or "").name) or b""
    for block in ast.parse(source).body:
        for line in block.body if isinstance(block, ast.If) else ():
            if isinstance(line, ast.ImportFrom) and line.module:
                homes |= {alias.asname or alias.name: (line.module, alias.name) for alias in line.names}
    return homes
