"""What every link shares: an input and a sink, bytes into a decoder, and reopening after a failure."""

import asyncio
import errno
import logging
import math
from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable
from typing import Generic, Protocol, TypeVar

from steerway.core.errors import InputError
from steerway.live.links.decoding import Decoder
from steerway.live.rows import InputRow
from steerway.live.uri import Uri

LOG = logging.getLogger("steerway.live")
SILENCE = 0.05
"""s without a byte after which an epoch is complete."""
RETRY = 1.0
"""s from the failure of a link to the next attempt."""
WAITING = 1000
"""Messages that may wait for a link to open or a file to be written."""

Deliver = Callable[..., None]
"""Takes a list of InputRow, and the arrival of the last of them where that was not just now (s, event loop's clock)."""

Tap = Callable[[bytes], None]
"""Gets the bytes of a link as they come."""


D = TypeVar("D", bound=Decoder)


class Feed(Generic[D]):
    """Feeds a decoder and delivers the rows that it makes."""

    def __init__(self, decoder: D, deliver: Deliver, tap: Tap | None = None):
        self.decoder, self._deliver, self._tap = decoder, deliver, tap
        self._timer: asyncio.TimerHandle | None = None
        self._arrived = math.nan
        self._has_failed = False

    def feed(self, data: bytes) -> None:
        """A piece of the stream has come."""
        if self._tap is not None:
            self._tap(data)
        rows: list[InputRow] = []
        try:
            rows = self.decoder.feed(data)
        except Exception:  # nothing that a link sends ends the service
            if not self._has_failed:
                LOG.exception("%s bytes of a link cannot be decoded and are dropped", len(data))
            self._has_failed = True
        self.deliver(rows)

    def deliver(self, rows: list[InputRow]) -> None:
        """Deliver complete rows; incomplete ones follow when nothing comes for `SILENCE`."""
        if rows:
            self._deliver(rows)
        if self._timer is not None:
            self._timer.cancel()
        loop = asyncio.get_running_loop()
        self._arrived = loop.time()
        self._timer = loop.call_later(SILENCE, self.complete_on_silence)

    def complete_on_silence(self) -> None:
        """The link is silent."""
        rows = self.decoder.complete_on_silence()
        if rows:
            self._deliver(rows, self._arrived)


class Input(ABC, Generic[D]):
    """A link that is read. `place` is appended to the names of its sources where there are several links."""

    def __init__(self, uri: Uri, place: str = ""):
        self.uri, self.place = uri, place
        self.tap: Tap | None = None

    async def run(self, deliver: Deliver) -> None:
        """Read until cancelled."""
        feed = Feed(self._decoder(), deliver, self.tap)
        try:
            await kept_open(self.uri.text, lambda: self._read(feed))
        finally:
            feed.complete_on_silence()

    @abstractmethod
    def _decoder(self) -> D:
        """A decoder for what comes."""

    @abstractmethod
    async def _read(self, feed: Feed[D]) -> None:
        """Open the link and feed what comes, until it ends."""


class Reads(Protocol):
    """What is run as an input: an `Input`, or a device that writes too."""

    async def run(self, deliver: Deliver) -> None: ...


class Runs(Protocol):
    """What is run beside the service until cancelled: a `Sink`, a device, a page."""

    async def run(self) -> None: ...


class Sink(ABC):
    """A link that is written to. It never waits for a peer: one that is too slow loses whole messages, counted in
    `lost`."""

    def __init__(self, uri: Uri | None):
        self.uri = uri
        self.lost = 0

    async def run(self) -> None:  # noqa: B027
        """Keep the link open until cancelled."""

    @abstractmethod
    def send(self, message: bytes) -> None:
        """Write a whole message, or lose it."""

    def close(self) -> None:  # noqa: B027
        """Nothing more will be written."""


async def kept_open(name: str, attempt: Callable[[], Awaitable[None]]) -> None:
    """Open a link again and again; of equal failures in a row only the first is logged.

    Raises InputError where a port of this computer is in use by another program from the start.
    """
    logged = ""
    while True:
        try:
            await attempt()
            why = "closed by the other side"
        except (OSError, EOFError) as error:
            if not logged and isinstance(error, OSError) and error.errno == errno.EADDRINUSE:
                raise InputError(f"{name}: the port is in use by another program, expected a free one") from None
            why = error.strerror if isinstance(error, OSError) and error.strerror else str(error) or "closed"
        if why != logged:
            LOG.warning("%s: %s; trying again every %g s", name, why, RETRY)
            logged = why
        await asyncio.sleep(RETRY)
