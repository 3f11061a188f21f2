"""Signal K deltas over a server's WebSocket, read and written."""

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from steerway.formats.signalk import DILUTION, PATHS, source_of, values_of
from steerway.live.links.decoding import JsonDecoder, moment
from steerway.live.links.link import WAITING, Feed, Input, Sink, kept_open
from steerway.live.rows import InputRow
from steerway.live.uri import Uri, secret_in

TOKENS = ("token", "token-file")
"""Options of an address for the server's token."""
SUBSCRIBED = ("navigation.position", DILUTION, *PATHS)
"""The Signal K paths that are read."""


def token_of(uri: Uri) -> str:
    """The token of an address, from its option `token` or the file of `token-file`; "" without either.

    Raises InputError for a file that cannot be read.
    """
    path = uri.options.get("token-file")
    return uri.options.get("token", "") if path is None else secret_in(path, "token-file")


@asynccontextmanager
async def connected(uri: Uri) -> AsyncIterator[Any]:
    """The WebSocket of a server's stream, without a subscription. Raises OSError on any failure, as other links do."""
    from websockets.asyncio.client import connect
    from websockets.exceptions import WebSocketException

    token = token_of(uri)
    headers = {"Authorization": f"Bearer {token}"} if token else {}
    host = f"[{uri.host}]" if ":" in uri.host else uri.host
    address = f"ws://{host}:{uri.port}/signalk/v1/stream?subscribe=none"
    try:
        async with connect(address, open_timeout=5.0, additional_headers=headers) as socket:
            yield socket
    except WebSocketException as error:
        raise ConnectionError(str(error)) from None


class SignalKInput(Input["SignalKDecoder"]):
    """Reads deltas of the own vessel from a Signal K server."""

    def _decoder(self) -> "SignalKDecoder":
        return SignalKDecoder()

    async def _read(self, feed: Feed["SignalKDecoder"]) -> None:
        wanted = [{"path": path, "policy": "instant"} for path in SUBSCRIBED]
        async with connected(self.uri) as socket:
            await socket.send(json.dumps({"context": "vessels.self", "subscribe": wanted}))
            async for message in socket:
                feed.deliver(feed.decoder.message(message))


class SignalKSink(Sink):
    """Writes deltas to a Signal K server."""

    def __init__(self, uri: Uri):
        super().__init__(uri)
        self._server = uri
        self._waiting: asyncio.Queue[str] = asyncio.Queue(WAITING)
        self.has_peer = False

    async def run(self) -> None:
        """See Sink."""
        await kept_open(self._server.text, self._write)

    def send(self, message: bytes) -> None:
        """See Sink."""
        if not self.has_peer or self._waiting.full():
            self.lost += 1
            return
        self._waiting.put_nowait(message.decode())

    async def _write(self) -> None:
        async with connected(self._server) as connection:
            self.has_peer = True
            discard = asyncio.create_task(_discard(connection))
            try:
                while not discard.done():
                    with contextlib.suppress(TimeoutError):
                        async with asyncio.timeout(0.5):  # `wait_for` of Python 3.11 can swallow a cancellation
                            message = await self._waiting.get()
                        await connection.send(message)
            finally:
                self.has_peer = False
                discard.cancel()


async def _discard(connection: Any) -> None:
    """Read what the server sends, so that it does not block, and drop it."""
    async for _ in connection:
        pass


class SignalKDecoder(JsonDecoder):
    """Decodes deltas of the own vessel, except those from `own_label`; null means no value.

    Paths and units: Signal K specification 1.7.
    """

    def __init__(self, own_label: str = "steerway"):
        super().__init__()
        self._own_label = own_label

    def _rows(self, message: dict[str, Any]) -> list[InputRow]:
        rows = []
        for update in message.get("updates", ()):
            source = source_of(update)
            if self._own_label in source.split("."):
                continue
            time = moment(update["timestamp"])
            values: dict[str, Any] = values_of(update)
            if values:
                rows.append(InputRow(source, time, **values))
        return rows
