"""The control port: other programs on this computer send requests as lines of JSON over TCP.

A client sends `{"token": "…"}` first, then requests (see `Controls`) as `{"id": 1, "do": "adjust", "value": 0.17}`. The
port answers each with `{"id": 1, "ok": true}` or `{"id": 1, "error": "…"}`. After the token it also sends
`{"state": {…}}` (see `Controls.state`), once a second and at every change.
"""

import asyncio
import contextlib
import hmac
import json
from typing import Any

from steerway.core.errors import InputError
from steerway.live.controls import Controls
from steerway.live.links.link import kept_open
from steerway.live.links.transport import BACKLOG
from steerway.live.uri import Address, checked, host_and_port, is_loopback, token_of

DEFAULT = "127.0.0.1:10120"
TOKEN_VARIABLE = "STEERWAY_CONTROL_TOKEN"
_LONGEST = 4096  # longest request, bytes
_FIRST = 5.0  # time within which a client has to send the token, s
_MOST = 16  # largest number of connections with the token, and of those without it
_LOOK = 0.1  # time between two checks for a changed state, s
_PERIOD = 1.0  # longest time between two states that are sent, s


def control_address(text: str, token_file: str | None) -> Address:
    """The address `host:port` on this computer, with the token from a file or the environment.

    Raises InputError for any other address, and without a token.
    """
    try:
        host, port = host_and_port(text)
    except ValueError:
        host, port = "", None
    if not (is_loopback(host) and port):
        raise InputError(f"control is {text!r}, expected host:port on this computer such as {DEFAULT}")
    token = checked(token_of(token_file, TOKEN_VARIABLE, "control"), "control")
    if token is None:
        raise InputError(
            f"control {text!r} lets other programs steer, expected a token for them in the environment variable "
            f"{TOKEN_VARIABLE} or in a file that --control-token-file names"
        )
    return Address(host, port, token)


class ControlPort:
    """Serves requests to `controls` at `address`; runs beside the service like a link."""

    def __init__(self, controls: Controls, address: Address):
        self.controls, self.address = controls, address
        self._strangers: dict[asyncio.StreamWriter, None] = {}  # connections without a token yet, the oldest first
        self._clients: set[asyncio.StreamWriter] = set()

    async def run(self) -> None:
        """Keep the port open until cancelled."""
        await kept_open(f"control {self.address.host}:{self.address.port}", self._serve)

    async def _serve(self) -> None:
        server = await asyncio.start_server(self._client, self.address.host, self.address.port, limit=_LONGEST)
        try:
            async with server:
                await server.serve_forever()
        finally:
            for client in (*self._strangers, *self._clients):
                client.transport.abort()

    async def _client(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if len(self._strangers) >= _MOST:
            next(iter(self._strangers)).transport.abort()
        self._strangers[writer] = None
        try:
            with contextlib.suppress(OSError, ValueError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
                if await self._is_permitted(reader, writer):
                    await self._talk(reader, writer)
        finally:
            self._strangers.pop(writer, None)
            self._clients.discard(writer)
            writer.close()

    async def _is_permitted(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> bool:
        try:
            async with asyncio.timeout(_FIRST):
                first = _parsed(await reader.readline() or b"{}")
        except TimeoutError:
            return False
        token = first.get("token") if isinstance(first, dict) else None
        if not (isinstance(token, str) and hmac.compare_digest(token.encode(), str(self.address.token).encode())):
            _send(writer, {"error": "wrong token"})
            await asyncio.sleep(1.0)
            return False
        return len(self._clients) < _MOST

    async def _talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._strangers.pop(writer, None)
        self._clients.add(writer)
        states = asyncio.create_task(self._send_states(writer))
        try:
            while line := await reader.readline():
                _send(writer, self._answer(_parsed(line)))
                if writer.transport.get_write_buffer_size() > BACKLOG:
                    writer.transport.abort()  # the client does not read its answers
        finally:
            states.cancel()

    def _answer(self, request: object) -> dict[str, Any]:
        if not isinstance(request, dict):
            return {"error": "the request is not a JSON object, expected one with do and id"}
        try:
            self.controls.do(request.get("do"), request.get("value"), "the control port")
        except InputError as error:
            return {"id": request.get("id"), "error": str(error)}
        return {"id": request.get("id"), "ok": True}

    async def _send_states(self, writer: asyncio.StreamWriter) -> None:
        loop = asyncio.get_running_loop()
        sent, at = None, 0.0
        while True:
            state = self.controls.state()
            if state != sent or loop.time() - at >= _PERIOD:
                sent, at = state, loop.time()
                if writer.transport.get_write_buffer_size() < BACKLOG:
                    _send(writer, {"state": state})
            await asyncio.sleep(_LOOK)


def _parsed(line: bytes) -> Any:
    try:
        return json.loads(line)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def _send(writer: asyncio.StreamWriter, message: object) -> None:
    writer.write(json.dumps(message).encode() + b"\n")
