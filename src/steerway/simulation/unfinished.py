"""Intermediate results of long work, kept on disk until the work is done: interrupted work resumes from them."""

import json
import zlib
from collections.abc import Callable, Hashable
from importlib.metadata import version
from pathlib import Path
from typing import Any

from steerway.core.errors import InputError
from steerway.core.files import cannot_write, made_directory
from steerway.simulation.packing import packed, unpacked


class Unfinished:
    """Results by key, each appended to a file as soon as it is known.

    `origin` identifies the work. With `resume`, results of interrupted work are read back; without, the file starts
    empty. `noted()` is called after every stored result. Results consist of numbers, text, arrays, and classes of this
    project and of `packages`; others are not stored, and are computed again. The file contains data only. Raises
    InputError for a directory that cannot be written, and for results of another origin or another version.
    """

    def __init__(
        self, path: Path, origin: dict[str, str], resume: bool = False, packages: tuple[str, ...] = ()
    ) -> None:
        self.results: dict[Hashable, Any] = {}
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
        """Store one result. Raises InputError on a full disk."""
        self.results[key] = result
        try:
            entry = packed((key, result)).encode()
        except TypeError:
            return
        try:
            self._file.write(b"%08x %b\n" % (zlib.crc32(entry), entry))
            self._file.flush()
        except OSError as error:
            raise cannot_write(self._path, error) from None
        self.noted()

    def remove(self) -> None:
        """Delete the file, once the work is done."""
        self._file.close()
        self._path.unlink(missing_ok=True)

    def _read(self, expected: bytes) -> bool:
        """Read complete entries into `results`; an incomplete last one is overwritten. False if the file is empty."""
        first = self._file.readline()
        if first not in (expected, b""):
            raise InputError(f"{self._path} is from other work or another version, expected the file of this work")
        end = self._file.tell()
        for line in self._file:
            checksum, _, entry = line[:-1].partition(b" ")
            if not line.endswith(b"\n") or checksum != b"%08x" % zlib.crc32(entry):
                break
            try:
                key, result = unpacked(entry.decode(), self._packages)
                self.results[key] = result
            except (TypeError, ValueError):  # a foreign file, or a class that no longer exists
                break
            end += len(line)
        self._file.seek(end)
        self._file.truncate()
        return first == expected
