"""Serial lines by termios: raw, eight bits, no parity, one stop bit."""

import asyncio
import os
import termios
import tty

from steerway.core.errors import InputError
from steerway.live.base.uri import Uri
from steerway.live.links.link import PIECE, Input, StreamSink, kept_open

_SPEEDS = {int(name[1:]): value for name, value in vars(termios).items() if name[0] == "B" and name[1:].isdigit()}


def speed_of(uri: Uri) -> int:
    """The termios constant of an address' baud rate. Raises InputError for a rate that termios does not have."""
    baud = uri.number("baud", 38400)
    if baud not in _SPEEDS or not baud:
        usual = ", ".join(map(str, sorted(each for each in _SPEEDS if 4800 <= each <= 921600)))
        raise InputError(f"{uri.text}: baud is {baud:g}, expected one of {usual}")
    return _SPEEDS[baud]


def opened(uri: Uri):
    """An unbuffered, non-blocking file on the port of an address, set to its speed."""
    descriptor = os.open(uri.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        tty.setraw(descriptor)
        settings = termios.tcgetattr(descriptor)
        settings[2] |= termios.CLOCAL | termios.CREAD
        settings[2] &= ~termios.CSTOPB
        settings[4] = settings[5] = speed_of(uri)
        termios.tcsetattr(descriptor, termios.TCSANOW, settings)
    except termios.error as error:
        os.close(descriptor)
        raise OSError(*error.args) from None
    return os.fdopen(descriptor, "r+b", buffering=0)


class SerialInput(Input):
    """Reads from a serial line."""

    async def _read(self, feed):
        with opened(self.uri) as port:
            reader = asyncio.StreamReader()
            loop = asyncio.get_running_loop()
            transport, _ = await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), port)
            try:
                while data := await reader.read(PIECE):
                    feed.feed(data)
            finally:
                transport.close()


class SerialSink(StreamSink):
    """Writes to a serial line."""

    async def run(self) -> None:
        """See Sink."""
        await kept_open(self.uri.text, self._write)

    async def _write(self):
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
            self.writers.add(transport)
            try:
                await gone.wait()
            finally:
                self.writers.discard(transport)
                transport.close()
