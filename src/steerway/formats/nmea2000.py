"""NMEA 2000 as canboat writes it: one message a line, `time,priority,pgn,source,destination,length,hex bytes…`.

Both kinds of line are read: FAST, where a long message stands whole on its line, and PLAIN, where it is split over
frames of eight bytes as on the bus. Field layouts: the canboat PGN database. Every message is a row of its own at the
time it was received; messages of one source received at the same time share a row. Only 129029 carries a time of its
own (GNSS), which its row takes.
"""

import re
from collections import Counter

import numpy as np

from steerway.core.records import Fixes
from steerway.core.timestamps import unix_times
from steerway.formats import dilution
from steerway.formats.places import places
from steerway.formats.recording import Recording

_LINE = re.compile(
    rb"(\d{4}-\d\d-\d\d[T Z_-]\d\d:\d\d:\d\d(?:[.,]\d{1,9})?)Z?,\d,(\d{5,6}),(\d{1,3}),\d{1,3},"
    rb"(\d{1,4}),((?:[0-9A-Fa-f]{2},)*[0-9A-Fa-f]{2})(?=\s|,\s|$)"
)
_ANGLE, _SPEED, _RATE = 1e-4, 1e-2, 3.125e-8  # rad, m/s, rad/s a bit
_FIRST_DATE = 946771200.0  # 2000-01-02, a year before the standard was published
_CLOCK_ERROR = 2.0  # s; a smaller difference between the logger's clock and GNSS is the delay of the message
_FRESH = 3.0  # s for which a dilution of precision holds
_MAGNETIC = 1


def _layout(length, **fields):
    """A message's layout: name = (offset in bytes, type)."""
    offsets, types = zip(*fields.values(), strict=True)
    return np.dtype({"names": list(fields), "offsets": list(offsets), "formats": list(types), "itemsize": length})


_TURNS = 0.25 / 60.0  # rev/s

_LAYOUTS = {
    127250: _layout(8, heading=(1, "<u2"), deviation=(3, "<i2"), variation=(5, "<i2"), reference=(7, "u1")),
    127251: _layout(5, rate=(1, "<i4")),
    127488: _layout(3, turns=(1, "<u2")),
    127258: _layout(6, variation=(4, "<i2")),
    128259: _layout(3, speed=(1, "<u2")),
    129025: _layout(8, latitude=(0, "<i4"), longitude=(4, "<i4")),
    129026: _layout(6, reference=(1, "u1"), cog=(2, "<u2"), sog=(4, "<u2")),
    129029: _layout(
        36,
        days=(1, "<u2"),
        clock=(3, "<u4"),
        latitude=(7, "<i8"),
        longitude=(15, "<i8"),
        method=(31, "u1"),
        hdop=(34, "<i2"),
    ),
}
_NAMES = {
    127250: "heading",
    127251: "rate of turn",
    127258: "magnetic variation",
    127488: "engine speed",
    128259: "water speed",
    129025: "position",
    129026: "SOG and COG",
    129029: "GNSS position",
}


def recognises(head: bytes) -> bool:
    """Whether there is a canboat line in the first bytes of a log."""
    return _LINE.search(head) is not None


def read(data: bytes) -> Recording:
    """The sources "src N" of a log, N being the sender's address on the bus; what is damaged is counted."""
    skipped, notes = Counter(), []
    messages = _messages(data, skipped)
    received = unix_times([stamp.decode() for stamp, *_ in messages])
    tables = {pgn: _Decoded(pgn, messages, received, skipped) for pgn in _LAYOUTS}
    counts = {f"{pgn} {_NAMES[pgn]}": len(table) for pgn, table in tables.items() if len(table)}
    _correct_clock(tables, notes)
    variation = _Variation(tables[127258])
    sources = {}
    for address in sorted({int(each) for table in tables.values() for each in np.unique(table.source)}):
        name = f"src {address}"
        own = {pgn: table.of(address) for pgn, table in tables.items()}
        fixes = _fixes(name, own, variation, skipped, notes)
        if len(fixes):
            sources[name] = fixes
    return Recording("NMEA 2000", sources, counts, dict(skipped), tuple(notes))


