"""The contents of one log before a source is chosen: the fixes of each source and a count of every message."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from steerway.core.records import REPORTED, Fixes


@dataclass(frozen=True)
class Recording:
    """The contents of a log by source.

    `sources` maps a name the user can give to `--source` (a talker such as "GP", "src 52", "UBX", "AIS") to its rows
    in time order; a compass without positions is a source too. `counts` has the number of messages read
    of each kind, `skipped` the number left out for each reason, `notes` the corrections (a date, a magnetic heading).
    `formatters` (n,) of a source, in NMEA 0183: bits of the formatters that gave each row's position.
    """

    format: str
    sources: dict[str, Fixes]
    counts: dict[str, int] = field(default_factory=dict)
    skipped: dict[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    formatters: dict[str, np.ndarray] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        format: str,
        sources: Iterable[Fixes],
        counts: Mapping[str, int],
        skipped: Mapping[str, int],
        notes: Iterable[str] = (),
    ) -> Self:
        """A recording of the sources that have rows, by name."""
        found = {each.source: each for each in sources if len(each)}
        return cls(format, found, dict(counts), dict(skipped), tuple(notes))


def placed(fixes: Fixes, skipped: Counter[str]) -> Fixes:
    """The rows with a time and a position, in time order; the others are counted."""
    for reason, good in (("no time", np.isfinite(fixes.time)), ("no position", fixes.has_position)):
        if lost := int((~good).sum()):
            skipped[reason] += lost
    return fixes.rows(np.isfinite(fixes.time) & fixes.has_position).in_order()


def fixes_at(source: str, rows: Mapping[float, Mapping[str, float]]) -> Fixes:
    """The fixes of values by their names, SI and radians, at each time, in time order; of times with any."""
    names = ("latitude", "longitude", *REPORTED)
    table = [[row.get(name, np.nan) for name in names] for row in rows.values()]
    time, columns = np.array(list(rows), float), np.array(table, float).reshape(-1, len(names)).T
    known = np.isfinite(time) & np.isfinite(columns).any(axis=0)
    values: dict[str, Any] = dict(zip(names, columns, strict=True))
    return Fixes(time, **values, source=source).rows(known).in_order()


def fixes_of(source: str, rows: Sequence[Sequence[float]]) -> Fixes:
    """The fixes of rows (time, latitude, longitude, *REPORTED), SI and radians, in time order."""
    names = ("time", "latitude", "longitude", *REPORTED)
    columns: dict[str, Any] = dict(zip(names, np.array(rows, float).reshape(-1, len(names)).T, strict=True))
    return Fixes(**columns, source=source).in_order()
