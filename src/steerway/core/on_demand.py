"""Public names of a package, loaded when first asked for: importing the package loads none of its modules."""

import ast
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module


def on_demand(package: str) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` (PEP 562) for the `__init__` of a package.

    The `__init__` imports its public names under `if TYPE_CHECKING`, where editors and type checkers see them, and
    lists them in `__all__`. Here the same lines say, at run time, which module a name comes from.
    """

    def load(name):
        if name not in _homes(package):
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        module, name_there = _homes(package)[name]
        value = getattr(import_module(module), name_there)
        setattr(sys.modules[package], name, value)
        return value

    return load, lambda: sorted(sys.modules[package].__all__)


@cache
def _homes(package: str) -> dict[str, tuple[str, str]]:
    """Public name → its module and its name there, from the source of the package's `__init__`."""
    source = sys.modules[package].__spec__.loader.get_source(package)
    guarded = [each for block in ast.parse(source).body if isinstance(block, ast.If) for each in block.body]
    return {alias.asname or alias.name: (each.module, alias.name) for each in guarded for alias in each.names}
