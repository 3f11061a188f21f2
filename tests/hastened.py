"""An event loop without waiting: whenever nothing is to be read, its clock goes on to what is due next.

Sockets on this machine hand over at once what is written, so services and links run as they always do, only without the
pauses, and a minute of silence takes as long as what is done in it.
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
    """Its time begins at 0."""

    def __init__(self):
        self.hastened = _Selector()
        super().__init__(self.hastened)

    def time(self) -> float:
        """s since it began."""
        return self.hastened.ahead


def run(work, start=None):
    """`asyncio.run` on a hastened loop, whose time is also that of the clocks of `time`; `start` is Unix time."""
    begun = time.time() if start is None else start
    with asyncio.Runner(loop_factory=HastenedLoop) as runner:
        now = runner.get_loop().time
        with mock.patch("time.monotonic", now), mock.patch("time.time", lambda: begun + now()):
            return runner.run(work)
