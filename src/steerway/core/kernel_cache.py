"""The directories of compiled kernels: one per module, keyed by the source that its kernels are compiled from.

numba's own cache checks only the file of the compiled function; it would run old code of kernels that are called in
other files. Here the key of a module is a digest of its file and of every file that it imports, directly or not. A
change therefore recompiles the kernels that depend on it, and no others.
"""

import functools
import hashlib
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

_PRODUCT = __name__.partition(".")[0]
_KEPT = 8
"""Number of versions kept per module: several installations may share the directory."""
_IMPORT = re.compile(r"^[ \t]*(?:from[ \t]+([\w.]+)[ \t]+import[ \t]+(\([^)]*\)|[^\n#]+)|import[ \t]+([^\n#]+))", re.M)


@functools.cache
def kernel_cache() -> Path | None:
    """The directory of all compiled kernels, or None if it cannot be written; `STEERWAY_CACHE` moves it."""
    home = os.environ.get("STEERWAY_CACHE") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    directory = Path(home) / "steerway" / "kernels"
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=directory):
            return directory
    except OSError:
        return None


@functools.cache
def module_directory(module: str, variant: str) -> Path | None:
    """The directory of the kernels of a module, or None if it cannot be written.

    `variant` names process options that numba's own cache does not distinguish; "" for the defaults.
    """
    root = kernel_cache()
    if root is None:
        return None
    versions = root / module
    directory = versions / (source_digest(module) + variant)
    try:
        if not directory.exists():
            directory.mkdir(parents=True, exist_ok=True)
            newest_first = sorted(versions.iterdir(), key=lambda each: each.stat().st_mtime, reverse=True)
            for stale in newest_first[_KEPT:]:
                shutil.rmtree(stale, ignore_errors=True)
        os.utime(directory)
    except OSError:
        return None
    return directory


def source_digest(module: str) -> str:
    """A digest of the sources of `module` and of all modules that it imports from its own package and this one."""
    packages = {_PRODUCT, module.partition(".")[0]}
    found: dict[str, str] = {}
    to_read = [module]
    while to_read:
        name = to_read.pop()
        if name in found or name.partition(".")[0] not in packages:
            continue
        found[name], imported = _source(name)
        to_read += imported
    digest = hashlib.sha256()
    for _, source in sorted(found.items()):
        digest.update(source.encode())
    return digest.hexdigest()[:16]


@functools.cache
def _source(module: str) -> tuple[str, tuple[str, ...]]:
    """The source of a module and the names it imports; both empty for a module without a file."""
    file = _file(module)
    if file is None:
        return "", ()
    source = file.read_text(encoding="utf-8")
    if module == f"{_PRODUCT}.core.compiled":
        return source, ()  # the decorators: their imports are not compiled
    package = module if file.name == "__init__.py" else module.rpartition(".")[0]
    imported = []
    for origin, names, modules in _IMPORT.findall(source):
        if modules:
            imported += [each.split()[0] for each in modules.split(",") if each.split()]
            continue
        origin = _absolute(origin, package)
        for name in re.findall(r"(\w+)(?:[ \t]+as[ \t]+\w+)?", names):
            submodule = f"{origin}.{name}"
            imported.append(submodule if _file(submodule) else origin)
    return source, tuple(imported)


def _absolute(origin: str, package: str) -> str:
    """The full name of `origin`, which may begin with dots, in a module of `package`."""
    dots = len(origin) - len(origin.lstrip("."))
    if dots == 0:
        return origin
    parents = package.split(".")[: len(package.split(".")) - dots + 1]
    return ".".join([*parents, *filter(None, [origin[dots:]])])


@functools.cache
def _file(module: str) -> Path | None:
    top, _, rest = module.partition(".")
    for folder in getattr(sys.modules.get(top), "__path__", ()):
        path = Path(folder, *rest.split(".")) if rest else Path(folder)
        for file in (path.with_suffix(".py"), path / "__init__.py"):
            if file.is_file():
                return file
    own = getattr(sys.modules.get(module), "__file__", None)
    return Path(own) if own and own.endswith(".py") else None
