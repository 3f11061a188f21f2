"""From what comes over a link to rows: one decoder a protocol, fed piece by piece.

A decoder holds the newest epoch back until something later was said or its link fell silent (`settle`): a receiver
tells one moment in several messages, of which the last may have the finest position.
"""

import json
import math
import time
from collections.abc import Mapping
from typing import Protocol

from steerway.core.timestamps import unix_times
from steerway.formats import nmea0183, ubx
from steerway.formats.dilution import deviation
from steerway.formats.nmea0183.epochs import NEAR, ROLLOVER
from steerway.live.heard import Heard, rows_of

_DAY = 86400.0
_UNDATED = 1e8  # Unix time below which no date was known
_LONGEST = 1 << 16  # bytes of a line of JSON


class Decoder(Protocol):
    """What makes rows of bytes; `skipped` counts by reason what was not believed."""

    skipped: Mapping[str, int]

    def feed(self, data: bytes) -> list[Heard]:
        """The rows that these bytes complete."""

    def settle(self) -> list[Heard]:
        """Nothing more is coming for now: the rows that waited."""


class ReceiverDecoder:
    """NMEA 0183 and UBX, alone or mixed. `place` is put behind a source's name where several links are listened to."""

    def __init__(self, place: str = ""):
        self._readers = nmea0183.Reader(), ubx.Reader()
        self._place = place

    @property
    def skipped(self) -> dict[str, int]:
        """How many messages were not believed, by reason."""
        return {reason: count for reader in self._readers for reason, count in reader.skipped.items()}

    def feed(self, data: bytes) -> list[Heard]:
        """See Decoder."""
        for reader in self._readers:
            reader.feed(data)
        return self._taken(False)

    def settle(self) -> list[Heard]:
        """See Decoder."""
        return self._taken(True)

    def _taken(self, settled):
        recordings = [reader.take(settled) for reader in self._readers if reader.holds(settled)]
        if not recordings:
            return []
        sources = {name: fixes for each in recordings for name, fixes in each.sources.items()}
        return [self._named(row) for row in rows_of(sources)]

    def _named(self, row):
        source = f"{row.source} in {self._place}" if self._place else row.source
        return row._replace(source=source, time=_dated(row.time, time.time()))


def _dated(moment, today):
    """A time with the date put right by the computer's clock.

    Where no date was told yet, today's: the day that brings the time of day nearest. A receiver whose count of weeks
    rolled over tells a date 1024 weeks ago, or a multiple.
    """
    if moment < _UNDATED:
        return moment + _DAY * round((today - moment) / _DAY)
    missing = ROLLOVER * round((today - moment) / ROLLOVER)
    return moment + missing if missing > 0.0 and abs(today - moment - missing) < NEAR else moment


class _Epochs:
    """Messages of one source and moment become one row; what is told later in the epoch overrules."""

    def __init__(self):
        self._open: dict[str, Heard] = {}

    def add(self, row: Heard) -> list[Heard]:
        waiting = self._open.get(row.source)
        if waiting is None or waiting.time == row.time:
            self._open[row.source] = row if waiting is None else _overruled(waiting, row)
            return []
        self._open[row.source] = row
        return [waiting]

    def settle(self) -> list[Heard]:
        waiting, self._open = sorted(self._open.values(), key=lambda row: row.time), {}
        return waiting


def _overruled(old, new):
    pairs = zip(old[2:], new[2:], strict=True)
    return Heard(old.source, old.time, *(a if math.isnan(b) else b for a, b in pairs))


class _JsonLines:
    """Lines of JSON, one message each; what is none is counted and left out."""

    def __init__(self):
        self._tail = b""
        self._epochs = _Epochs()
        self.skipped: dict[str, int] = {}

    def feed(self, data: bytes) -> list[Heard]:
        """See Decoder."""
        *lines, self._tail = (self._tail + data).split(b"\n")
        self._tail = self._tail[-_LONGEST:]
        return [done for line in lines if line.strip() for done in self.message(line)]

    def settle(self) -> list[Heard]:
        """See Decoder."""
        return self._epochs.settle()

    def message(self, text: bytes | str) -> list[Heard]:
        """The rows that one message completes."""
        try:
            rows = self._rows(json.loads(text))
        except (ValueError, TypeError, KeyError, AttributeError):
            self.skipped["malformed"] = self.skipped.get("malformed", 0) + 1
            return []
        return [done for row in rows for done in self._epochs.add(row)]

    def _rows(self, message) -> list[Heard]:
        raise NotImplementedError


class GpsdDecoder(_JsonLines):
    """gpsd's JSON: TPV reports, several an epoch. `magtrack` is never read, its sign is not to be trusted.

    Fields: gpsd_json(5).
    """

    def _rows(self, message):
        if message["class"] != "TPV" or message.get("mode", 0) < 2 or "lat" not in message:
            return []
        speed = {"sog": message["speed"]} if "speed" in message else {}
        course = {"cog": _course(message["track"])} if "track" in message else {}
        place = math.radians(message["lat"]), _course(message["lon"])
        name = f"gpsd {message.get('device', '')}".strip()
        return [Heard(name, _moment(message["time"]), *place, _gpsd_deviation(message), **speed, **course)]


def _gpsd_deviation(message):
    """1σ of north and of east by a radius, or by its parts; gpsd does not tell how sure either is."""
    if "eph" in message:
        return message["eph"] / math.sqrt(2.0)
    if "epx" in message and "epy" in message:
        return math.hypot(message["epx"], message["epy"]) / math.sqrt(2.0)
    return math.nan


_PATHS = {
    "navigation.speedOverGround": "sog",
    "navigation.courseOverGroundTrue": "cog",
    "navigation.headingTrue": "heading",
    "navigation.speedThroughWater": "water_speed",
    "navigation.rateOfTurn": "yaw_rate",
}
_DILUTION = "navigation.gnss.horizontalDilution"
SUBSCRIBED = ("navigation.position", _DILUTION, *_PATHS)
"""The Signal K paths that are listened to."""


class SignalKDecoder(_JsonLines):
    """Signal K deltas, of the own vessel. Null is no value. Paths and units: Signal K specification 1.7."""

    def __init__(self, own_label: str = "steerway"):
        super().__init__()
        self._own_label = own_label

    def _rows(self, message):
        rows = []
        for update in message.get("updates", ()):
            source = str(update.get("$source") or update.get("source", {}).get("label", "signalk"))
            if source == self._own_label or source.startswith(f"{self._own_label}."):
                continue
            moment = _moment(update["timestamp"])
            said = {}
            for pair in update.get("values", ()):
                said |= _signalk_value(pair["path"], pair["value"])
            if said:
                rows.append(Heard(source, moment, **said))
        return rows


def _signalk_value(path, value):
    if value is None:
        return {}
    if path == "navigation.position":
        return {"latitude": math.radians(value["latitude"]), "longitude": _course(value["longitude"])}
    if path == _DILUTION:
        return {"position_std": deviation(float(value))}
    if path in ("navigation.courseOverGroundTrue", "navigation.headingTrue"):
        return {_PATHS[path]: math.remainder(value, 2.0 * math.pi)}
    return {_PATHS[path]: float(value)} if path in _PATHS else {}


def _course(degrees):
    return math.radians(math.remainder(degrees, 360.0))


def _moment(text) -> float:
    return float(unix_times([text])[0])
