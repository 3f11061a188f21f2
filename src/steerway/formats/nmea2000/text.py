"""Lines of NMEA 2000 logs: canboat's text and JSON, candump, Yacht Devices RAW, Actisense's N2K ASCII, SeaSmart."""

import json
import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from steerway.core.timestamps import unix_times
from steerway.formats.nmea2000.fields import ANGLES, MESSAGES
from steerway.formats.nmea2000.frames import FAST, Frame, Joiner, frame_of

_CANBOAT = re.compile(
    rb"(?P<stamp>\d{4}-\d\d-\d\d[T Z_-]\d\d:\d\d:\d\d(?:[.,]\d{1,9})?)Z?,\d,(?P<pgn>\d{5,6}),(?P<source>\d{1,3}),"
    rb"\d{1,3},(?P<length>\d{1,4}),(?P<data>(?:[0-9A-Fa-f]{2},)*[0-9A-Fa-f]{2})(?=\s|,\s|$)"
)
_JSON = re.compile(rb'^[ \t]*(\{.*"pgn"\s*:.*\})\s*$', re.M)
_CANDUMP = re.compile(
    rb"^[ \t]*\((?P<unix>\d{1,12}\.\d{1,9}|\d{4}-\d\d-\d\d \d\d:\d\d:\d\d\.\d{1,9})\)\s+"
    rb"\S+\s+(?P<id>[0-9A-F]{8})(?:#|\s+\[\d\]\s+)(?P<data>(?:[0-9A-F]{2} ?){1,8})",
    re.M | re.I,
)
_CLOCK = rb"(?P<hour>[0-2]\d):?(?P<minute>[0-5]\d):?(?P<second>[0-6]\d\.\d{3})"
_RAW = re.compile(rb"^" + _CLOCK + rb" R (?P<id>[0-9A-F]{8})(?P<data>(?: [0-9A-F]{2}){1,8})\s*$", re.M | re.I)
_ACTISENSE = re.compile(
    rb"^A" + _CLOCK + rb" (?P<source>[0-9A-F]{2})[0-9A-F]{2}[0-7] (?P<hex>[0-9A-F]{5}) (?P<data>(?:[0-9A-F]{2})+)\s*$",
    re.M,
)
_ANALYZED = re.compile(
    rb"^(?P<stamp>\d{4}-\d\d-\d\d[T -]\d\d:\d\d:\d\d(?:\.\d{1,9})?)Z? +\d +(?P<source>\d{1,3}) +\d{1,3} "
    rb"+(?P<pgn>\d{5,6}) "
    rb"[^:\r\n]*: +(?P<fields>[^=\r\n]+=[^\r\n]*)$",
    re.M,
)
"""Readable text of canboat's analyzer."""
_SEASMART = re.compile(
    rb"^\$PCDIN,(?P<hex>[0-9A-F]{6}),(?P<tick>[0-9A-F]{8}),(?P<source>[0-9A-F]{2}),(?P<data>(?:[0-9A-F]{2})+)\*", re.M
)
"""Lines of SeaSmart.Net gateways, between sentences of NMEA 0183; their time is in ms of the gateway's clock."""
FORMS = (_CANBOAT, _JSON, _CANDUMP, _RAW, _ACTISENSE, _SEASMART, _ANALYZED)
_DAY = 86400.0


Fields = tuple[tuple[int, int, str], dict[str, Any]]
"""A message that another program has decoded: (PGN, source, time as text), and its fields by name."""


class Heard(NamedTuple):
    """A complete message: receive time (Unix s, NaN for a damaged stamp), PGN, sender and raw field values."""

    time: float
    pgn: int
    source: int
    raw: tuple[int, ...]


def form_of(text: bytes) -> re.Pattern[bytes] | None:
    """The form that most lines of a log have; None if no line has any."""
    counts = {form: sum(1 for _ in form.finditer(text)) for form in FORMS}
    best = max(FORMS, key=counts.__getitem__)
    return best if counts[best] else None


