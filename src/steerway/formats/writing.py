"""Write output files; the ending of the name selects the format."""

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
    # Encoded in memory first: if the disk becomes full at the footer, polars raises no OSError.
    encoded = io.BytesIO()
    record.to_frame().write_parquet(encoded)
    file.write(encoded.getbuffer())


def _geojson(record: Record, file: BinaryIO) -> None:
    file.write(geojson.text(record).encode())


def _gpx(record: Record, file: BinaryIO) -> None:
    file.write(gpx.text(record).encode())


class Writer(NamedTuple):
    """A writer of one format. write(record, file); compresses: `.gz` can be added; tracks: fixes and estimates only."""

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
"""Writers by ending. To add a format, write its module and add an entry here."""


def endings(tracks: bool = True) -> tuple[str, ...]:
    """The supported endings; without `tracks` only those for any table."""
    known = {ending: each for ending, each in WRITERS.items() if tracks or not each.tracks}
    return (*known, *(f"{ending}.gz" for ending, each in known.items() if each.compresses))


def writer(path: str | os.PathLike[str], tracks: bool = True) -> tuple[Writer, bool]:
    """(writer for the ending of `path`, whether to compress).

    tracks: whether the record contains fixes or an estimate. Raises InputError for an unknown ending, so that a command
    can reject it before it starts to work.
    """
    name = Path(path).name.lower()
    for ending in endings(tracks):
        if name.endswith(ending):
            return WRITERS[ending.removesuffix(".gz")], ending.endswith(".gz")
    raise InputError(f"{str(path)!r} has an unknown ending, expected one of {', '.join(endings(tracks))}")


def write(record: Record, path: str | os.PathLike[str]) -> None:
    """Write fixes, an estimate or predictions as CSV, Parquet, GeoJSON or GPX 1.0, by the ending of `path`.

    With `.gz` added the file is compressed. It is written under a temporary name in the same directory and then
    renamed, so it is complete or absent. Columns are those of `to_frame`; numbers have the fewest digits that read back
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
    """Whether two paths lead to the same existing file, also through links or different spellings."""
    try:
        return os.path.samefile(one, other)
    except OSError:
        return False
