"""The finished parts of long work, kept on the disk until all are: interrupted work continues with them."""

import io
import json
import pickle
import struct
import zlib
from collections.abc import Callable, Hashable
from importlib.metadata import version
from pathlib import Path
from typing import BinaryIO

from steerway.core.errors import InputError
from steerway.core.files import cannot_write, made_directory


class Unfinished:
    """Results by key, each appended to a file as soon as it is known.

    `origin` says what the results are of. With `resume` those of interrupted work are read back; without, the file is
    begun anew. `noted()` is called after every result that is kept. Results consist of numbers, text, arrays, and
    classes of this project and of `packages`. Raises InputError for a directory that cannot be written, and for results
    of another origin or another version.
    """

    def __init__(
        self, path: Path, origin: dict[str, str], resume: bool = False, packages: tuple[str, ...] = ()
    ) -> None:
        self.results: dict[Hashable, object] = {}
        self.noted: Callable[[], None] = lambda: None
        self._path, self._packages = path, {"steerway", "steerway_studies", *packages}
        first = json.dumps(origin | {"version": version("steerway")}).encode() + b"\n"
        made_directory(path.parent)
        try:
            self._file = open(path, "r+b" if resume and path.exists() else "w+b")
            if not (resume and self._read(first)):
                self._file.write(first)
                self._file.flush()
        except OSError as error:
            raise cannot_write(path, error) from None

    def add(self, key: Hashable, result: object) -> None:
        """Keep one result. Raises InputError on a full disk."""
        self.results[key] = result
        try:
            entry = pickle.dumps((key, result))
            self._file.write(_HEAD.pack(len(entry), zlib.crc32(entry)) + entry)
            self._file.flush()
        except OSError as error:
            raise cannot_write(self._path, error) from None
        self.noted()

    def remove(self) -> None:
        """Everything is in the files that the work was for."""
        self._file.close()
        self._path.unlink(missing_ok=True)

    def _read(self, expected: bytes) -> bool:
        """Put the whole entries into `results`; the last may have been cut off, and is overwritten. False if empty."""
        first = self._file.readline()
        if first not in (expected, b""):
            raise InputError(f"{self._path} is of other work or another version, expected that of the interrupted work")
        end, whole = self._file.tell(), self._path.stat().st_size
        while len(head := self._file.read(_HEAD.size)) == _HEAD.size:
            size, checksum = _HEAD.unpack(head)
            entry = self._file.read(min(size, whole))
            if len(entry) < size or zlib.crc32(entry) != checksum:
                break
            try:
                key, result = _Entries(io.BytesIO(entry), self._packages).load()
            except Exception:  # another's file, or a class that is no more
                break
            self.results[key], end = result, self._file.tell()
        self._file.seek(end)
        self._file.truncate()
        return first == expected


_HEAD = struct.Struct("<QI")
"""Before every entry: its length and CRC-32."""


class _Entries(pickle.Unpickler):
    """Reads data only: classes of some packages, and no function but those that make NumPy's arrays."""

    def __init__(self, file: BinaryIO, packages: set[str]) -> None:
        super().__init__(file)
        self._packages = packages

    def find_class(self, module: str, name: str) -> object:
        package = module.split(".")[0]
        if (package, name) in _DATA:
            return super().find_class(module, name)
        if package in self._packages and isinstance(found := super().find_class(module, name), type):
            return found
        raise pickle.UnpicklingError(f"{module}.{name} is no result")


_DATA = {
    *(("numpy", name) for name in ("ndarray", "dtype", "_reconstruct", "scalar", "_frombuffer")),
    *(("builtins", name) for name in ("complex", "frozenset", "range", "set", "slice")),
}
