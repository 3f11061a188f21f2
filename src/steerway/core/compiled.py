"""The one way this package compiles: `@kernel` is njit with a file cache that knows what a kernel depends on."""

import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
import numba.core.config
from numba.core import event
from numba.core.caching import UserProvidedCacheLocator
from numba.core.compiler_lock import global_compiler_lock
from numba.extending import register_jitable

from steerway.core import compiling
from steerway.core.kernel_cache import module_directory
from steerway.core.locks import one_process

config: Any = numba.core.config  # sets its attributes at run time
F = TypeVar("F", bound=Callable[..., Any])
"""A kernel has the signature of its function: numba's dispatcher is called in the same way."""


class Locator(UserProvidedCacheLocator):
    """The directory of a module as it is: its name tells sources apart, wherever the package is installed."""

    @classmethod
    def get_suitable_cache_subpath(cls, _: str) -> str:
        return ""


class _Announcement(event.Listener):
    """Calls `compiling.announce` when the first compilation of the process begins."""

    def on_start(self, _: Any) -> None:
        announce, compiling.announce = compiling.announce, None
        if announce is not None:
            announce()

    def on_end(self, _: Any) -> None:
        """Nothing."""


event.register("numba:compile", _Announcement())


def kernel(function: F) -> F:
    """Compile `function` on first call, releasing the interpreter lock while it runs."""
    return _compiled(function, nogil=True)


def lean_kernel(function: F) -> F:
    """A `kernel` for the innermost loops, that neither makes nor returns an array.

    It does not count references to its array arguments and is inlined into its callers: in a chain of calls that pass
    small arrays on, both cost more than the arithmetic. A product and a sum may round once. Called from Python it keeps
    the interpreter lock, since releasing it takes longer than the call.
    """
    return _compiled(function, _nrt=False, forceinline=True, fastmath={"contract"})


def called_kernel(function: F, **options: Any) -> F:
    """A larger `lean_kernel` that stays a call: where the time of a call does not count, it saves that of compilation.

    Sums may be taken in another order, so that loops over rows of a matrix become vector instructions.
    """
    return _compiled(function, _nrt=False, nogil=True, fastmath={"contract", "reassoc"}, **options)


def inlined_kernel(function: F) -> F:
    """A `called_kernel` whose few callers compile it as a part of themselves.

    LLVM optimises what a function calls again with every caller: between large kernels and one loop over rows, a thin
    level in between costs a compilation of all below it (run over a record by structures: 16 % of the whole).
    """
    return called_kernel(function, inline="always")


def jitable(function: F) -> F:
    """A function as it is, which kernels can call too: they compile it as a part of themselves."""
    return register_jitable(inline="always", error_model="numpy", no_cfunc_wrapper=True)(function)


def _compiled(function: F, **options: Any) -> F:
    options |= {"error_model": "numpy", "no_cfunc_wrapper": True}  # which only C would call: a tenth of the time
    variant = f"-numba{numba.__version__}" + ("-bounds" if config.BOUNDSCHECK else "")
    directory = module_directory(function.__module__, variant)
    if directory is None:
        return numba.njit(**options)(function)
    users_settings = config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES
    config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = str(directory), f"{__name__}.{Locator.__name__}"
    try:
        dispatcher = numba.njit(cache=True, **options)(function)
    finally:
        config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = users_settings
    if hasattr(dispatcher, "_cache"):  # else compilation is switched off
        _keep(dispatcher, directory / f"{function.__name__}.lock")
    return dispatcher


def _keep(dispatcher: Any, lock: Path) -> None:
    """Of several processes one compiles a kernel, and the others load it; on a full disk each compiles its own."""
    compile_or_load, save = dispatcher.compile, dispatcher._cache.save_overload

    def compiled(signature: Any) -> Any:
        with global_compiler_lock, one_process(lock):
            return compile_or_load(signature)

    def kept(*overload: Any) -> None:
        with contextlib.suppress(OSError):
            save(*overload)

    dispatcher.compile, dispatcher._cache.save_overload = compiled, kept
