"""Sinks for files and standard output, each written by its own thread."""

import contextlib
import errno
import io
import os
import queue
import sys
import threading
from typing import Any

from steerway.live.links.link import WAITING, Sink
from steerway.live.uri import LOG, Uri


class FileSink(Sink):
    """An open file, written by a thread of its own: a full pipe or a slow disk delays nothing else.

    With `lossless` (a replayed log) the replay waits for the file. While the disk is full, whole messages are lost and
    counted in `lost`; the log gets a line when this begins and ends. With `whole` the file ends at the first lost
    message.
    """

    def __init__(
        self, file: Any, lossless: bool = False, uri: Uri | None = None, name: str = "", whole: bool = False
    ) -> None:
        super().__init__(uri)
        self.lossless, self.whole = lossless, whole
        self.broken = False  # True: nothing more is written
        self.file = file
        self._name = name or str(getattr(file, "name", "output"))
        self._has_reader = True
        self._fails = ""  # why messages are being lost
        self._lines: queue.Queue[bytes | None] = queue.Queue(WAITING)
        self._thread = threading.Thread(target=self._write, daemon=True)
        self._thread.start()

    def send(self, message: bytes) -> None:
        """See Sink. Raises BrokenPipeError once the reader of the pipe has gone."""
        if not self._has_reader:
            raise BrokenPipeError
        try:
            self._lines.put(message, block=self.lossless)
        except queue.Full:
            self.lost += 1

    def close(self) -> None:
        """See Sink."""
        if self._thread.is_alive():
            with contextlib.suppress(queue.Full):
                self._lines.put(None, timeout=5.0)
            self._thread.join(5.0)
        if self.lost:
            LOG.warning("%s: %d messages are missing", self._name, self.lost)

    def _write(self) -> None:
        while (line := self._lines.get()) is not None:
            if self.broken:
                self.lost += self._has_reader
                continue
            try:
                self._put(line)
                if self._lines.empty():
                    self.file.flush()
            except (BrokenPipeError, ValueError):
                self.broken, self._has_reader = True, False
            except OSError as error:
                self._lose(error.strerror or str(error))
            else:
                self._resume()
        with contextlib.suppress(OSError, ValueError):
            self.file.flush()

    def _put(self, line: bytes) -> None:
        """Write a whole message or nothing."""
        if not isinstance(self.file, io.FileIO) or not self.file.seekable():
            self.file.write(line)
            return
        begin = self.file.seek(0, os.SEEK_END)
        written = 0
        try:
            while written < len(line):
                part = self.file.write(line[written:])
                if not part:
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                written += part
        except OSError:
            self.file.truncate(begin)
            raise

    def _lose(self, why: str) -> None:
        self.lost += 1
        if self.whole:
            self.broken = True
            LOG.error("%s: %s; the file ends here, the run goes on", self._name, why)
        elif not self._fails:
            self._fails = why
            LOG.error("%s: %s; what cannot be written is lost, the run goes on", self._name, why)

    def _resume(self) -> None:
        if self._fails:
            LOG.warning("%s: can be written again, %d messages are missing", self._name, self.lost)
            self._fails = ""


class StdoutSink(FileSink):
    """Standard output."""

    def __init__(self, uri: Uri, lossless: bool = False):
        super().__init__(sys.stdout.buffer, lossless, uri, "standard output")

    def close(self) -> None:
        """See Sink. Data that a full disk refused are dropped, so that the interpreter does not retry at exit."""
        super().close()
        try:
            sys.stdout.buffer.flush()
        except (OSError, ValueError):
            with contextlib.suppress(OSError, ValueError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
