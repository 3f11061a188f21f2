"""Decoders turn the bytes of a link into rows, piece by piece. Decoders of a single link are in that link's file.

A decoder holds the newest epoch back until a later one begins or the link is silent: a receiver reports an epoch in
several messages, and the last of them may have the finest position.
"""

import datetime
import json
import math
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping
from time import monotonic
from typing import Any, Protocol

from steerway.core.timestamps import unix_times
from steerway.formats import nmea0183, ubx
from steerway.formats.nmea0183.epochs import NEAR, ROLLOVER
from steerway.live.rows import InputRow, rows_of

_DAY = 86400.0
_UNDATED = 1e8  # Unix time below which the date is not known
_LONGEST = 1 << 16  # longest line of JSON, bytes


class Decoder(Protocol):
    """Makes rows from bytes; `skipped` counts rejected messages by reason."""

    @property
    def skipped(self) -> Mapping[str, int]: ...

    def feed(self, data: bytes) -> list[InputRow]:
        """The rows that these bytes complete."""

    def complete_on_silence(self) -> list[InputRow]:
        """The rows of incomplete epochs, after a pause in the data."""


class ReceiverDecoder:
    """Decodes NMEA 0183 and UBX, alone or mixed. `place`, unless "", is appended to the names of sources."""

    def __init__(self, place: str = ""):
        self._readers = nmea0183.SentenceReader(), ubx.UbxReader()
        self._place = place

    @property
    def skipped(self) -> dict[str, int]:
        """Counts of rejected messages by reason."""
        return {reason: count for reader in self._readers for reason, count in reader.skipped.items()}

    def feed(self, data: bytes) -> list[InputRow]:
        """See Decoder."""
        sentences, messages = self._readers
        sentences.feed(data, now=monotonic())
        messages.feed(data)
        return self._taken(False)

    def complete_on_silence(self) -> list[InputRow]:
        """See Decoder."""
        return self._taken(True)

    def _taken(self, settled: bool) -> list[InputRow]:
        recordings = [reader.take(settled) for reader in self._readers if reader.holds(settled)]
        if not recordings:
            return []
        sources = {name: fixes for each in recordings for name, fixes in each.sources.items()}
        formatters = {name: bits for each in recordings for name, bits in each.formatters.items()}
        return [self._named(row) for row in rows_of(sources, formatters)]

    def _named(self, row: InputRow) -> InputRow:
        source = f"{row.source} in {self._place}" if self._place else row.source
        return row._replace(source=source, time=_dated(row.time, time.time()))


def _dated(moment: float, today: float) -> float:
    """A time with its date corrected by the computer's clock.

    A time without a date gets the day that brings it nearest to the present. A receiver whose week count rolled over
    reports a date that is a multiple of 1024 weeks too early.
    """
    if moment < _UNDATED:
        return moment + _DAY * round((today - moment) / _DAY)
    missing = ROLLOVER * round((today - moment) / ROLLOVER)
    return moment + missing if missing > 0.0 and abs(today - moment - missing) < NEAR else moment


class _Epochs:
    """Joins the messages of one source and time to a row; values of later messages replace earlier ones.

    An epoch's position is given once: messages that arrive after it add only their other values.
    """

    def __init__(self) -> None:
        self._open: dict[str, InputRow] = {}
        self._given: dict[str, float] = {}  # the time of the last position of each source

    def add(self, row: InputRow) -> list[InputRow]:
        if self._given.get(row.source) == row.time:
            row = row._replace(latitude=math.nan, longitude=math.nan, position_std=math.nan)
        waiting = self._open.get(row.source)
        if waiting is None or waiting.time == row.time:
            self._open[row.source] = row if waiting is None else _replaced(waiting, row)
            return []
        self._open[row.source] = row
        return self._taken([waiting])

    def complete_on_silence(self) -> list[InputRow]:
        waiting, self._open = sorted(self._open.values(), key=lambda row: row.time), {}
        return self._taken(waiting)

    def _taken(self, rows: list[InputRow]) -> list[InputRow]:
        self._given |= {row.source: row.time for row in rows if row.has_position}
        return rows


def _replaced(old: InputRow, new: InputRow) -> InputRow:
    pairs = zip(old[2:], new[2:], strict=True)
    return InputRow._make((old.source, old.time, *(a if math.isnan(b) else b for a, b in pairs)))


class JsonDecoder(ABC):
    """Decodes lines of JSON, one message each; malformed lines are counted and skipped."""

    def __init__(self) -> None:
        self._tail = b""
        self._epochs = _Epochs()
        self.skipped: dict[str, int] = {}

    def feed(self, data: bytes) -> list[InputRow]:
        """See Decoder."""
        *lines, self._tail = (self._tail + data).split(b"\n")
        self._tail = self._tail[-_LONGEST:]
        return [done for line in lines if line.strip() for done in self.message(line)]

    def complete_on_silence(self) -> list[InputRow]:
        """See Decoder."""
        return self._epochs.complete_on_silence()

    def message(self, text: bytes | str) -> list[InputRow]:
        """The rows that one message completes."""
        try:
            rows = self._rows(json.loads(text))
        except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError):
            self.skipped["malformed"] = self.skipped.get("malformed", 0) + 1
            return []
        return [done for row in rows for done in self._epochs.add(row)]

    @abstractmethod
    def _rows(self, message: dict[str, Any]) -> list[InputRow]:
        """The rows of a message."""


def angle(degrees: float) -> float:
    """An angle given in degrees, in rad in [−π, π]."""
    return math.radians(math.remainder(degrees, 360.0))


def moment(text: str) -> float:
    """Unix time (s) of an ISO 8601 text. Python reads most of them, a hundred times faster than `unix_times`."""
    try:
        found = datetime.datetime.fromisoformat(text)
    except ValueError:
        return float(unix_times([text])[0])
    return (found if found.tzinfo else found.replace(tzinfo=datetime.UTC)).timestamp()