def _messages(data, skipped):
    """(stamp, pgn, source, bytes) of every whole message that is read."""
    found, parts = [], {}
    lines = 0
    for match in _LINE.finditer(data):
        lines += 1
        stamp, pgn, source, length, text = match.groups()
        pgn = int(pgn)
        if pgn not in _LAYOUTS:
            continue
        payload = bytes.fromhex(text.replace(b",", b"").decode())
        if len(payload) != int(length):
            skipped["length does not match the bytes"] += 1
        elif pgn == 129029 and len(payload) <= 8:
            whole = _joined(parts, int(source), payload, skipped)
            if whole:
                found.append((stamp, pgn, int(source), whole))
        elif len(payload) < _LAYOUTS[pgn].itemsize:
            skipped["message too short"] += 1
        else:
            found.append((stamp, pgn, int(source), payload))
    written = sum(1 for line in data.splitlines() if line.strip() and not line.lstrip().startswith(b"#"))
    if written > lines:
        skipped["not a canboat line"] += written - lines
    if parts:
        skipped["fast packet incomplete"] += len(parts)
    return found


def _joined(parts, source, frame, skipped):
    """The message this frame completes, or None. A frame begins with 3 bits of sequence and 5 of its place in it."""
    if len(frame) < 3:
        return None
    key, place = (source, frame[0] >> 5), frame[0] & 31
    if place == 0:
        if key in parts:
            skipped["fast packet incomplete"] += 1
        parts[key] = (frame[1], [frame[2:]])
        return None
    length, pieces = parts.get(key, (0, []))
    if place != len(pieces):
        if parts.pop(key, None):
            skipped["fast packet incomplete"] += 1
        return None
    pieces.append(frame[1:])
    whole = b"".join(pieces)
    if len(whole) < length:
        return None
    del parts[key]
    return whole[:length] if length >= _LAYOUTS[129029].itemsize else None


class _Decoded:
    """The messages of one PGN, a column a field, NaN where a value is not available."""

    def __init__(self, pgn, messages, received, skipped):
        layout = _LAYOUTS[pgn]
        rows = [row for row, message in enumerate(messages) if message[1] == pgn and np.isfinite(received[row])]
        joined = b"".join(messages[row][3][: layout.itemsize] for row in rows)
        self.raw = np.frombuffer(joined, dtype=layout)
        self.source = np.array([messages[row][2] for row in rows], dtype=int)
        self.time = received[rows]

    def __len__(self):
        return len(self.time)

    def of(self, source):
        """The messages of one sender."""
        chosen = self.source == source
        part = object.__new__(_Decoded)
        part.raw, part.source, part.time = self.raw[chosen], self.source[chosen], self.time[chosen]
        return part

    def value(self, name, unit):
        """A field in SI; the three largest numbers of its type mean not available, out of range and reserved."""
        raw = self.raw[name]
        return np.where(raw > np.iinfo(raw.dtype).max - 3, np.nan, raw * unit)

    def reference(self):
        """0 true, 1 magnetic."""
        return self.raw["reference"] & 3


class _Variation:
    """The magnetic variation (rad, + east) last sent on the bus."""

    def __init__(self, table):
        value = table.value("variation", _ANGLE)
        known = np.isfinite(value)
        order = np.argsort(table.time[known], kind="stable")
        self.time, self.angle = table.time[known][order], value[known][order]

    def at(self, time):
        if len(self.time) == 0:
            return np.full(len(time), np.nan)
        return self.angle[np.maximum(np.searchsorted(self.time, time, side="right") - 1, 0)]


def _correct_clock(tables, notes):
    """Set the logger's clock by GNSS where its error exceeds the delay of messages."""
    own = _gnss_time(tables[129029])
    late = own - tables[129029].time
    if not np.isfinite(late).any():
        return
    error = float(np.nanmedian(late))
    if abs(error) > _CLOCK_ERROR:
        for table in tables.values():
            table.time = table.time + error
        notes.append(f"the logger's clock was corrected by {error:+.1f} s to GNSS time")


def _gnss_time(table):
    """Unix s; NaN where the date is that of a receiver which has not had a fix yet (1970, 1980 or 2000)."""
    time = table.value("days", 86400.0) + table.value("clock", 1e-4)
    return np.where(time < _FIRST_DATE, np.nan, time)


