"""Ctrl-C, SIGTERM and a closed terminal end the command at once, with one line of output.

A signal wakes a thread, which ends the process: compiled code may not return to the interpreter for minutes, so that
Python's own handlers would run late. Nothing needs to be unwound: unfinished files are removed here, finished parts are
on the disk, and workers end with their parent.
"""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from steerway.core import files

SIGNALS = {
    getattr(signal, name): word
    for name, word in (("SIGINT", "interrupted"), ("SIGTERM", "terminated"), ("SIGHUP", "terminal closed"))
    if hasattr(signal, name)
}
_SHOW_CURSOR = "\r\x1b[K\x1b[?25h"  # progress bars hide the cursor
note = ""
"""Rest of the line printed at an interruption: which work is kept and how to continue it."""
_received = threading.Event()


def keep(what: str, directory: object) -> None:
    """Set `note`: `what` is kept in the directory, and --resume continues."""
    global note
    note = f"{what} are kept in {directory}; --resume continues"


def end(number: int = signal.SIGINT) -> None:
    """End the process: one line, exit code 128 + signal (130 for Ctrl-C)."""
    files.remove_unfinished()
    line = f"steerway: {SIGNALS[number]}{note and f', {note}'}\n"
    try:
        os.write(2, ((_SHOW_CURSOR if os.isatty(2) else "") + line).encode())  # the stream may be locked
    finally:
        os._exit(128 + number)


@contextmanager
def handled() -> Iterator[None]:
    """Handle the `SIGNALS` within the block. A signal that is ignored (nohup) stays ignored. Main thread only."""
    before = {each: signal.getsignal(each) for each in SIGNALS}
    woken, wake = os.pipe()
    os.set_blocking(wake, False)
    for each, handler in before.items():
        if handler is not signal.SIG_IGN:
            signal.signal(each, _wake)
    signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
    threading.Thread(target=_watch, args=(woken,), daemon=True).start()
    try:
        yield
    finally:
        if _received.is_set():
            threading.Event().wait()  # until the thread ends the process
        signal.set_wakeup_fd(-1)
        for each, handler in before.items():
            signal.signal(each, handler)
        os.close(wake)


def _wake(*_: object) -> None:
    _received.set()  # the signal's number is in the pipe


def _watch(woken: int) -> None:
    while numbers := os.read(woken, 64):
        for number in numbers:
            if number in SIGNALS and signal.getsignal(number) is _wake:
                end(number)
    os.close(woken)
