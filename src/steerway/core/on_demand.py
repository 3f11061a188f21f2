"""Public names of a package, loaded when first asked for: importing the package loads none of its modules."""

import ast
import pkgutil
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from importlib.util import find_spec


def on_demand(package: str) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` (PEP 562) for the `__init__` of a package.

    The `__init__` imports its public names under `if TYPE_CHECKING`, where editors and type checkers see them, and
    lists them in `__all__`. Here the same lines say, at run time, which module a name comes from. Modules of the
    package load as attributes too, and are not listed.
    """

    def load(name: str) -> object:
        if name in _homes(package):
            module, name_there = _homes(package)[name]
            value = getattr(import_module(module), name_there)
            setattr(sys.modules[package], name, value)
            return value
        if not name.startswith("_") and find_spec(f"{package}.{name}") is not None:
            return import_module(f"{package}.{name}")
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return load, lambda: sorted(sys.modules[package].__all__)


@cache
def _homes(package: str) -> dict[str, tuple[str, str]]:
    """Public name → its module and its name there, from the source of the package's `__init__`."""
    homes: dict[str, tuple[str, str]] = {}
    for block in ast.parse(pkgutil.get_data(package, "__init__.py") or b"").body:
        for line in block.body if isinstance(block, ast.If) else ():
            if isinstance(line, ast.ImportFrom) and line.module:
                homes |= {alias.asname or alias.name: (line.module, alias.name) for alias in line.names}
    return homes
