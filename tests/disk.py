"""A disk that fills up."""

import errno
import io
import os


class Disk(io.FileIO):
    """A file on a disk with so many bytes of room."""

    room = 10**9

    def write(self, data):
        if self.room <= 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        part = super().write(bytes(data[: self.room]))
        self.room -= part
        return part
