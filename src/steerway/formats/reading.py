"""Read any logs into one record.

The format of a log is detected from its content. A log that mixes formats (NMEA 0183 with UBX or AIS) is read by the
module of each. To add a format, write its module and add a line to FORMATS.
"""

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from steerway.core.errors import InputError
from steerway.core.records import Fixes
from steerway.formats import (
    ais,
    dataflash,
    fit,
    geojson,
    gpx,
    igc,
    mcap,
    nmea0183,
    nmea2000,
    packed,
    ros2,
    rtklib,
    signalk,
    table,
    tlog,
    ubx,
    ulog,
    wrsc,
)
from steerway.formats.columns import EXPECTED
from steerway.formats.recording import Recording
from steerway.formats.sources import Quality, choose, described, gather, quality, with_instruments

FORMATS = {
    "NMEA 0183": nmea0183,
    "UBX": ubx,
    "NMEA 2000": nmea2000,
    "AIS": ais,
    "GPX, TCX or KML": gpx,
    "GeoJSON": geojson,
    "IGC": igc,
    "RTKLIB": rtklib,
    "ArduPilot log": dataflash,
    "MAVLink log": tlog,
    "ULog": ulog,
    "FIT": fit,
    "Signal K": signalk,
    "WRSC": wrsc,
    "CSV or Parquet": table,
    "MCAP": mcap,
    "ROS 2 bag": ros2,
}

Source = Any  # str | PathLike | bytes | BinaryIO | polars.DataFrame | pandas.DataFrame
"""A path (also the directory of a ROS 2 bag), "-" for standard input, the bytes themselves, an open binary file, or a
DataFrame of polars or pandas."""

Progress = Callable[[int, int], None]
"""Called with the number of bytes read so far and the total."""

_HEAD = 1 << 16


@dataclass(frozen=True)
class Log:
    """A log as read by the module of one format, with the quality of each of its sources."""

    name: str
    recording: Recording
    sources: dict[str, Quality]


def read(
    *paths: Source,
    source: str | None = None,
    start: float | None = None,
    stop: float | None = None,
    progress: Progress | None = None,
    max_size: float | None = None,
) -> Fixes:
    """Read logs into one record, in time order.

    Positions come from `source`, or from the best source by rate, resolution and continuity. Heading, water speed and
    yaw rate of other instruments on board are merged in. The record's notes list the chosen source, corrections and
    omissions.

    Parameters: `paths`: see Source; `start` ≤ time < `stop` in Unix s; `max_size`: bytes to which a compressed log may
    unpack (default: 1e9, and less for a small one). Raises InputError if a log is missing, empty, too large or of an
    unrecognized format, if no log has a position (between `start` and `stop`), or if there is no such source.
    """
    logs = list(_recordings(paths, progress, max_size))
    sources = gather([(Path(name).name, recording.sources) for name, recording in logs])
    if not any(fixes.has_position.any() for fixes in sources.values()):
        raise InputError(_no_position(logs))
    name = choose(sources, source)
    fixes, instrument_notes = with_instruments(name, sources)
    notes = [*_choice_notes(name, sources), *instrument_notes, *_log_notes(logs)]
    fixes = Fixes(**fixes.columns(), source=name, notes=tuple(notes))
    cut = fixes.between(start, stop)
    if not cut.has_position.any():
        raise InputError(
            f"no position of {name} is between {start} and {stop}; the record goes from "
            f"{fixes.time.min():.3f} to {fixes.time.max():.3f} (Unix s)"
        )
    return cut


def survey(*paths: Source, progress: Progress | None = None, max_size: float | None = None) -> list[Log]:
    """The contents of each log by format, with all sources. Raises InputError for a log that `read` cannot read."""
    return [
        Log(name, recording, {key: quality(fixes) for key, fixes in recording.sources.items()})
        for name, recording in _recordings(paths, progress, max_size)
    ]


def plain(path: Source, max_size: float | None = None) -> bytes:
    """The bytes of a log, unpacked. Raises InputError for a log that is missing or unpacks to more than `max_size`."""
    return packed.plain(*_opened(path), max_size)


