"""The one way this package compiles: `@kernel` is njit with a file cache that knows what a kernel depends on."""

import contextlib
import functools
import gc
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import numba
import numba.core.config
from numba.core import event
from numba.core.caching import UserProvidedCacheLocator
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
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

_COLLECTED_AFTER = 100_000
"""Objects after which the garbage collector looks for cycles while kernels are compiled. numba makes millions that
stay; with Python's 700 a twentieth of the time goes into looking at them. Chosen: no more memory is used."""
_ROOM = 33_000
"""Words of a frame behind which CPython has as many left (it doubles 16 kB until a frame and 8 kB fit). It maps and
unmaps memory at every call that leaves the room left behind a frame; as deeply as numba calls, in a loop by chance,
that takes up to a third of the time of compilation."""


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
    dispatcher: Any = _dispatcher(function, directory, options | {"pipeline_class": _KernelCompiler})
    if hasattr(dispatcher, "overloads") and "_nrt" in options and "inline" not in options:
        options |= {"pipeline_class": _PartCompiler, "no_cpython_wrapper": True}
        part: Any = numba.njit(**options)(function)
        part.add_overload = functools.partial(_add_part, part)
        dispatcher.get_call_template, dispatcher.get_overload = part.get_call_template, part.get_overload
    return dispatcher


def _dispatcher(function: Any, directory: Path | None, options: dict[str, Any]) -> Any:
    """numba's dispatcher of a function, which keeps what it compiles in this directory."""
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
    """One of several processes compiles a kernel, and the others load it; on a full disk each compiles its own."""
    compile_or_load, save = dispatcher.compile, dispatcher._cache.save_overload

    def compiled(signature: Any) -> Any:
        with global_compiler_lock, one_process(lock), _rare_collections():
            return compile_or_load(signature)

    compiled.__code__ = compiled.__code__.replace(co_stacksize=_ROOM)

    def kept(*overload: Any) -> None:
        with contextlib.suppress(OSError):
            save(*overload)

    dispatcher.compile, dispatcher._cache.save_overload = compiled, kept


@contextlib.contextmanager
def _rare_collections() -> Iterator[None]:
    """Let the garbage collector run more seldom within this."""
    youngest, *older = gc.get_threshold()
    gc.set_threshold(youngest and max(youngest, _COLLECTED_AFTER), *older)
    try:
        yield
    finally:
        gc.set_threshold(youngest, *older)


def _callers_first(libraries: list[Any]) -> list[Any]:
    """Each library once, after all whose code calls it: LLVM leaves out what nothing calls when it is linked."""
    return list(dict.fromkeys(reversed(libraries)))[::-1]


class _KernelLibrary(JITCodeLibrary):
    """The code of a kernel that Python calls, with that of all its parts."""

    def finalize(self) -> None:
        self._linking_libraries = _callers_first(self._linking_libraries)
        super().finalize()  # type: ignore[no-untyped-call]

    def _finalize_final_module(self) -> None:
        """Raises where a part is missing, whose call would end the process."""
        called = [each.name for each in self._final_module.functions if each.is_declaration]
        if missing := [name for name in called if name.startswith("_ZN")]:
            raise RuntimeError(f"a kernel is compiled without its parts {missing}")
        super()._finalize_final_module()  # type: ignore[no-untyped-call]


class _KernelCompiler(Compiler):
    """Compiles a kernel that Python calls."""

    def __init__(self, typing: Any, target: Any, _: Any, args: Any, returns: Any, flags: Any, local: Any):
        library = _KernelLibrary(target.codegen(), "kernel")  # type: ignore[no-untyped-call]
        library.enable_object_caching()  # type: ignore[no-untyped-call]
        super().__init__(typing, target, library, args, returns, flags, local)  # type: ignore[no-untyped-call]


class _PartLibrary(JITCodeLibrary):
    """The code of a lean or called kernel for those that call it: as it is, without that of what it calls itself.

    numba would optimise it with all below it, make machine code of it and a wrapper for Python, and do all that again
    within each caller. The kernel that Python calls links every part below it once, and is optimised as a whole.
    """

    def finalize(self) -> None:
        self._finalize_dynamic_globals()  # type: ignore[no-untyped-call]
        self._finalized = True


class _PartCompiler(Compiler):
    """Compiles a kernel as a part of others."""

    def __init__(self, typing: Any, target: Any, _: Any, args: Any, returns: Any, flags: Any, local: Any):
        flags.no_compile = True
        library = _PartLibrary(target.codegen(), "part")  # type: ignore[no-untyped-call]
        super().__init__(typing, target, library, args, returns, flags, local)  # type: ignore[no-untyped-call]


def _add_part(dispatcher: Any, compiled: Any) -> None:
    """Make a compiled part known to its callers: by a key in place of an address, with all that it links itself."""
    key, library = object(), compiled.library
    linked = _callers_first([library, *library._linking_libraries])
    compiled.target_context.insert_user_function(key, compiled.fndesc, linked)
    dispatcher.overloads[tuple(compiled.signature.args)] = compiled._replace(entry_point=key)
