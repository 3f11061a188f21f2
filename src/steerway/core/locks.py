"""Locks between processes. The operating system releases a lock when its process ends, even if it was killed.

If files cannot be locked (Windows, some network file systems), nothing is locked.
"""

import contextlib
import datetime
import os
import platform
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from steerway.core.errors import InputError
from steerway.core.files import cannot_write, made_directory, unfinished

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

LOCK = ".lock"
_LONGEST_WAIT = 120.0
"""Longest wait for another process, s: four times the compilation time of the largest kernel and its callees."""


@contextlib.contextmanager
def one_process(path: Path) -> Iterator[None]:
    """Wait, at most `_LONGEST_WAIT`, until no other process is in such a block with the same `path`."""
    with contextlib.ExitStack() as stack:
        with contextlib.suppress(OSError):
            file = stack.enter_context(path.open("ab"))
            until = time.monotonic() + _LONGEST_WAIT
            while held_elsewhere(file) and time.monotonic() < until:
                time.sleep(0.02)
        yield


@contextlib.contextmanager
def only_writer(directory: str | os.PathLike[str], what: str) -> Iterator[Path]:
    """Reserve a directory, made if it is missing, for this process while the block writes `what` into it.

    A file `LOCK` in it names the writing process and when it began; a file left by a killed process is taken over.
    Raises InputError if another process holds the directory (with the text of `LOCK`), or if it cannot be written.
    """
    path = made_directory(directory) / LOCK
    with contextlib.ExitStack() as stack:
        try:
            file = stack.enter_context(path.open("a+b"))
            while not held_elsewhere(file) and not _is(path, file):  # meanwhile its holder has ended and removed it
                file = stack.enter_context(path.open("a+b"))
            if held_elsewhere(file):
                file.seek(0)
                holder = file.read(200).decode(errors="replace").strip() or "another process"
                raise InputError(f"{what} is being written by {holder}, expected no other writer: wait until it ends")
            now = datetime.datetime.now(datetime.UTC)
            file.truncate(0)
            file.write(f"process {os.getpid()} on {platform.node()} since {now:%Y-%m-%d %H:%M:%S} UTC\n".encode())
            file.flush()
        except OSError as error:
            raise cannot_write(path, error) from error
        unfinished.add(path)
        try:
            yield path.parent
        finally:
            unfinished.discard(path)
            with contextlib.suppress(OSError):
                path.unlink()


def _is(path: Path, file: IO[bytes]) -> bool:
    """Whether a path still names this open file."""
    try:
        return os.path.samestat(os.stat(path), os.fstat(file.fileno()))
    except FileNotFoundError:
        return False


def held_elsewhere(file: IO[bytes]) -> bool:
    """Whether another process has locked a file. If not, this process holds the lock until the file is closed."""
    if fcntl is None:
        return False
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:  # a file system without locks
        return False
    return False
