"""NMEA 2000 logs, as several programs and gateways write them, one message or frame a line.

Long messages stand whole on their line or split over frames of eight bytes as on the bus. Every message is a row of its
own at the time it was received; messages of one source received at the same time share a row. Only 129029 carries a
time of its own (GNSS), which its row takes. The same decoder serves the wire.
"""

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.records import Fixes
from steerway.formats.nmea2000.decoder import Decoder
from steerway.formats.nmea2000.fields import MESSAGES
from steerway.formats.nmea2000.text import Heard, form_of, messages
from steerway.formats.recording import Recording

_CLOCK_ERROR = 2.0  # s; a smaller difference between the logger's clock and GNSS is the delay of the message
_NO_DATE = 10.0 * 86400.0  # Unix s below which a log has times of the day only
POSITIONS = 129029, 129025


def recognises(head: bytes) -> bool:
    """Whether there is a line of NMEA 2000 in the first bytes of a log."""
    return form_of(head) is not None


def read(data: bytes) -> Recording:
    """The sources "src N" of a log, N being the sender's address on the bus; what is damaged is counted."""
    skipped, counts = Counter[str](), Counter[str]()
    notes: list[str] = []
    heard = [each for each in messages(data, skipped) if np.isfinite(each.time)]
    decoder = _decoder_for(heard)
    sources: Rows = defaultdict(lambda: defaultdict(list))
    for each in heard:
        counts[f"{each.pgn} {MESSAGES[each.pgn].title}"] += 1
        if values := decoder.values(each.pgn, each.source, each.raw, each.time):
            sources[each.source][each.pgn].append({"received": each.time} | values)
        elif each.pgn in POSITIONS:
            sources[each.source][each.pgn].append({"received": each.time, "latitude": np.nan})
    error = _clock_error(sources, notes)
    if heard and heard[0].time + error < _NO_DATE:
        notes.append("the log has times without a date: its days are counted from 1970-01-01")
    found = {}
    for address in sorted(sources):
        name, own = f"src {address}", {pgn: _columns(rows, error) for pgn, rows in sources[address].items()}
        fixes = _fixes(name, own, skipped, notes)
        notes += [
            f"{name}: {what} is magnetic, corrected by the variation on the bus"
            for sender, what in sorted(decoder.corrected)
            if sender == address
        ]
        if len(fixes):
            found[name] = fixes
    return Recording("NMEA 2000", found, dict(sorted(counts.items())), dict(skipped + decoder.skipped), tuple(notes))


Rows = dict[int, dict[int, list[dict[str, float]]]]
"""The latest of each sender, by the number of the message."""


def _decoder_for(heard: Iterable[Heard]) -> Decoder:
    """A decoder that knows the first variation of the log from its beginning."""
    decoder = Decoder()
    for each in heard:
        if each.pgn == 127258 and np.isnan(decoder.variation):
            decoder.values(each.pgn, each.source, each.raw, each.time)
    return decoder


def _clock_error(sources: Rows, notes: list[str]) -> float:
    """s by which the logger's clock is set to that of GNSS, where its error exceeds the delay of messages; else 0."""
    late = [row["time"] - row["received"] for own in sources.values() for row in own.get(129029, ()) if "time" in row]
    error = float(np.median(late)) if late else 0.0
    if abs(error) <= _CLOCK_ERROR:
        return 0.0
    notes.append(f"the logger's clock was corrected by {error:+.1f} s to GNSS time")
    return error


def _columns(rows: Sequence[dict[str, float]], error: float) -> dict[str, np.ndarray]:
    """The rows of one message as columns; `received` with the clock corrected, `time` what the row has of its own."""
    names = dict.fromkeys(name for row in rows for name in row)
    columns = {name: np.array([row.get(name, np.nan) for row in rows]) for name in names}
    columns["received"] += error
    return columns


def _fixes(name: str, own: dict[int, dict[str, Floats]], skipped: Counter[str], notes: list[str]) -> Fixes:
    """One source's rows."""
    parts = [_position(name, own, skipped, notes)]
    parts += [{"time": own[pgn]["received"]} | own[pgn] for pgn in own if pgn not in POSITIONS]
    time = np.unique(np.concatenate([each["time"] for each in parts]))
    fields: dict[str, Any] = {"latitude": np.full(len(time), np.nan), "longitude": np.full(len(time), np.nan)}
    for each in parts:
        row = np.searchsorted(time, each.pop("time"))
        each.pop("received", None)
        for field, values in each.items():
            column = fields.setdefault(field, np.full(len(time), np.nan))
            known = np.isfinite(values)
            column[row[known]] = values[known]
    known = np.any([np.isfinite(values) for values in fields.values()], axis=0)
    return Fixes(time=time, source=name, **fields).rows(known)


def _position(
    name: str, own: dict[int, dict[str, Floats]], skipped: Counter[str], notes: list[str]
) -> dict[str, np.ndarray]:
    """129029 with its own time where it comes as often as 129025, else 129025 with the time of reception."""
    usable = {pgn: np.isfinite(own[pgn]["latitude"]) if pgn in own else np.zeros(0, bool) for pgn in POSITIONS}
    chosen, other = POSITIONS if usable[129029].sum() > 0.9 * usable[129025].sum() else reversed(POSITIONS)
    kept = usable[chosen]
    if not len(kept):
        return {"time": np.zeros(0)}
    table = own[chosen]
    if not kept.all():
        skipped["position not available"] += int((~kept).sum())
    if not kept.any():
        return {"time": np.zeros(0)}
    time = table["time" if chosen == 129029 else "received"][kept]
    if repeated := len(time) - len(np.unique(time)):
        skipped["position at the time of another"] += repeated
    if len(usable[other]):
        left_out = len(usable[other])
        notes.append(f"{name}: positions from {chosen}, {left_out} × {other} of the same receiver left out")
    notes.append(f"{name}: positions carry {'GNSS time' if chosen == 129029 else 'the time the logger received them'}")
    return {"time": time} | {each: table[each][kept] for each in ("latitude", "longitude", "position_std")}
