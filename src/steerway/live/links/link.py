"""Base classes of links: input and sink; feeding a decoder; reopening after a failure."""

import asyncio
import errno
import math
from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable
from typing import Generic, Protocol, TypeVar

from steerway.core.errors import InputError
from steerway.live.links.decoding import Decoder
from steerway.live.rows import InputRow
from steerway.live.uri import LOG, Uri

SILENCE = 0.05
"""Time without a byte after which an epoch is complete, s."""
RETRY = 1.0
"""Time between the failure of a link and the next attempt to open it, s."""
WAITING = 1000
"""Largest number of messages that wait for a link to open or a file to be written."""

Deliver = Callable[..., None]
"""Takes a list of InputRow, and the last row's arrival (s, event loop's clock) unless it arrived just now."""

Tap = Callable[[bytes], None]
"""Receives the bytes of a link as they arrive."""


D = TypeVar("D", bound=Decoder)


class Feed(Generic[D]):
    """Feeds a decoder and delivers its rows."""

    def __init__(self, decoder: D, deliver: Deliver, tap: Tap | None = None):
        self.decoder, self._deliver, self._tap = decoder, deliver, tap
        self._timer: asyncio.TimerHandle | None = None
        self._arrived = math.nan
        self._has_failed = False

    def feed(self, data: bytes) -> None:
        """Decode the next piece of the stream."""
        if self._tap is not None:
            self._tap(data)
        rows: list[InputRow] = []
        try:
            rows = self.decoder.feed(data)
        except Exception:  # bad data from a link must not end the service
            if not self._has_failed:
                LOG.exception("%s bytes of a link cannot be decoded and are dropped", len(data))
            self._has_failed = True
        self.deliver(rows)

    def deliver(self, rows: list[InputRow]) -> None:
        """Deliver complete rows; incomplete ones follow after `SILENCE` without data."""
        if rows:
            self._deliver(rows)
        if self._timer is not None:
            self._timer.cancel()
        loop = asyncio.get_running_loop()
        self._arrived = loop.time()
        self._timer = loop.call_later(SILENCE, self.complete_on_silence)

    def complete_on_silence(self) -> None:
        """Deliver the rows of incomplete epochs: the link is silent."""
        rows = self.decoder.complete_on_silence()
        if rows:
            self._deliver(rows, self._arrived)


class Input(ABC, Generic[D]):
    """A link that is read. `place`, unless "", is appended to the names of its sources."""

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
        """A new decoder for the link's data."""

    @abstractmethod
    async def _read(self, feed: Feed[D]) -> None:
        """Open the link and feed its data until it ends."""


class Reads(Protocol):
    """Anything that runs as an input: an `Input`, or a device that also writes."""

    async def run(self, deliver: Deliver) -> None: ...


class Runs(Protocol):
    """Anything that runs beside the service until cancelled: a `Sink`, a device, a page."""

    async def run(self) -> None: ...


class Sink(ABC):
    """A link that is written to. It never waits: a peer that is too slow loses whole messages, counted in `lost`."""

    def __init__(self, uri: Uri | None):
        self.uri = uri
        self.lost = 0

    async def run(self) -> None:  # noqa: B027
        """Keep the link open until cancelled."""

    @abstractmethod
    def send(self, message: bytes) -> None:
        """Write a whole message or lose it."""

    def close(self) -> None:  # noqa: B027
        """End writing."""


async def kept_open(name: str, attempt: Callable[[], Awaitable[None]]) -> None:
    """Open a link, and reopen it after every failure. Only the first of several equal failures in a row is logged.

    Raises InputError if at the first attempt another program uses the link's port on this computer.
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