def _fixes(name, own, variation, skipped, notes):
    """One source's rows."""
    columns = [_position(name, own, skipped, notes)]
    columns.append(_course(name, own[129026], variation, skipped, notes))
    columns.append(_heading(name, own[127250], variation, skipped, notes))
    columns.append({"time": own[127251].time, "yaw_rate": own[127251].value("rate", _RATE)})
    columns.append({"time": own[128259].time, "water_speed": own[128259].value("speed", _SPEED)})
    columns.append({"time": own[127488].time, "shaft": own[127488].value("turns", _TURNS)})
    time = np.unique(np.concatenate([each["time"] for each in columns]))
    fields = {"latitude": np.full(len(time), np.nan), "longitude": np.full(len(time), np.nan)}
    for each in columns:
        row = np.searchsorted(time, each.pop("time"))
        for field, values in each.items():
            column = fields.setdefault(field, np.full(len(time), np.nan))
            known = np.isfinite(values)
            column[row[known]] = values[known]
    table = Fixes(time=time, source=name, **fields)
    known = np.any([np.isfinite(values) for values in fields.values()], axis=0)
    return table.rows(known)


def _position(name, own, skipped, notes):
    """129029 with its own time where it comes as often as 129025, else 129025 with the time of reception."""
    rapid, full = own[129025], own[129029]
    method = full.raw["method"] >> 4
    full_time = _gnss_time(full)
    solved = (method >= 1) & (method <= 5) & np.isfinite(full_time)
    choices = [
        (full_time, *places(full.value("latitude", 1e-16), full.value("longitude", 1e-16)), solved),
        (rapid.time, *places(rapid.value("latitude", 1e-7), rapid.value("longitude", 1e-7)), np.full(len(rapid), True)),
    ]
    usable = [solved & np.isfinite(latitude) for _, latitude, _, solved in choices]
    chosen = 0 if usable[0].sum() > 0.9 * usable[1].sum() else 1
    time, latitude, longitude, _ = choices[chosen]
    usable = usable[chosen]
    deviation = _deviation(full, solved, (full, rapid)[chosen].time)
    if not usable.all():
        skipped["position not available"] += int((~usable).sum())
    if repeated := int(usable.sum()) - len(np.unique(time[usable])):
        skipped["position at the time of another"] += repeated
    if len(rapid) and len(full):
        kept, left, number = ((129029, 129025, len(rapid)), (129025, 129029, len(full)))[chosen]
        notes.append(f"{name}: positions from {kept}, {number} × {left} of the same receiver left out")
    if usable.any():
        notes.append(f"{name}: positions carry {('GNSS time', 'the time the logger received them')[chosen]}")
    columns = {"time": time, "latitude": latitude, "longitude": longitude, "position_std": deviation}
    return {name: column[usable] for name, column in columns.items()}


def _deviation(full, solved, moments):
    """1σ of fixes received at `moments`, from the latest dilution of precision in 129029 if it is recent."""
    known = np.flatnonzero(solved)
    if not len(known):
        return np.full(len(moments), np.nan)
    hdop, method = full.value("hdop", 0.01), full.raw["method"] >> 4
    deviations = np.array([dilution.deviation(hdop[k], int(method[k])) for k in known])
    last = np.searchsorted(full.time[known], moments, side="right") - 1
    fresh = (last >= 0) & (moments - full.time[known][last] < _FRESH)
    return np.where(fresh, deviations[last], np.nan)


def _course(name, table, variation, skipped, notes):
    cog = table.value("cog", _ANGLE)
    cog = _true(cog, table, variation.at(table.time), f"{name}: COG", skipped, notes)
    return {"time": table.time, "sog": table.value("sog", _SPEED), "cog": cog}


def _heading(name, table, variation, skipped, notes):
    heading, deviation = table.value("heading", _ANGLE), table.value("deviation", _ANGLE)
    magnetic = table.reference() == _MAGNETIC
    heading = np.where(magnetic & np.isfinite(deviation), heading + deviation, heading)
    own = table.value("variation", _ANGLE)
    angle = np.where(np.isfinite(own), own, variation.at(table.time))
    return {"time": table.time, "heading": _true(heading, table, angle, f"{name}: heading", skipped, notes)}


def _true(angle, table, variation, what, skipped, notes):
    """Angles from true north; a magnetic one is corrected by the variation, and unknown where there is none."""
    reference = table.reference()
    magnetic = np.isfinite(angle) & (reference == _MAGNETIC)
    if magnetic.any():
        lost = int((magnetic & ~np.isfinite(variation)).sum())
        if lost:
            skipped["magnetic angle without variation"] += lost
        if lost < magnetic.sum():
            notes.append(f"{what} is magnetic, corrected by the variation on the bus")
    return np.where(reference == 0, angle, np.where(magnetic, angle + variation, np.nan))
