"""What is said, and when: sentences for instruments, lines of JSON, Signal K deltas, a table at the end.

An output is told every row a fix and every tick, and takes what it needs. What is unknown is said to be unknown: status
V, null. No row is ever said twice.
"""

import json
import math
from pathlib import Path
from typing import Protocol

import numpy as np

from steerway.formats.nmea0183.writing import Leg, apb, rmb, rmc, rot, vtg, xte
from steerway.formats.writing import write, writer
from steerway.live.autopilot import Order
from steerway.live.heard import Row
from steerway.live.links.speakers import Speaker
from steerway.records import MOTION_COLUMNS, STATUSES, Motion
from steerway.timestamps import iso


class Output(Protocol):
    """Something that says rows."""

    def fix(self, row: Row) -> None:
        """A fix was taken."""

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """Time has gone on; a row, and the leg under way and the order where there is one."""

    def close(self) -> None:
        """The run is over."""


class _Rhythm:
    """True once in every period of the rows' time, and at once when time goes back."""

    def __init__(self, period: float):
        self._period = period
        self._beat = math.nan

    def strikes(self, time: float) -> bool:
        """Whether a row of this time is the first of its period. Without a time: never."""
        beat = math.floor(time / self._period + 1e-6) if math.isfinite(time) else self._beat
        is_new = beat != self._beat and math.isfinite(time)
        self._beat = beat
        return is_new


class Sentences:
    """RMC, VTG and ROT once a period (s), and APB, XTE and RMB on a route, as instruments and autopilots expect."""

    def __init__(self, speaker: Speaker, period: float = 1.0):
        self.speaker = speaker
        self._rhythm = _Rhythm(period)

    def fix(self, row: Row) -> None:
        """See Output."""

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """See Output."""
        if self._rhythm.strikes(row.time):
            self.speaker.send("".join(self.said(row, leg)).encode())

    def close(self) -> None:
        """See Output."""
        self.speaker.close()

    def said(self, row: Row, leg: Leg | None = None) -> list[str]:
        """The sentences of a row. Where to steer is said only where course is known."""
        valid = row.valid and not math.isnan(row.sog)
        steering = []
        if leg is not None:
            knows = row.valid and not math.isnan(row.cog)
            steering = [sentence(leg, valid=knows) for sentence in (apb, xte, rmb)]
        return [
            rmc(row.time, row.latitude, row.longitude, row.sog, row.cog, valid=row.valid),
            vtg(row.sog, row.cog, valid=valid),
            rot(row.course_rate, valid=row.valid),
            *steering,
        ]


class JsonLines:
    """A line of JSON a fix, or with `every_tick` a line a tick; the columns are those of `estimate`."""

    def __init__(self, speaker: Speaker, every_tick: bool = False):
        self.speaker, self.every_tick = speaker, every_tick

    def fix(self, row: Row) -> None:
        """See Output."""
        if not self.every_tick:
            self.speaker.send(json_line(row))

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """See Output."""
        if self.every_tick and math.isfinite(row.time):
            self.speaker.send(json_line(row))

    def close(self) -> None:
        """See Output."""
        self.speaker.close()


def json_line(row: Row) -> bytes:
    """A row under the outward names of its columns, null for unknown, with its line end."""
    said = {}
    for name, (field, convert) in MOTION_COLUMNS.items():
        value = float(convert(getattr(row, field)))
        said[name] = value if math.isfinite(value) else None
    return json.dumps(said | {"status": STATUSES[row.status]}).encode() + b"\n"


class Deltas:
    """Signal K deltas, SI and rad, null for unknown: a fix once a period (s), and the present where fixes stay away."""

    def __init__(self, speaker: Speaker, period: float = 1.0):
        self.speaker, self.period = speaker, period
        self._rhythm = _Rhythm(period)
        self._said = -math.inf

    def fix(self, row: Row) -> None:
        """See Output."""
        if self._rhythm.strikes(row.time):
            self._say(row)

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """See Output."""
        if row.time - self._said >= 1.5 * self.period:
            self._say(row)

    def close(self) -> None:
        """See Output."""
        self.speaker.close()

    def _say(self, row):
        self._said = row.time
        self.speaker.send(delta(row))


def delta(row: Row) -> bytes:
    """The Signal K delta of a row; course in [0, 2π)."""
    place = {"latitude": math.degrees(row.latitude), "longitude": math.degrees(row.longitude)} if row.valid else None
    values = {
        "navigation.position": place,
        "navigation.speedOverGround": _or_null(row.sog),
        "navigation.courseOverGroundTrue": _or_null(row.cog % (2.0 * math.pi)),
        "navigation.rateOfTurn": _or_null(row.course_rate),
    }
    update = {
        "$source": "steerway",
        "timestamp": iso(round(row.time, 3)),
        "values": [{"path": path, "value": value} for path, value in values.items()],
    }
    return json.dumps({"context": "vessels.self", "updates": [update]}).encode()


def _or_null(value):
    return value if math.isfinite(value) else None


class TableFile:
    """All rows in one file at the end of the run: a row a fix, or with `every_tick` a row a tick."""

    def __init__(self, path: str | Path, every_tick: bool = False):
        writer(path)
        self.path, self.every_tick = path, every_tick
        self._rows: list[Row] = []

    def fix(self, row: Row) -> None:
        """See Output."""
        if not self.every_tick:
            self._rows.append(row)

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """See Output."""
        if self.every_tick and row.valid:
            self._rows.append(row)

    def close(self) -> None:
        """See Output."""
        columns = np.array(self._rows, dtype=np.float64).reshape(-1, len(Row._fields)).T
        said = dict(zip(Row._fields, columns, strict=True))
        write(Motion(**said | {"status": said["status"].astype(np.uint8)}), self.path)
