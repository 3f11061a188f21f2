"""What every listener shares: bytes into a decoder, the epoch that waits until the link is silent, and trying again."""

import asyncio
import logging
import math
from collections.abc import Awaitable, Callable

from steerway.live.decoding import Decoder

LOG = logging.getLogger("steerway.live")
SILENCE = 0.05
"""s without a byte after which an epoch counts as told."""
RETRY = 1.0
"""s from a link's breaking to the next attempt."""

Hear = Callable[..., None]
"""Takes a list of Heard, and when the last of it arrived where that was not just now (s, the event loop's clock)."""


class Ear:
    """Feeds a decoder and passes on what it makes."""

    def __init__(self, decoder: Decoder, hear: Hear):
        self.decoder, self._hear = decoder, hear
        self._timer: asyncio.TimerHandle | None = None
        self._arrived = math.nan

    def feed(self, data: bytes) -> None:
        """A piece of the stream has come."""
        self.pass_on(self.decoder.feed(data))

    def pass_on(self, rows: list) -> None:
        """Rows that are told; what still waits is told when nothing comes for a while."""
        if rows:
            self._hear(rows)
        if self._timer is not None:
            self._timer.cancel()
        loop = asyncio.get_running_loop()
        self._arrived = loop.time()
        self._timer = loop.call_later(SILENCE, self.settle)

    def settle(self) -> None:
        """The link is silent."""
        rows = self.decoder.settle()
        if rows:
            self._hear(rows, self._arrived)


async def kept_open(name: str, attempt: Callable[[], Awaitable[None]]) -> None:
    """Open a link again and again; its failures are logged, each kind once until it was open again."""
    said = ""
    while True:
        try:
            await attempt()
            why = "closed by the other side"
        except (OSError, EOFError) as error:
            why = error.strerror if isinstance(error, OSError) and error.strerror else str(error) or "closed"
        if why != said:
            LOG.warning("%s: %s; trying again every %g s", name, why, RETRY)
            said = why
        await asyncio.sleep(RETRY)
