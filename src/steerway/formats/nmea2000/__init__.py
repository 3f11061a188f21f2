"""NMEA 2000 logs of several programs and gateways, with one message or frame per line.

A long message is complete on its line, or split over frames of eight bytes as on the bus. Messages of one source
with the same receive time share a row. Only 129029 contains a time (GNSS), which becomes the time of its row. Live
links use the same decoder.
"""

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from steerway.core.records import Fixes
from steerway.formats.nmea2000.decoder import Decoder
from steerway.formats.nmea2000.fields import MESSAGES
from steerway.formats.nmea2000.text import Heard, form_of, messages
from steerway.formats.recording import Recording, fixes_at

_CLOCK_ERROR = 2.0  # s; a smaller difference between the logger's clock and GNSS is message delay
_NO_DATE = 10.0 * 86400.0  # Unix s below which a log has times of the day only
POSITIONS = 129029, 129025
Messages = Mapping[int, Sequence[dict[str, float]]]
"""Values of the messages of one sender, by PGN."""


def recognises(head: bytes) -> bool:
    """Whether the first bytes of a log contain a line of NMEA 2000."""
    return form_of(head) is not None


def read(data: bytes) -> Recording:
    """The sources "src N" of a log, where N is the sender's address on the bus; damaged lines are counted."""
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
    error = _clock_error(sources, decoder.late, notes)
    if heard and heard[0].time + error < _NO_DATE:
        notes.append("the log has no date: days are counted from 1970-01-01")
    found = {}
    for address in sorted(sources):
        name = f"src {address}"
        fixes = _fixes(name, sources[address], error, skipped, notes)
        notes += [
            f"{name}: {what} is magnetic, corrected by the variation on the bus"
            for sender, what in sorted(decoder.corrected)
            if sender == address
        ]
        if len(fixes):
            found[name] = fixes
    return Recording("NMEA 2000", found, dict(sorted(counts.items())), dict(skipped + decoder.skipped), tuple(notes))


Rows = dict[int, dict[int, list[dict[str, float]]]]
"""Rows of each sender, by PGN."""


def _decoder_for(heard: Iterable[Heard]) -> Decoder:
    """A decoder with the first magnetic variation in the log, to be used from its beginning."""
    decoder = Decoder()
    for each in heard:
        if each.pgn == 127258 and np.isnan(decoder.variation):
            decoder.values(each.pgn, each.source, each.raw, each.time)
    return decoder


def _clock_error(sources: Rows, system: Sequence[float], notes: list[str]) -> float:
    """Correction (s) of the logger's clock to GNSS time; 0 if the difference is no larger than the delay of messages.

    system: differences (s) of system time messages, used if no 129029 has a time.
    """
    late = [row["time"] - row["received"] for own in sources.values() for row in own.get(129029, ()) if "time" in row]
    late = late or list(system)
    error = float(np.median(late)) if late else 0.0
    if abs(error) <= _CLOCK_ERROR:
        return 0.0
    notes.append(f"the logger's clock was corrected by {error:+.1f} s to GNSS time")
    return error


def _fixes(name: str, own: Messages, error: float, skipped: Counter[str], notes: list[str]) -> Fixes:
    """The rows of one source, with receive times corrected by the error (s) of the logger's clock."""
    chosen = _position(name, own, skipped, notes)
    rows: dict[float, dict[str, float]] = defaultdict(dict)
    for pgn, table in own.items():
        for each in table if pgn == chosen or pgn not in POSITIONS else ():
            time = each.pop("time") if "time" in each else each["received"] + error
            rows[time] |= {
                field: value for field, value in each.items() if field != "received" and math.isfinite(value)
            }
    return fixes_at(name, rows)


def _position(name: str, own: Messages, skipped: Counter[str], notes: list[str]) -> int:
    """The PGN whose positions are used: 129029, which has a time, unless 129025 is more frequent."""
    usable = {pgn: sum(math.isfinite(each["latitude"]) for each in own.get(pgn, ())) for pgn in POSITIONS}
    chosen, other = POSITIONS if usable[129029] > 0.9 * usable[129025] else POSITIONS[::-1]
    if lost := len(own.get(chosen, ())) - usable[chosen]:
        skipped["position not available"] += lost
    if usable[chosen]:
        key = "time" if chosen == 129029 else "received"
        times = [each[key] for each in own[chosen] if math.isfinite(each["latitude"])]
        if repeated := len(times) - len(set(times)):
            skipped["second position at the same time"] += repeated
        if left_out := len(own.get(other, ())):
            notes.append(f"{name}: positions from {chosen}, {left_out} × {other} of the same receiver left out")
        notes.append(f"{name}: positions carry {'GNSS time' if key == 'time' else 'the time the logger received them'}")
    return chosen
