"""Unpack compressed logs and tables, up to a size that logs reach.

Data that is compressed far more than logs costs time and memory and contains no fixes. It is rejected, so that no input
below 1 MB takes more than a few seconds.
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
"""Largest size of a small archive, and the size to which it may unpack, bytes. Reading 16 MB takes 5 s."""
_DENSEST = 100.0
"""Largest compression ratio of larger archives. In 150 recorded logs it is up to 12 for moving boats, 18 for moored."""
MAX_SIZE = 1e9
"""Size to which a compressed log may unpack by default, bytes."""
GZIP, ZSTD = b"\x1f\x8b", b"\x28\xb5\x2f\xfd"
UTF_16 = b"\xff\xfe", b"\xfe\xff"
_PIECE = 1 << 16
_LARGE = 16 << 20
"""Size of a packed table, bytes. Above it the unpacked size is not checked: a check takes as long as reading."""


def allowed(size: int) -> int:
    """Bytes to which an archive of `size` bytes may unpack."""
    return int(_ALWAYS + _DENSEST * max(0.0, size - _SMALL))


def plain(name: str, data: bytes, max_size: float | None = None) -> bytes:
    """The bytes of a log: gzip is unpacked (up to any damage), UTF-16 becomes UTF-8.

    Raises InputError if it unpacks to more than `max_size` bytes (default: the lower of MAX_SIZE and `allowed`), or if
    the archive is damaged from the beginning. name: begins error messages.
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
    """A ZIP file. Raises InputError if the file, or a member read in the block, is damaged, encrypted or unknown."""
    try:
        with zipfile.ZipFile(path) as archive:
            yield archive
    except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, ValueError) as error:
        raise InputError(f"{path}: the ZIP archive cannot be read ({error}), expected an undamaged one") from None


def _unzipped(file: BinaryIO) -> Iterator[bytes]:
    """The unpacked bytes of the gzip archives in a file, in pieces, up to any damage."""
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
    """The unpacked bytes of a Zstandard file, in pieces, up to any damage; empty without the package `zstandard`."""
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
