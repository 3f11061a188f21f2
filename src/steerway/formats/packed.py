"""Compressed logs and tables, unpacked as far as a log can be meant.

What is far denser than logs are unpacks to time and memory, not to fixes. It is refused, so that no input of less than
1 MB takes longer than seconds.
"""

import io
import zipfile
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from steerway.core.errors import InputError

_SMALL, _ALWAYS = 1e6, 16e6
"""Bytes of a small archive, and to how many it may unpack: so many are read in 5 s."""
_DENSEST = 100.0
"""Unpacked over packed size of what is larger. Recorded logs of moving boats reach 12 (of 150), moored ones 18."""
MAX_SIZE = 1e9
"""Bytes to which a compressed log may unpack."""
GZIP, ZSTD = b"\x1f\x8b", b"\x28\xb5\x2f\xfd"
UTF_16 = b"\xff\xfe", b"\xfe\xff"
_PIECE = 1 << 16
_LARGE = 16 << 20
"""Bytes of a packed table from which it is not unpacked beforehand: that would take as long as to read it."""


def allowed(size: int) -> int:
    """Bytes to which so many packed ones may unpack."""
    return int(_ALWAYS + _DENSEST * max(0.0, size - _SMALL))


def plain(name: str, data: bytes, max_size: float | None = None) -> bytes:
    """The bytes of a log, unpacked when gzip, UTF-8 when UTF-16; of a damaged archive, what comes before the damage.

    Raises InputError for more than `max_size` bytes (by default MAX_SIZE and no more than `allowed`) and for an archive
    that is damaged from the beginning.
    """
    if not data.startswith(GZIP):
        return data.decode("utf-16", "replace").encode() if data.startswith(UTF_16) else data
    largest = min(MAX_SIZE, allowed(len(data))) if max_size is None else max_size
    unpacked = io.BytesIO()
    for piece in _unzipped(io.BytesIO(data)):
        unpacked.write(piece)
        if unpacked.tell() > largest:
            raise InputError(f"{name}: unpacks to more than {largest:g} bytes, expected less (or a larger --max-size)")
    if not unpacked.tell():
        raise InputError(f"{name}: the gzip archive is damaged from the beginning, expected a log")
    return unpacked.getvalue()


def check(path: Path) -> None:
    """Raises InputError for a packed table (gzip, Zstandard, ZIP) that unpacks to more than `allowed`."""
    size = path.stat().st_size
    with open(path, "rb") as file:
        head = file.read(4)
        file.seek(0)
        if zipfile.is_zipfile(path):
            with opened_zip(path) as archive:
                pieces: Iterable[int] = [each.file_size for each in archive.infolist()]
        elif size > _LARGE:
            return
        elif head.startswith(GZIP):
            pieces = map(len, _unzipped(file))
        elif head == ZSTD:
            pieces = map(len, _unzstandard(file))
        else:
            return
        total = 0
        for piece in pieces:
            total += piece
            if total > allowed(size):
                most = f"{allowed(size):g} bytes"
                raise InputError(f"{path}: unpacks to more than {most}, expected a table (unpack it to read it)")


@contextmanager
def opened_zip(path: Path) -> Iterator[zipfile.ZipFile]:
    """A ZIP file. Raises InputError where it, or what is read of it in the block, is damaged, encrypted or unknown."""
    try:
        with zipfile.ZipFile(path) as archive:
            yield archive
    except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, ValueError) as error:
        raise InputError(f"{path}: the ZIP archive cannot be read ({error}), expected a sound one") from None


def _unzipped(file: BinaryIO) -> Iterator[bytes]:
    """The archives one after another in a file, in pieces, up to the damage."""
    unpacker, packed = zlib.decompressobj(wbits=31), file.read(_PIECE)
    while packed:
        try:
            piece = unpacker.decompress(packed, _PIECE)
        except zlib.error:
            return
        yield piece
        packed = unpacker.unconsumed_tail
        if unpacker.eof:
            packed, unpacker = unpacker.unused_data, zlib.decompressobj(wbits=31)
            packed += file.read(_PIECE) if len(packed) < 2 else b""
            if not packed.startswith(GZIP):
                return
        packed = packed or file.read(_PIECE)


def _unzstandard(file: BinaryIO) -> Iterator[bytes]:
    """Pieces, up to the damage; none without the package `zstandard`."""
    try:
        import zstandard
    except ImportError:
        return
    try:
        with zstandard.ZstdDecompressor().stream_reader(file, read_across_frames=True) as unpacker:
            while piece := unpacker.read(_PIECE):
                yield piece
    except zstandard.ZstdError:
        return
