"""MCAP: a file of messages by topic, as ROS 2 and Foxglove use it. Needs the optional package `mcap`.

Read: `sensor_msgs/msg/NavSatFix` of ROS 2, `foxglove.LocationFix` as JSON, and the inputs of `steerway live --record`.
Written: `nav_msgs/msg/Odometry`. A damaged file is read up to the damage. Format: mcap.dev/spec.
"""

import io
import json
import math
import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from steerway.core.errors import InputError
from steerway.core.extras import require
from steerway.core.records import REPORTED, Motion
from steerway.core.timestamps import dated
from steerway.formats import packed, ros2
from steerway.formats.places import on_earth
from steerway.formats.recording import Recording, fixes_of

MAGIC = b"\x89MCAP0\r\n"
INPUT = "/input"
"""Topic of the inputs in a recording of `steerway live`."""
_LOCATION_FIX = "foxglove.LocationFix"
_DAMAGE = LookupError, OSError, RuntimeError, TypeError, ValueError, EOFError, OverflowError, struct.error
"""Exceptions that libraries raise for damaged bytes, besides those of `mcap`."""


class Message(NamedTuple):
    """A message: topic, name of its schema, encoding, log time (ns) and bytes."""

    topic: str
    schema: str
    encoding: str
    time: int
    data: bytes


def require_mcap(name: str) -> None:
    """Raises InputError if the package `mcap` is not installed; `name` begins the message."""
    require(f"{name}:", "mcap")


def recognises(head: bytes) -> bool:
    """Whether the first bytes are the magic number of MCAP."""
    return head.startswith(MAGIC)


def messages(file: BinaryIO, metadata: dict[str, Any] | None = None) -> Iterator[Message]:
    """The messages of a file in the order of writing, up to its end or to the damage.

    metadata: filled with the metadata records by name. Raises InputError if the file is damaged from the beginning or
    unpacks to far more than a recording does.
    """
    from mcap.exceptions import McapError
    from mcap.records import Channel, Metadata, Schema
    from mcap.records import Message as Record

    schemas: dict[int, str] = {}
    channels: dict[int, Channel] = {}
    try:
        for record in _records(file):
            if isinstance(record, Schema):
                schemas[record.id] = record.name
            elif isinstance(record, Channel):
                channels[record.id] = record
            elif isinstance(record, Metadata) and metadata is not None:
                metadata[record.name] = record.metadata
            elif isinstance(record, Record) and record.channel_id in channels:
                channel = channels[record.channel_id]
                schema = schemas.get(channel.schema_id, "")
                yield Message(channel.topic, schema, channel.message_encoding, record.log_time, record.data)
    except InputError:
        raise
    except (McapError, *_DAMAGE) as error:
        if not schemas and not channels:
            why = f" ({error})" if str(error) else ""
            raise InputError(f"MCAP is damaged from the beginning{why}, expected a recording") from None


def _records(file: BinaryIO) -> Iterator[Any]:
    """The records of a file, with chunks unpacked. Raises InputError for chunks larger than `packed.allowed`."""
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader, breakup_chunk

    size = file.seek(0, io.SEEK_END)
    file.seek(0)
    left = packed.allowed(size)
    for record in StreamReader(file, emit_chunks=True, record_size_limit=size).records:
        if not isinstance(record, Chunk):
            yield record
            continue
        data = _unpacked(record, left)
        left -= len(data)
        if left < 0:
            raise InputError(f"MCAP unpacks to more than {packed.allowed(size):g} bytes, expected a recording")
        yield from breakup_chunk(replace(record, data=data, compression=""))


def _unpacked(chunk: Any, most: int) -> bytes:
    """The unpacked records of a chunk; at most `most` + 1 bytes of them if the chunk is compressed."""
    if chunk.compression == "zstd":
        import zstandard

        try:
            return zstandard.ZstdDecompressor().stream_reader(chunk.data).read(most + 1)
        except zstandard.ZstdError as error:
            raise ValueError(str(error)) from None
    if chunk.compression == "lz4":
        import lz4.frame

        return lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, most + 1)
    return chunk.data


def read(data: bytes) -> Recording:
    """The positions of every topic, each topic a source. Raises InputError without the package `mcap`."""
    require_mcap("MCAP")
    rows: dict[str, list[tuple[float, ...]]] = {}
    counts, skipped = Counter[str](), Counter[str]()
    for message in messages(io.BytesIO(data)):
        counts[message.schema or message.topic] += 1
        try:
            named_row = _row(message)
        except _DAMAGE:
            skipped["message damaged"] += 1
            continue
        if named_row is None:
            continue
        name, row = named_row
        if np.isfinite(dated(np.asarray(row[0]))):
            rows.setdefault(name, []).append(row)
        else:
            skipped["no fix"] += 1
    return Recording.of("MCAP", [fixes_of(*each) for each in rows.items()], counts, skipped)


def _row(message: Any) -> tuple[str, tuple[float, ...]] | None:
    """Source and (time, latitude, longitude, *REPORTED) of a message; time is NaN without a fix. None for others."""
    if message.schema == ros2.NAV_SAT_FIX and message.encoding == "cdr":
        return message.topic, ros2.nav_sat_fix(message.data)
    if message.schema == _LOCATION_FIX and message.encoding == "json" and message.topic != "/position":
        return message.topic, _location_fix(json.loads(message.data))
    if message.topic == INPUT and message.encoding == "json":
        row = json.loads(message.data)
        time, *place = (_number(row[name]) for name in ("time", "latitude", "longitude"))
        return str(row["source"]), (time, *on_earth(*place), *(_number(row[name]) for name in REPORTED))
    return None


def _location_fix(message: dict[str, Any]) -> tuple[float, ...]:
    time = message["timestamp"]["sec"] + 1e-9 * message["timestamp"]["nsec"]
    place = on_earth(math.radians(message["latitude"]), math.radians(message["longitude"]))
    variance = message.get("position_covariance") or [math.nan] * 9
    known = message.get("position_covariance_type", 0) != 0
    std = math.sqrt(0.5 * (variance[0] + variance[4])) if known else math.nan
    return time, *place, std, *[math.nan] * 5


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def write_odometry(record: Motion, file: BinaryIO) -> None:
    """Write an estimate to /odometry (`nav_msgs/msg/Odometry`, see `ros2.odometry`). InputError without `mcap`."""
    require_mcap("Odometry")
    from mcap.writer import Writer

    writer = Writer(file)
    writer.start(profile="ros2", library="steerway")
    schema = writer.register_schema(ros2.ODOMETRY, "ros2msg", ros2.ODOMETRY_TEXT.encode())
    channel = writer.register_channel("/odometry", "cdr", schema)
    for time, data in ros2.odometry(record):
        writer.add_message(channel, time, data, time)
    writer.finish()
