"""Every file out, by the ending of its name."""

import contextlib
import gzip
import os
from pathlib import Path

from steerway.core.errors import InputError
from steerway.core.records import Fixes, Motion
from steerway.formats import geojson, gpx


def _csv(record, file):
    record.to_frame().write_csv(file)


def _parquet(record, file):
    record.to_frame().write_parquet(file)


def _geojson(record, file):
    file.write(geojson.text(record).encode())


def _gpx(record, file):
    file.write(gpx.text(record).encode())


_WRITERS = {".csv": _csv, ".parquet": _parquet, ".geojson": _geojson, ".json": _geojson, ".gpx": _gpx}
_COMPRESSED = (".csv", ".geojson", ".json", ".gpx")
ENDINGS = (*_WRITERS, *(ending + ".gz" for ending in _COMPRESSED))
"""The endings `write` knows."""


def writer(path):
    """The (function, compressed) that the ending of `path` asks for.

    Raises InputError for an ending that is not known, so that a command can refuse before it begins to work.
    """
    name = Path(path).name.lower()
    for ending, function in _WRITERS.items():
        if name.endswith(ending):
            return function, False
        if ending in _COMPRESSED and name.endswith(ending + ".gz"):
            return function, True
    raise InputError(f"cannot tell the format of {str(path)!r} by its ending, expected one of {', '.join(ENDINGS)}")


def write(record: Fixes | Motion, path: str | os.PathLike) -> None:
    """Write a table as CSV, Parquet, GeoJSON or GPX 1.0, by the ending of `path`; `.gz` behind it compresses.

    The file appears whole or not at all: it is written beside its place and then put there. Columns are those of
    `to_frame`; numbers stand in their shortest form that reads back the same. Raises InputError for an ending that is
    not known and for a place that cannot be written.
    """
    function, compressed = writer(path)
    try:
        with _put_whole(Path(path)) as file:
            if compressed:
                with gzip.GzipFile(filename="", fileobj=file, mode="wb", mtime=0) as packed:
                    function(record, packed)
            else:
                function(record, file)
    except OSError as error:
        raise InputError(f"cannot write {str(path)!r}: {error.strerror or error}") from error


def same_file(one: str | os.PathLike, other: str | os.PathLike) -> bool:
    """Whether two paths lead to one existing file, by links and other spellings too."""
    try:
        return os.path.samefile(one, other)
    except OSError:
        return False


@contextlib.contextmanager
def _put_whole(path):
    """A binary file that takes the place of `path` when all went well, and is gone when not."""
    path = Path(os.path.realpath(path))
    beside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with open(beside, "wb") as file:
            yield file
        os.replace(beside, path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
