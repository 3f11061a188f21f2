"""The extras of this package: which optional packages each installs, and how to install it."""

import importlib.util
import sys

from steerway.core.errors import InputError

EXTRAS = {
    "report": ("matplotlib", "bokeh"),
    "live": ("websockets",),
    "helm": ("nicegui",),
    "mavlink": ("pymavlink",),
    "n2k": ("can",),
    "foxglove": ("foxglove",),
    "mcap": ("mcap",),
    "logs": ("fitdecode", "pyulog"),
    "archive": ("zstandard",),
    "identify": ("scipy",),
    "mpc": ("daqp",),
    "dask": ("distributed", "dask"),
    "studies": ("sklearn",),
}
"""Extra → modules of its packages, except those that an extra above it already lists."""


def install(extra: str) -> str:
    """The command that installs an extra."""
    return f"pip install '.[{extra}]' in a clone of steerway"


def missing(what: str, package: str, extra: str) -> InputError:
    """The error for `what`, which needs a package that is not installed."""
    return InputError(f"{what} needs the package {package}, expected {install(extra)}")


def is_installed(extra: str) -> bool:
    """Whether all packages of an extra are installed."""
    return not any(_absent(module) for module in EXTRAS[extra])


def require(what: str, extra: str) -> None:
    """Raises InputError if a package of an extra, which `what` needs, is not installed."""
    for module in filter(_absent, EXTRAS[extra]):
        raise missing(what, module, extra)


def _absent(module: str) -> bool:
    return (module in sys.modules and sys.modules[module] is None) or importlib.util.find_spec(module) is None


def extra_of(module: str) -> str | None:
    """The extra that installs a module; None for a module of the core."""
    return next((extra for extra, modules in EXTRAS.items() if module in modules), None)
