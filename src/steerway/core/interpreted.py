"""Kernels that the interpreter can run too: for short inputs compiling takes longer than it saves."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba.core.config
from numba.extending import register_jitable

config: Any = numba.core.config  # sets its attributes at run time
F = TypeVar("F", bound=Callable[..., Any])


def part_of_kernels(function: F) -> F:
    """A plain function that kernels may call: compiled into them, or interpreted with them."""
    return register_jitable(error_model="numpy")(function)


def without_compiling(kernel: F) -> F:
    """The Python function of a kernel."""
    return getattr(kernel, "py_func", kernel)


def is_compiled(kernel: Callable[..., Any]) -> bool:
    """Whether a kernel needs no compilation: this or an earlier process compiled it, or compilation is switched off."""
    dispatcher: Any = kernel
    if config.DISABLE_JIT or dispatcher.signatures:
        return True
    kept = dispatcher._cache.cache_path
    return kept is not None and any(Path(kept).glob(f"*{dispatcher.__name__}-*.nbi"))
