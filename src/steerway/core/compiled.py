"""The one way this package compiles: `@kernel` is numba's njit with a file cache that knows the whole package.

numba's own cache looks at the file of the compiled function only and would go on running the old code of a kernel it
calls in another file. Here the cache directory is keyed to every file that holds kernels, in this package and in the
one that the kernel belongs to, so that a change anywhere compiles anew. `STEERWAY_CACHE` moves the directory.
"""

import functools
import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, TypeVar

import numba
import numba.core.config
from numba.core import event

from steerway.core import compiling

config: Any = numba.core.config  # sets its attributes at run time
F = TypeVar("F", bound=Callable[..., Any])
"""A kernel has the signature of its function: numba's dispatcher is called in the same way."""
_KEPT_CACHES = 8
_OWN_FOLDER = Path(__file__).parents[1]


class _Announcement(event.Listener):
    """Calls `compiling.announce` when the first compilation of the process begins."""

    def on_start(self, _: Any) -> None:
        announce, compiling.announce = compiling.announce, None
        if announce is not None:
            announce()

    def on_end(self, _: Any) -> None:
        """Nothing."""


event.register("numba:compile", _Announcement())


def _kernel_source_digest(folders: Iterable[str | Path]) -> str:
    digest = hashlib.sha256()
    for folder in folders:
        for path in sorted(Path(folder).rglob("*.py")):
            source = path.read_bytes()
            if b"kernel" in source:
                digest.update(source)
    return digest.hexdigest()[:16]


@functools.cache
def cache_directory(package: str) -> Path | None:
    """Where the kernels of a top-level package are kept, or None where nothing can be written.

    Kernels compiled with bounds checks (`NUMBA_BOUNDSCHECK=1`) are kept apart: numba's own cache does not tell them
    from the others.
    """
    home = os.environ.get("STEERWAY_CACHE") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    root = Path(home) / "steerway"
    folders = {str(_OWN_FOLDER): None}  # in order, each once
    folders |= dict.fromkeys(getattr(sys.modules.get(package), "__path__", ()))
    checked = "-bounds" if config.BOUNDSCHECK else ""
    directory = root / f"kernels-{_kernel_source_digest(folders)}{checked}"
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=directory):
            os.utime(directory)
    except OSError:
        return None
    older = sorted(root.glob("kernels-*"), key=lambda each: each.stat().st_mtime, reverse=True)[_KEPT_CACHES:]
    for stale in older:
        shutil.rmtree(stale, ignore_errors=True)
    return directory


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


def called_kernel(function: F) -> F:
    """A larger `lean_kernel` that stays a call: where the time of a call does not count, it saves that of compilation.

    Sums may be taken in another order, so that loops over rows of a matrix become vector instructions.
    """
    return _compiled(function, _nrt=False, fastmath={"contract", "reassoc"})


def _compiled(function: F, **options: Any) -> F:
    options |= {"error_model": "numpy", "no_cfunc_wrapper": True}  # which only C would call: a tenth of the time
    directory = cache_directory(function.__module__.partition(".")[0])
    if directory is None:
        return numba.njit(**options)(function)
    users_directory = config.CACHE_DIR
    config.CACHE_DIR = str(directory)
    try:
        return numba.njit(cache=True, **options)(function)
    finally:
        config.CACHE_DIR = users_directory
