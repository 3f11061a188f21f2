"""An event loop that never waits: when there is nothing to read, its clock jumps to the next event.

Sockets on this machine pass data on at once. So services and links run as usual, but without pauses, and a minute of
silence takes only the time of its computations.
"""

import asyncio
import selectors
import time
from unittest import mock


class _Selector(selectors.DefaultSelector):
    ahead = 0.0

    def select(self, timeout=None):
        ready = super().select(0.0)
        if ready or timeout is None or timeout <= 0.0:
            return ready or super().select(timeout)
        self.ahead += timeout
        return super().select(0.0)


class HastenedLoop(asyncio.SelectorEventLoop):
    """An event loop on a virtual clock that begins at 0."""

    def __init__(self):
        self.hastened = _Selector()
        super().__init__(self.hastened)

    def time(self) -> float:
        """Virtual time since the loop began, s."""
        return self.hastened.ahead


def run(work, start=None):
    """`asyncio.run` on a hastened loop, which also drives `time.time` (from `start`, Unix) and `time.monotonic`."""
    begun = time.time() if start is None else start
    with asyncio.Runner(loop_factory=HastenedLoop) as runner:
        now = runner.get_loop().time
        with mock.patch("time.monotonic", now), mock.patch("time.time", lambda: begun + now()):
            return runner.run(work)
