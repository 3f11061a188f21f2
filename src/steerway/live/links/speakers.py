"""Speakers: TCP server, TCP client, UDP, serial, standard output and Signal K. None of them ever waits for a listener.

A listener that does not keep up loses whole messages, not the boat her rhythm; `lost` counts them.
"""

import asyncio
import contextlib
import queue
import socket
import sys
import threading

from steerway.live.links.listening import kept_open
from steerway.live.links.serial import opened
from steerway.live.uri import Uri

_BACKLOG = 1 << 16  # bytes that may wait for a listener
_WAITING = 1000  # messages that may wait for a link to open or a file to be written


class Speaker:
    """One link to speak on."""

    def __init__(self, uri: Uri):
        self.uri = uri
        self.lost = 0

    async def run(self) -> None:
        """Keep the link open until cancelled."""

    def send(self, message: bytes) -> None:
        """Say a whole message, or lose it."""
        raise NotImplementedError

    def close(self) -> None:
        """Nothing more will be said."""


class _StreamSpeaker(Speaker):
    """Writes to any number of open streams."""

    def __init__(self, uri: Uri):
        super().__init__(uri)
        self._writers: set = set()

    def send(self, message: bytes) -> None:
        """See Speaker."""
        for transport in list(self._writers):
            if transport.is_closing():
                self._writers.discard(transport)
            elif transport.get_write_buffer_size() > _BACKLOG:
                self.lost += 1
            else:
                transport.write(message)

    def close(self) -> None:
        """See Speaker."""
        for transport in self._writers:
            transport.close()


class TcpServerSpeaker(_StreamSpeaker):
    """Everyone who connects is told the same."""

    async def run(self) -> None:
        """See Speaker."""

        async def serve():
            server = await asyncio.start_server(self._welcome, self.uri.host or "127.0.0.1", self.uri.port)
            async with server:
                await server.serve_forever()

        await kept_open(self.uri.text, serve)

    async def _welcome(self, reader, writer):
        self._writers.add(writer.transport)
        with contextlib.suppress(OSError):
            while await reader.read(1024):
                pass
        self._writers.discard(writer.transport)
        writer.close()


class TcpSpeaker(_StreamSpeaker):
    """A TCP server is told."""

    async def run(self) -> None:
        """See Speaker."""

        async def speak():
            reader, writer = await asyncio.open_connection(self.uri.host, self.uri.port)
            await self._welcome(reader, writer)

        await kept_open(self.uri.text, speak)

    _welcome = TcpServerSpeaker._welcome


class SerialSpeaker(_StreamSpeaker):
    """A serial line."""

    async def run(self) -> None:
        """See Speaker."""

        async def speak():
            with opened(self.uri) as port:
                gone = asyncio.Event()

                class Line(asyncio.BaseProtocol):
                    def connection_lost(self, exc):
                        gone.set()

                    def pause_writing(self):
                        pass

                    def resume_writing(self):
                        pass

                transport, _ = await asyncio.get_running_loop().connect_write_pipe(Line, port)
                self._writers.add(transport)
                try:
                    await gone.wait()
                finally:
                    self._writers.discard(transport)
                    transport.close()

        await kept_open(self.uri.text, speak)


class UdpSpeaker(Speaker):
    """Datagrams to one address, or to all of a network."""

    def __init__(self, uri: Uri):
        super().__init__(uri)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)

    def send(self, message: bytes) -> None:
        """See Speaker."""
        try:
            self._socket.sendto(message, (self.uri.host or "127.0.0.1", self.uri.port))
        except OSError:
            self.lost += 1

    def close(self) -> None:
        """See Speaker."""
        self._socket.close()


class FileSpeaker(Speaker):
    """An open file, written by a thread of its own: a pipe that is full, or a slow disk, stops nobody.

    With `patient` (a replayed log) nothing is lost: the replay waits.
    """

    def __init__(self, file, patient: bool = False, uri: Uri | None = None):
        super().__init__(uri)
        self.patient = patient
        self.broken = False
        self.file = file
        self._lines: queue.Queue = queue.Queue(_WAITING)
        self._thread = threading.Thread(target=self._write, daemon=True)
        self._thread.start()

    def send(self, message: bytes) -> None:
        """See Speaker. Raises BrokenPipeError when nobody reads any more."""
        if self.broken:
            raise BrokenPipeError
        try:
            self._lines.put(message, block=self.patient)
        except queue.Full:
            self.lost += 1

    def close(self) -> None:
        """See Speaker."""
        if not self.broken:
            with contextlib.suppress(queue.Full):
                self._lines.put(None, timeout=5.0)
            self._thread.join(5.0)

    def _write(self):
        while (line := self._lines.get()) is not None:
            if self.broken:
                continue
            try:
                self.file.write(line)
                if self._lines.empty():
                    self.file.flush()
            except (OSError, ValueError):
                self.broken = True
        with contextlib.suppress(OSError, ValueError):
            self.file.flush()


class StdoutSpeaker(FileSpeaker):
    """Standard output."""

    def __init__(self, uri: Uri, patient: bool = False):
        super().__init__(sys.stdout.buffer, patient, uri)


class SignalKSpeaker(Speaker):
    """Deltas to a Signal K server."""

    def __init__(self, uri: Uri):
        super().__init__(uri)
        self._waiting: asyncio.Queue = asyncio.Queue(_WAITING)
        self._is_open = False

    async def run(self) -> None:
        """See Speaker."""
        from steerway.live.links.signalk import connected

        async def speak():
            async with connected(self.uri) as connection:
                self._is_open = True
                hush = asyncio.create_task(self._discard(connection))
                try:
                    while not hush.done():
                        with contextlib.suppress(TimeoutError):
                            await connection.send(await asyncio.wait_for(self._waiting.get(), 0.5))
                finally:
                    self._is_open = False
                    hush.cancel()

        await kept_open(self.uri.text, speak)

    async def _discard(self, connection):
        """Read what the server says, so that it can say it, and forget it."""
        async for _ in connection:
            pass

    def send(self, message: bytes) -> None:
        """See Speaker."""
        if not self._is_open or self._waiting.full():
            self.lost += 1
            return
        self._waiting.put_nowait(message.decode())
