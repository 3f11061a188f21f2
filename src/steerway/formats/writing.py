"""Output files, by the ending of their names."""

import gzip
import io
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from steerway.core.errors import InputError
from steerway.core.files import complete_or_absent
from steerway.core.records import Fixes, Motion, Record
from steerway.formats import geojson, gpx, mcap


def _csv(record: Record, file: BinaryIO) -> None:
    record.to_frame().write_csv(file)


def _parquet(record: Record, file: BinaryIO) -> None:
    # By way of memory: where the disk is full while the footer is written, polars gives no error of the system.
    encoded = io.BytesIO()
    record.to_frame().write_parquet(encoded)
    file.write(encoded.getbuffer())


def _geojson(record: Record, file: BinaryIO) -> None:
    file.write(geojson.text(record).encode())


def _gpx(record: Record, file: BinaryIO) -> None:
    file.write(gpx.text(record).encode())


class Writer(NamedTuple):
    """How a record is written: `write(record, file)`. `tracks`: for fixes and estimates only."""

    write: Callable[[Any, Any], None]
    compresses: bool = True
    tracks: bool = False


WRITERS = {
    ".csv": Writer(_csv),
    ".parquet": Writer(_parquet, compresses=False),
    ".geojson": Writer(_geojson, tracks=True),
    ".json": Writer(_geojson, tracks=True),
    ".gpx": Writer(_gpx, tracks=True),
    ".mcap": Writer(mcap.write_odometry, compresses=False, tracks=True),
}
"""The kinds of output file by their endings; a new one is its module, and one entry here."""


def endings(tracks: bool = True) -> tuple[str, ...]:
    """The supported endings; with `tracks` False only those for any table."""
    known = {ending: each for ending, each in WRITERS.items() if tracks or not each.tracks}
    return (*known, *(f"{ending}.gz" for ending, each in known.items() if each.compresses))


def writer(path: str | os.PathLike[str], tracks: bool = True) -> tuple[Writer, bool]:
    """The writer for the ending of `path`, and whether to compress.

    `tracks` is False for a table that is not one of fixes or estimates. Raises InputError for an unknown ending, so
    that a command can refuse it before it begins to work.
    """
    name = Path(path).name.lower()
    for ending in endings(tracks):
        if name.endswith(ending):
            return WRITERS[ending.removesuffix(".gz")], ending.endswith(".gz")
    raise InputError(f"{str(path)!r} has an unknown ending, expected one of {', '.join(endings(tracks))}")


def write(record: Record, path: str | os.PathLike[str]) -> None:
    """Write fixes, an estimate or predictions as CSV, Parquet, GeoJSON or GPX 1.0, by the ending of `path`.

    A further ending `.gz` compresses. The file is written under another name in the same directory and then renamed,
    so that it is complete or absent. Columns are those of `to_frame`; numbers have the fewest digits that read back
    the same. Raises InputError for an unknown ending and a path that cannot be written.
    """
    kind, compressed = writer(path, isinstance(record, Fixes | Motion))
    with complete_or_absent(path) as file:
        if compressed:
            with gzip.GzipFile(filename="", fileobj=file, mode="wb", mtime=0) as packed:
                kind.write(record, packed)
        else:
            kind.write(record, file)


def same_file(one: str | os.PathLike[str], other: str | os.PathLike[str]) -> bool:
    """Whether two paths name one existing file, also through links and other spellings."""
    try:
        return os.path.samefile(one, other)
    except OSError:
        return False
