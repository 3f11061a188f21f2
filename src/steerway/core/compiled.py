"""Compilation: `@kernel` and its variants are numba's njit, with a file cache keyed by all sources of a kernel."""

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
    """Use a module's cache directory without numba's subpath: its name already contains a digest of the sources."""

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
        """Do nothing."""


event.register("numba:compile", _Announcement())

_COLLECTED_AFTER = 100_000
"""Threshold of the garbage collector, in objects, while kernels are compiled. numba makes millions of lasting objects;
with Python's threshold of 700, scanning them takes a twentieth of the compilation time. Memory use is the same."""
_ROOM = 33_000
"""Declared frame size (words) of the function that compiles. It makes CPython allocate a large stack chunk: the chunk
is doubled from 16 kB until the frame and 8 kB fit. Without room left in the chunk, each call deep inside numba maps and
unmaps memory, which takes up to a third of the compilation time."""


def kernel(function: F) -> F:
    """Compile `function` on first call, releasing the interpreter lock while it runs."""
    return _compiled(function, nogil=True)


def lean_kernel(function: F) -> F:
    """A `kernel` for the innermost loops, which neither makes nor returns an array.

    It does not count references to its array arguments and is inlined into its callers. If small arrays pass through a
    chain of calls, counting and calling cost more than the arithmetic. A product and a sum may be rounded once,
    as one operation. Called from Python it keeps the interpreter lock, since releasing it takes longer than the call.
    """
    return _compiled(function, _nrt=False, forceinline=True, fastmath={"contract"})


def called_kernel(function: F, **options: Any) -> F:
    """A larger `lean_kernel` that is called, not inlined: this saves compilation time if the call's time is negligible.

    Sums may be reordered, so that loops over rows of a matrix become vector instructions.
    """
    return _compiled(function, _nrt=False, nogil=True, fastmath={"contract", "reassoc"}, **options)


def inlined_kernel(function: F) -> F:
    """A `called_kernel` that is inlined into its few callers.

    LLVM optimises a function's callees again for every caller. If a thin function stands between a loop over rows and
    large kernels, these are compiled once more (16 % of the compilation of a run over a record by structures).
    """
    return called_kernel(function, inline="always")


def jitable(function: F) -> F:
    """A Python function that kernels can call too: it is inlined into them."""
    return register_jitable(inline="always", error_model="numpy", no_cfunc_wrapper=True)(function)


def _compiled(function: F, **options: Any) -> F:
    options |= {
        "error_model": "numpy",
        "no_cfunc_wrapper": True,
    }  # only C calls this wrapper; it takes a tenth of the time
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
    """numba's dispatcher of a function, with its cache in this directory."""
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
    """Let one of several processes compile a kernel, and the others load it. On a full disk each compiles its own."""
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
    """Run the garbage collector less often within the block."""
    youngest, *older = gc.get_threshold()
    gc.set_threshold(youngest and max(youngest, _COLLECTED_AFTER), *older)
    try:
        yield
    finally:
        gc.set_threshold(youngest, *older)


def _callers_first(libraries: list[Any]) -> list[Any]:
    """Each library once, after all libraries that call it: LLVM drops linked code that nothing calls yet."""
    return list(dict.fromkeys(reversed(libraries)))[::-1]


class _KernelLibrary(JITCodeLibrary):
    """The code of a kernel that Python calls, including all its parts."""

    def finalize(self) -> None:
        self._linking_libraries = _callers_first(self._linking_libraries)
        super().finalize()  # type: ignore[no-untyped-call]

    def _finalize_final_module(self) -> None:
        """Link the parts. Raises RuntimeError if one is missing, because a call of it would crash the process."""
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
    """The code of a lean or called kernel for its callers: not optimised, and without the code of its own callees.

    numba would optimise it with its callees, make machine code and a wrapper for Python, and repeat all this in each
    caller. Here the kernel that Python calls links every part once, and is optimised as a whole.
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
    """Register a compiled part for its callers: by a key in place of an address, with the libraries that it links."""
    key, library = object(), compiled.library
    linked = _callers_first([library, *library._linking_libraries])
    compiled.target_context.insert_user_function(key, compiled.fndesc, linked)
    dispatcher.overloads[tuple(compiled.signature.args)] = compiled._replace(entry_point=key)
