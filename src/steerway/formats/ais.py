"""Raw AIS: !AIVDM and similar sentences, decoded by pyais; one track per vessel.

The time of a report comes from its tag block (`c:`), a prefix or a suffix. The delay of its
transmission is removed by the UTC second that the report contains (ITU-R M.1371-5, annex 8, table 48). For reports
without a time, the clocks in the same log are used: RMC sentences and reports of base stations (types 4 and 11).
"""

import datetime
import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from pyais.constants import TurnRate
from pyais.exceptions import AISBaseException
from pyais.messages import AISSentence, NMEASentenceFactory

from steerway.core.arrays import Floats
from steerway.core.earth import KNOT
from steerway.core.records import Fixes
from steerway.core.timestamps import dated, unix_times
from steerway.formats.nmea0183 import fields, sentences
from steerway.formats.places import places
from steerway.formats.recording import Recording, placed

_SENTENCE = re.compile(rb"([^\r\n!]*)(![A-Za-z]{2}VD[MO],[^\r\n!\\]*)")
_BODY = re.compile(rb"![A-Z]{2}VD[MO],\d,\d,\d?,[^,]*,[0-W`-w]+,[0-5](?:,[^*,]*)?\*[0-9A-Fa-f]{2}")
_TAG_TIME = re.compile(rb"[\\,]c:([12]\d{9}(?:\d{3})?)(?!\d)")
_ISO = re.compile(rb"\d{4}-?\d\d-?\d\d[T _-]\d\d:?\d\d:?\d\d(?:[.,]\d+)?(?:Z|[+-]\d\d:?\d\d)?")
_UNIX = re.compile(rb"(?<![\w.:])([12]\d{9}(?:\.\d+)?|[12]\d{12})(?![\d.])")
_CLASS_B = re.compile(rb"![A-Z]{2}VD[MO],[12],1,\d?,[^,]*,([BC][0-W`-w]{6})")  # messages of type 18 and 19
_POSITION_TYPES = {1, 2, 3, 18, 19, 27}
_CLOCK_TYPES = {4, 11}
_EARLY, _LATE = -3.5, 10.5  # s, plausible delay of a report; negative if the logger's clock is slow
_PATIENCE = 64  # largest number of incomplete messages in memory


def recognises(head: bytes) -> bool:
    """Whether there is an AIS sentence in the first bytes of a log."""
    return _BODY.search(head) is not None


def read(data: bytes) -> Recording:
    """The source "AIS" with the reports of every vessel, sorted by vessel and time; rejected sentences are counted."""
    counts, skipped, notes = Counter[str](), Counter[str](), []
    reports, stamps, clocks = [], [], []
    for place, stamp, message in _messages(data, counts, skipped):
        if message.msg_type in _CLOCK_TYPES:
            clocks.append((place, _utc(message)))
        elif (row := _row(message)) is None:
            skipped["message too short"] += 1
        else:
            reports.append((place, *row))
            stamps.append(stamp)
    if not reports:
        return Recording("AIS", {}, dict(counts), dict(skipped))
    place, second, *columns = np.array(reports, dtype=np.float64).T
    time = _made(_times(stamps), second)
    silent = np.isnan(time)
    if silent.any() and (clocks := sorted([*clocks, *_receiver_clocks(data)])):
        time[silent] = _by_clocks(place[silent], second[silent], np.array(clocks))
        notes.append(f"{silent.sum()} reports without a time: time from the base station or RMC before them in the log")
    if np.isnan(time).all():
        notes.append(
            "no AIS report has a time (tag block c:, prefix, suffix) and the log has no clock: no report can be used"
        )
    return Recording.of("AIS", (_fixes(time, columns, skipped),), counts, skipped, notes)


def class_b(data: bytes) -> set[int]:
    """MMSI of the vessels that send class B messages (types 18 and 19), from the first bits of the messages."""
    found = set()
    for match in _CLASS_B.finditer(data):
        number = 0
        for character in match[1]:
            number = number << 6 | (character - 48 if character < 88 else character - 56)
        found.add(number >> 4 & (1 << 30) - 1)
    return found


Parts = dict[tuple[Any, ...], tuple[str | None, list[AISSentence]]]
"""The parts of incomplete messages, with the stamp of the first part."""


def _messages(data: bytes, counts: Counter[str], skipped: Counter[str]) -> Iterator[tuple[int, str | None, Any]]:
    """(byte offset, stamp, decoded message) of every position or clock message; the others are counted."""
    parts: Parts = {}
    last, stamp = 0, None
    for match in _SENTENCE.finditer(data):
        before, text = match.groups()
        body = _BODY.match(text)
        of_line = stamp if match.start() == last else None  # a line can hold two sentences
        stamp, last = _stamp(before, text[body.end() :] if body else b"") or of_line, match.end()
        if body is None:
            skipped["AIS sentence incomplete"] += 1
            continue
        try:
            part: Any = NMEASentenceFactory.produce(body.group())
            if not part.is_valid:
                skipped["checksum"] += 1
                continue
            made, sentence = (stamp, part) if part.frag_cnt <= 1 else _joined(parts, stamp, part, skipped)
            if sentence is None:
                continue
            counts[f"type {sentence.ais_id}"] += 1
            if sentence.ais_id in _POSITION_TYPES or sentence.ais_id in _CLOCK_TYPES:
                yield match.start(), made, sentence.decode()
        except (AISBaseException, ArithmeticError, LookupError, TypeError, ValueError):
            skipped["cannot be decoded"] += 1
    if parts:
        skipped["part of a message missing"] += len(parts)