def messages(data: bytes, skipped: Counter[str]) -> list[Heard]:
    """The complete messages whose PGN is in MESSAGES, in order of the log; lines left out are counted by reason."""
    form = form_of(data)
    lines = list(form.finditer(data)) if form else []
    written = sum(1 for line in data.splitlines() if line.strip() and not line.lstrip().startswith(b"#"))
    if written > len(lines):
        skipped["not a line of NMEA 2000"] += written - len(lines)
    if form is _JSON:
        return _of_fields(_parsed([match.group(1) for match in lines], skipped))
    if form is _ANALYZED:
        return _of_fields([_analyzed(match) for match in lines])
    found, joiner = [], Joiner()
    for time, pgn, source, payload in _payloads(form, lines, skipped) if form else ():
        if pgn not in MESSAGES:
            continue
        whole = joiner.add(Frame(pgn, source, 255, 3, payload)) if pgn in FAST and len(payload) <= 8 else payload
        if whole is None:
            continue
        if len(whole) < MESSAGES[pgn].length:
            skipped["message too short"] += 1
            continue
        found.append(Heard(time, pgn, source, MESSAGES[pgn].raw(whole)))
    if joiner.lost:
        skipped["fast packet incomplete"] += joiner.lost
    return found


def frame_of_line(line: bytes) -> Frame | None:
    """The frame in a line of Yacht Devices' RAW form that was received from the bus; None for any other line."""
    match = _RAW.match(line)
    return match and frame_of(int(match["id"], 16), bytes.fromhex(match["data"].decode()))


def _payloads(
    form: re.Pattern[bytes], lines: Sequence[re.Match[bytes]], skipped: Counter[str]
) -> Iterator[tuple[float, int, int, bytes]]:
    stamps = unix_times([each["stamp"].decode() for each in lines]) if form is _CANBOAT else _clocks(form, lines)
    for match, time in zip(lines, stamps, strict=True):
        try:
            payload = bytes.fromhex(match["data"].replace(b",", b"").decode())
        except ValueError:  # odd number of hexadecimal digits
            skipped["line not understood"] += 1
            continue
        if form is _CANBOAT:
            if len(payload) != int(match["length"]):
                skipped["length does not match the bytes"] += 1
                continue
            yield time, int(match["pgn"]), int(match["source"]), payload
        elif form in (_ACTISENSE, _SEASMART):
            yield time, int(match["hex"], 16), int(match["source"], 16), payload
        else:
            frame = frame_of(int(match["id"], 16), payload)
            yield time, frame.pgn, frame.source, payload


def _clocks(form: re.Pattern[bytes], lines: Sequence[re.Match[bytes]]) -> list[float]:
    """Unix times; for a form without dates, seconds since the midnight before the log began, or the gateway's clock."""
    if form is _CANDUMP:
        stamps = [each["unix"].decode() for each in lines]
        return list(unix_times(stamps)) if " " in stamps[0] else [float(each) for each in stamps]
    if form is _SEASMART:
        return [1e-3 * int(each["tick"], 16) for each in lines]
    times, day, last = [], 0.0, 0.0
    for each in lines:
        clock = 3600.0 * int(each["hour"]) + 60.0 * int(each["minute"]) + float(each["second"])
        if clock < last - 0.5 * _DAY:
            day += _DAY
        last = clock
        times.append(day + clock)
    return times


def _analyzed(match: re.Match[bytes]) -> Fields:
    """((PGN, source, time), fields) of a line of canboat's analyzer, numbers without their units."""
    pairs = (each.split("=", 1) for each in match["fields"].decode("utf-8", "replace").split(";") if "=" in each)
    fields = {name.strip(): _value(text.strip()) for name, text in pairs}
    return (int(match["pgn"]), int(match["source"]), match["stamp"].decode()), fields


def _value(text: str) -> float | str:
    try:
        return float(text.split()[0])
    except (ValueError, IndexError):
        return text


def _parsed(lines: Sequence[bytes], skipped: Counter[str]) -> list[Fields]:
    """((PGN, source, time), fields) of every valid line of JSON."""
    found = []
    for line in lines:
        try:
            each = json.loads(line)
            kind, fields = (each["pgn"], each["src"], str(each["timestamp"])), each["fields"]
        except (ValueError, KeyError, TypeError, RecursionError):
            skipped["not a line of NMEA 2000"] += 1
            continue
        if isinstance(fields, dict) and isinstance(kind[0], int) and isinstance(kind[1], int):
            found.append((kind, fields))
    return found


def _of_fields(found: Sequence[Fields]) -> list[Heard]:
    """The messages whose PGN is in MESSAGES, encoded as raw field values."""
    found = [each for each in found if each[0][0] in MESSAGES]
    angles = [fields[name] for _, fields in found for name in ANGLES if isinstance(fields.get(name), int | float)]
    in_radians = max(angles, default=0.0) <= math.tau  # a log in which all courses are below 6.3° is unlikely
    times = unix_times([stamp for (_, _, stamp), _ in found])
    return [
        Heard(time, pgn, source, MESSAGES[pgn].raw_of_json(fields, in_radians))
        for time, ((pgn, source, _), fields) in zip(times, found, strict=True)
    ]
