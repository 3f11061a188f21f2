"""Open files, standard output among them, written by a thread of their own."""

import contextlib
import queue
import sys
import threading

from steerway.live.base.uri import Uri
from steerway.live.links.link import WAITING, Sink


class FileSink(Sink):
    """An open file, written by a thread of its own: a full pipe or a slow disk delays nothing else.

    With `lossless` (a replayed log) the replay waits for the file.
    """

    def __init__(self, file, lossless: bool = False, uri: Uri | None = None):
        super().__init__(uri)
        self.lossless = lossless
        self.broken = False
        self.file = file
        self._lines: queue.Queue = queue.Queue(WAITING)
        self._thread = threading.Thread(target=self._write, daemon=True)
        self._thread.start()

    def send(self, message: bytes) -> None:
        """See Sink. Raises BrokenPipeError when the file can no longer be written."""
        if self.broken:
            raise BrokenPipeError
        try:
            self._lines.put(message, block=self.lossless)
        except queue.Full:
            self.lost += 1

    def close(self) -> None:
        """See Sink."""
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


class StdoutSink(FileSink):
    """Standard output."""

    def __init__(self, uri: Uri, lossless: bool = False):
        super().__init__(sys.stdout.buffer, lossless, uri)