def _joined(
    parts: Parts, stamp: str | None, sentence: AISSentence, skipped: Counter[str]
) -> tuple[str | None, AISSentence | None]:
    """(stamp of the first part, message that this part completes or None)."""
    key = (sentence.seq_id, sentence.channel, sentence.talker_id, sentence.frag_cnt)
    if sentence.frag_num == 1:
        if parts.pop(key, None):
            skipped["part of a message missing"] += 1
        if len(parts) >= _PATIENCE:
            parts.pop(next(iter(parts)))
            skipped["part of a message missing"] += 1
        parts[key] = (stamp, [sentence])
        return stamp, None
    first, pieces = parts.get(key, (None, []))
    if sentence.frag_num != len(pieces) + 1:
        skipped["part of a message missing"] += 1
        parts.pop(key, None)
        return stamp, None
    pieces.append(sentence)
    if len(pieces) < sentence.frag_cnt:
        return first, None
    del parts[key]
    return first or stamp, AISSentence.assemble_from_iterable(pieces)


def _stamp(before: bytes, after: bytes) -> str | None:
    """The time in a sentence's tag block, prefix or suffix, as text; None for a sentence without time."""
    if not before and not after:
        return None
    for pattern, text in ((_TAG_TIME, before), (_ISO, before), (_UNIX, before), (_UNIX, after), (_ISO, after)):
        if found := pattern.search(text):
            return found.group(found.lastindex or 0).decode()
    return None


def _times(stamps: Sequence[str | None]) -> Floats:
    """Unix time (n,) of stamps, which are ISO dates or Unix s or ms; NaN for None."""
    numbers = np.array([float(stamp) if stamp and stamp.replace(".", "").isdigit() else math.nan for stamp in stamps])
    dates = unix_times([stamp if np.isnan(number) else None for stamp, number in zip(stamps, numbers, strict=True)])
    return dated(np.where(np.isnan(numbers), dates, np.where(numbers > 1e11, numbers / 1000.0, numbers)))


def _row(message: Any) -> tuple[float, ...] | None:
    """UTC second, MMSI, latitude, longitude (deg), SOG (kn), COG, heading (deg), ROT (deg/min); None if truncated."""
    turn = getattr(message, "turn", math.nan)
    row = (
        getattr(message, "second", 60),
        message.mmsi,
        message.lat,
        message.lon,
        message.speed if message.msg_type != 27 or message.speed != 63 else math.nan,
        message.course,
        getattr(message, "heading", 511),
        math.nan if isinstance(turn, TurnRate) else turn,
    )
    return None if None in row else row


def _utc(message: Any) -> float:
    """Unix time of a base station's report; NaN if it has none."""
    try:
        clock = (message.year, message.month, message.day, message.hour, message.minute, message.second)
        return datetime.datetime(*clock, tzinfo=datetime.UTC).timestamp()
    except (TypeError, ValueError):
        return math.nan


def _made(received: Floats, second: Floats) -> Floats:
    """Time (n,) at which reports were made: their UTC second if the delay is plausible, else the time of reception."""
    delay = (received - second + 30.0) % 60.0 - 30.0
    plausible = (second < 60) & (delay >= _EARLY) & (delay <= _LATE)
    return np.where(plausible, np.round(received - delay), received)


def _receiver_clocks(data: bytes) -> Iterator[tuple[int, float]]:
    """(byte offset, Unix time) of the RMC sentences with a valid fix."""
    offset, kind, _, values = sentences(data)
    dated = (kind == fields.RMC) & np.isfinite(values[:, (fields.DAY, fields.TOD, fields.LAT)]).all(axis=1)
    time = 86400.0 * values[dated, fields.DAY] + values[dated, fields.TOD]
    return zip(offset[dated].tolist(), time.tolist(), strict=True)


def _by_clocks(place: Floats, second: Floats, clocks: Floats) -> Floats:
    """Time (n,) with each report's UTC second, nearest to the last clock before the report, else to the first clock."""
    at, time = clocks[np.isfinite(clocks[:, 1])].T
    if len(at) == 0:
        return np.full(len(place), np.nan)
    anchor = time[np.maximum(np.searchsorted(at, place) - 1, 0)]
    shift = (second - anchor + 30.0) % 60.0 - 30.0
    return np.where(second < 60, anchor + shift, anchor)


def _fixes(time: Floats, columns: Sequence[Floats], skipped: Counter[str]) -> Fixes:
    """The reports as Fixes; reports without time or position, and duplicates, are left out and counted."""
    mmsi, latitude, longitude, sog, cog, heading, turn = columns
    latitude, longitude = places(latitude, longitude)
    table = Fixes(
        time=time,
        latitude=latitude,
        longitude=longitude,
        sog=np.where(sog < 102.25, sog * KNOT, np.nan),
        cog=np.radians(np.where(cog < 360.0, cog, np.nan)),
        heading=np.radians(np.where(heading < 360.0, heading, np.nan)),
        yaw_rate=np.radians(turn / 60.0),
        mmsi=mmsi.astype(np.int64),
        source="AIS",
    )
    table = placed(table, skipped)
    keys = (table.mmsi, table.time, table.latitude, table.longitude)
    fresh = np.any([np.diff(key, prepend=np.nan) != 0.0 for key in keys if key is not None], axis=0)
    if not fresh.all():
        skipped["received twice"] += int((~fresh).sum())
    return table.rows(fresh)
