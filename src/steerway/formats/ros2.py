"""Messages of ROS 2 without ROS: read NavSatFix, also from bags in SQLite, and write Odometry, both in CDR.

Fields: sensor_msgs/msg/NavSatFix, nav_msgs/msg/Odometry, std_msgs/msg/Header. Axes: REP 103 (x east, y north, yaw from
east counter-clockwise: π/2 − χ).
"""

import math
import sqlite3
import struct
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from steerway.core.earth import displacement
from steerway.core.errors import InputError
from steerway.core.records import REPORTED, Motion
from steerway.formats.places import on_earth
from steerway.formats.recording import Recording, fixes_of

NAV_SAT_FIX = "sensor_msgs/msg/NavSatFix"
ODOMETRY = "nav_msgs/msg/Odometry"
_BAG = b"SQLite format 3\0"
_STEPS, _STEPS_ANYWAY = 1000, 1 << 20  # SQLite instructions between checks, and allowed in any file; a row takes 10
_UNKNOWN = 1e6
"""Variance of unknown values: consumers expect a number."""
_FIELDS = {
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id\n",
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec\n",
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose\nfloat64[36] covariance\n",
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z\n",
    "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
    "geometry_msgs/TwistWithCovariance": "geometry_msgs/Twist twist\nfloat64[36] covariance\n",
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z\n",
}
ODOMETRY_TEXT = (
    "std_msgs/Header header\nstring child_frame_id\n"
    "geometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist\n"
) + "".join(f"{'=' * 80}\nMSG: {name}\n{fields}" for name, fields in _FIELDS.items())
"""The definition of Odometry for an MCAP schema."""


class _Cursor:
    """Reads CDR; alignment is relative to the end of the four-byte header."""

    def __init__(self, data: bytes):
        self._order = "<" if data[1] & 1 else ">"
        self._data, self._at = data[4:], 0

    def take(self, kind: str, size: int, count: int = 1) -> tuple[Any, ...]:
        self._at += -self._at % size
        values = struct.unpack_from(f"{self._order}{count}{kind}", self._data, self._at)
        self._at += size * count
        return values

    def text(self) -> str:
        (length,) = self.take("I", 4)
        self._at += length
        return self._data[self._at - length : self._at - 1].decode(errors="replace")


def nav_sat_fix(data: bytes) -> tuple[float, ...]:
    """(time, latitude, longitude, *REPORTED) of a serialized NavSatFix; s, rad, m; all NaN without a fix."""
    cursor = _Cursor(data)
    (seconds,), (nanoseconds,) = cursor.take("i", 4), cursor.take("I", 4)
    cursor.text()
    (status,) = cursor.take("b", 1)
    cursor.take("H", 2)
    latitude, longitude, _ = cursor.take("d", 8, 3)
    covariance = cursor.take("d", 8, 9)
    (kind,) = cursor.take("B", 1)
    place = on_earth(math.radians(latitude), math.radians(longitude))
    if status < 0 or math.isnan(place[0]):
        return math.nan, *[math.nan] * (2 + len(REPORTED))
    variance = 0.5 * (covariance[0] + covariance[4])
    std = math.sqrt(variance) if kind and variance > 0.0 else math.nan
    return seconds + 1e-9 * nanoseconds, *place, std, *[math.nan] * (len(REPORTED) - 1)


def files_of(bag: Path) -> list[Path]:
    """The files of a ROS 2 bag, which is a directory; empty for any other directory."""
    if not (bag / "metadata.yaml").is_file():
        return []
    return sorted(each for each in bag.iterdir() if each.suffix in (".db3", ".mcap"))


def recognises(head: bytes) -> bool:
    """Whether the first bytes are the header of SQLite, the storage of some ROS 2 bags."""
    return head.startswith(_BAG)


def read(data: bytes) -> Recording:
    """The NavSatFix topics of a bag, each a source. Raises InputError for a database that is not a bag."""
    rows: dict[str, list[tuple[float, ...]]] = {}
    counts, skipped = Counter[str](), Counter[str]()
    base = sqlite3.connect(":memory:")
    # The number of instructions is limited, because a database can define its tables as endless queries.
    steps = iter(range(max(len(data), _STEPS_ANYWAY) // _STEPS))
    base.set_progress_handler(lambda: next(steps, None) is None, _STEPS)
    base.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, len(data))
    try:
        base.deserialize(data)
        topics = {number: (name, kind) for number, name, kind in base.execute("SELECT id, name, type FROM topics")}
        for topic, message in base.execute("SELECT topic_id, data FROM messages ORDER BY timestamp"):
            name, kind = topics.get(topic, ("", ""))
            counts[str(kind)] += 1
            if kind == NAV_SAT_FIX:
                try:
                    row = nav_sat_fix(message)
                except (struct.error, LookupError, TypeError):
                    skipped["message damaged"] += 1
                    continue
                skipped["no fix"] += not math.isfinite(row[0])
                if math.isfinite(row[0]):
                    rows.setdefault(str(name), []).append(row)
    except (sqlite3.Error, MemoryError, OverflowError, ValueError) as error:
        why = " ".join(str(error).split())  # the error may quote the file
        raise InputError(f"not a ROS 2 bag ({why}), expected the tables topics and messages") from None
    finally:
        base.close()
    return Recording.of("ROS 2 bag", [fixes_of(*each) for each in rows.items()], counts, +skipped)


def odometry(record: Motion) -> Iterator[tuple[int, bytes]]:
    """(time in ns, serialized Odometry) of the rows of an estimate that have a position.

    The pose is in the frame `map`, m east and north of the first position; its yaw is that of the course, π/2 − χ. The
    twist is in the frame `course`, with its x axis along the course: SOG along x, −χ̇ about z. Unknown values are 0
    with a variance of 1e6.
    """
    known = np.flatnonzero(record.has_position)
    if not len(known):
        return
    origin = float(record.latitude[known[0]]), float(record.longitude[known[0]])
    for k in known:
        moment = round(float(record.time[k]) * 1e9)
        north, east = displacement(float(record.latitude[k]), float(record.longitude[k]), *origin)
        sog, cog, rate = float(record.sog[k]), float(record.cog[k]), float(record.course_rate[k])
        yaw = 0.5 * math.pi - cog if math.isfinite(cog) else 0.0
        orientation = 0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)
        place = _variance(record.position_std[k])
        pose = _diagonal(place, place, _UNKNOWN, _UNKNOWN, _UNKNOWN, _variance(record.cog_std[k]))
        speed, turn = _variance(record.sog_std[k]), _variance(record.course_rate_std[k])
        twist = _diagonal(speed, _UNKNOWN, _UNKNOWN, _UNKNOWN, _UNKNOWN, turn)
        motion = _or_zero(sog), 0.0, 0.0, 0.0, 0.0, -_or_zero(rate)
        data = bytearray(struct.pack("<BBBBiI", 0, 1, 0, 0, *divmod(moment, 1_000_000_000)))
        for text in ("map", "course"):
            data += bytes(-(len(data) - 4) % 4)
            data += struct.pack("<I", len(text) + 1) + text.encode() + b"\0"
        data += bytes(-(len(data) - 4) % 8)
        data += struct.pack("<7d36d6d36d", east, north, 0.0, *orientation, *pose, *motion, *twist)
        yield moment, bytes(data)


def _diagonal(*values: float) -> list[float]:
    return [values[k // 7] if k % 7 == 0 else 0.0 for k in range(36)]


def _variance(std: float) -> float:
    return float(std) ** 2 if math.isfinite(std) else _UNKNOWN


def _or_zero(value: float) -> float:
    return value if math.isfinite(value) else 0.0