def _recordings(
    paths: Sequence[Source], progress: Progress | None, max_size: float | None
) -> Iterator[tuple[str, Recording]]:
    if not paths:
        raise InputError("no log is given, expected one or more paths, or - for standard input")
    yield from ((f"frame {k}", table.read_frame(each)) for k, each in enumerate(paths, 1) if _is_frame(each))
    paths = [each for path in paths if not _is_frame(path) for each in _files(path)]
    total = sum(_size(path) for path in paths)
    done = 0
    for path in paths:
        name, data = _opened(path)
        done += len(data)
        yield from ((name, recording) for recording in _parsed(name, packed.plain(name, data, max_size)))
        if progress is not None:
            progress(done, max(total, done))


def _is_frame(path: object) -> bool:
    return hasattr(path, "columns") and hasattr(path, "shape")


def _files(path: Source) -> Sequence[Source]:
    """The files of a ROS 2 bag; any other source unchanged, in a list."""
    is_directory = isinstance(path, str | PathLike) and Path(path).is_dir()
    return (is_directory and ros2.files_of(Path(path))) or [path]


def _size(path: Source) -> int:
    if isinstance(path, bytes | bytearray | memoryview):
        return len(path)
    if isinstance(path, str | PathLike) and Path(path).is_file():
        return Path(path).stat().st_size
    return 0


def _opened(path: Source) -> tuple[str, bytes]:
    """(name for error messages, bytes) of a source."""
    if isinstance(path, bytes | bytearray | memoryview):
        return "bytes", bytes(path)
    if isinstance(path, str | PathLike) and str(path) != "-":
        try:
            return str(path), Path(path).read_bytes()
        except OSError as error:
            raise InputError(f"{path}: cannot be read ({_why(path, error)}), expected a log file") from None
    stream, name = (sys.stdin.buffer, "standard input") if isinstance(path, str | PathLike) else (path, "")
    if not hasattr(stream, "read"):
        raise InputError(f"log is {path!r}, expected a path, bytes or an open file")
    data = stream.read()
    name = name or str(getattr(stream, "name", "stream"))
    return name, data.encode() if isinstance(data, str) else data


def _why(path: Any, error: OSError) -> str:
    if isinstance(error, FileNotFoundError):
        return "no such file"
    return "a directory" if Path(path).is_dir() else (error.strerror or "not readable").lower()


def _parsed(name: str, data: bytes) -> list[Recording]:
    """The recordings of every format that recognises the bytes."""
    if not data or data.isspace():
        raise InputError(f"{name}: is empty, expected a log")
    head = data[:_HEAD]
    readers = [reader for reader in FORMATS.values() if reader.recognises(head)]
    if not readers and len(data) > _HEAD:
        readers = [reader for reader in FORMATS.values() if reader.recognises(data)]
    if not readers:
        raise InputError(
            f"{name}: unrecognized format, expected one of {', '.join(FORMATS)}; a table needs columns {EXPECTED}"
        )
    recordings, refused = [], []
    for reader in readers:
        try:
            recordings.append(reader.read(data))
        except InputError as error:
            refused.append(error)
    if not recordings:
        raise InputError(f"{name}: {refused[0]}")
    return recordings


def _no_position(logs: Sequence[tuple[str, Recording]]) -> str:
    names = ", ".join(dict.fromkeys(name for name, _ in logs))
    counts = [each for _, recording in logs for each in list(recording.counts.items())[:5]]
    kinds = ", ".join(f"{count} × {kind}" for kind, count in counts if count)
    skipped = _skipped([recording for _, recording in logs])
    return f"{names}: no position in it; found {kinds or 'no complete message'}{f' ({skipped})' if skipped else ''}"


def _choice_notes(name: str, sources: Mapping[str, Fixes]) -> list[str]:
    others = [described(other, fixes) for other, fixes in sources.items() if other != name and fixes.has_position.any()]
    return [f"position from {described(name, sources[name])} out of {'; '.join(others)}"] if others else []


def _log_notes(logs: Sequence[tuple[str, Recording]]) -> Iterator[str]:
    many = len({name for name, _ in logs}) > 1
    for name, recording in logs:
        where = f"{Path(name).name}: " if many else ""
        yield from (where + note for note in recording.notes)
        skipped = _skipped([recording])
        if skipped:
            yield f"{where}skipped {skipped}"


def _skipped(recordings: Iterable[Recording]) -> str:
    totals: dict[str, int] = {}
    for recording in recordings:
        for reason, count in recording.skipped.items():
            totals[reason] = totals.get(reason, 0) + count
    return "; ".join(f"{count} × {reason}" for reason, count in sorted(totals.items(), key=lambda each: -each[1]))
