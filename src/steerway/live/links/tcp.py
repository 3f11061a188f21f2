"""TCP: a client that reads, a client that writes, and a server that writes to everyone who connects."""

import asyncio
import contextlib

from steerway.live.links.link import PIECE, Input, StreamSink, kept_open


class TcpInput(Input):
    """Reads from a TCP server."""

    greeting = b""

    async def _read(self, feed):
        reader, writer = await asyncio.open_connection(self.uri.host, self.uri.port)
        try:
            writer.write(self.greeting)
            while data := await reader.read(PIECE):
                feed.feed(data)
        finally:
            writer.close()


class TcpSink(StreamSink):
    """Writes to a TCP server."""

    async def run(self) -> None:
        """See Sink."""

        async def write():
            await _serve(self, *await asyncio.open_connection(self.uri.host, self.uri.port))

        await kept_open(self.uri.text, write)


class TcpServerSink(StreamSink):
    """A TCP server that writes the same to every client."""

    async def run(self) -> None:
        """See Sink."""

        async def serve():
            host = self.uri.host or "127.0.0.1"
            server = await asyncio.start_server(lambda *ends: _serve(self, *ends), host, self.uri.port)
            async with server:
                await server.serve_forever()

        await kept_open(self.uri.text, serve)


async def _serve(sink, reader, writer):
    """Write to a connection until its peer closes it; what the peer sends is dropped."""
    sink.writers.add(writer.transport)
    with contextlib.suppress(OSError):
        while await reader.read(PIECE):
            pass
    sink.writers.discard(writer.transport)
    writer.close()
