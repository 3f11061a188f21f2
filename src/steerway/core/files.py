"""Output files that are complete or absent."""

import contextlib
import errno
import os
import re
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from steerway.core.errors import InputError

unfinished: set[Path] = set()
"""The files being written, for `remove_unfinished`."""


@contextlib.contextmanager
def complete_or_absent(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """A binary file that replaces `path` when the block ends, and is removed when it raises.

    It is written under another name in the same directory, and its contents are on the disk before it is renamed. A
    file that is replaced keeps its permissions. A symbolic link is followed; a device or pipe is written to directly.
    Raises InputError if the file cannot be written, also on a full disk.
    """
    target = Path(os.path.realpath(path))
    try:
        if target.is_symlink():
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
        if target.exists() and not target.is_file():
            with open(target, "wb") as file:
                yield file
            return
        beside = target.with_name(f".{target.name[:200]}.{os.getpid()}.part")
        unfinished.add(beside)
        try:
            with open(beside, "wb") as file:
                if target.exists():
                    os.chmod(beside, stat.S_IMODE(target.stat().st_mode))
                yield file
                file.flush()
                os.fsync(file.fileno())
            os.replace(beside, target)
        except BaseException:
            beside.unlink(missing_ok=True)
            raise
        finally:
            unfinished.discard(beside)
    except Exception as error:
        if (refused := _of_the_system(error)) is None:
            raise
        raise cannot_write(path, refused) from error


def made_directory(path: str | os.PathLike[str]) -> Path:
    """The directory, made if it is missing. Raises InputError if it cannot be made."""
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(path, error) from error
    return Path(path)


def cannot_write(path: str | os.PathLike[str], error: OSError) -> InputError:
    """The InputError for an output that the operating system refuses."""
    return InputError(f"cannot write {os.fspath(path)!r}: {error.strerror or error}")


def _of_the_system(error: Exception) -> OSError | None:
    """The operating system's error behind an exception, or None: polars quotes it in the text of its own exception."""
    if given := re.search(r"\(os error ([0-9]+)\)", str(error)):
        return OSError(int(given[1]), os.strerror(int(given[1])))
    return error if isinstance(error, OSError) else None


def remove_unfinished() -> None:
    """Remove all files being written; called when the process ends without unwinding."""
    for each in list(unfinished):
        with contextlib.suppress(OSError):
            each.unlink()
