"""Locks between processes: the operating system ends a lock with its process, so that a killed one leaves none.

Where files cannot be locked (Windows, some network file systems) nothing is held.
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

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

_LONGEST_WAIT = 120.0
"""s for another process. Chosen: four times what the largest kernel takes with all that it calls."""


@contextlib.contextmanager
def one_process(path: Path) -> Iterator[None]:
    """Wait until no other process is within this for the same `path`; not for ever, nor where files are not locked."""
    with contextlib.ExitStack() as stack:
        with contextlib.suppress(OSError):
            file = stack.enter_context(path.open("ab"))
            until = time.monotonic() + _LONGEST_WAIT
            while held_elsewhere(file) and time.monotonic() < until:
                time.sleep(0.02)
        yield


@contextlib.contextmanager
def only_writer(path: Path, what: str) -> Iterator[None]:
    """Hold the lock file `path` while the block writes `what`; the file says which process holds it and since when.

    Raises InputError, with what the file says, if another process holds it or if the file cannot be written.
    """
    with contextlib.ExitStack() as stack:
        try:
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
            raise InputError(f"cannot write {str(path)!r}: {error.strerror or error}") from error
        yield


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
