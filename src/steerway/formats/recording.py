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

    `sources` maps a name that the user can give to `--source` (a talker such as "GP", "src 52", "UBX", "AIS") to its
    rows in time order; a compass without positions is a source too. `counts`: messages read, by kind. `skipped`:
    messages and rows left out, by reason. `notes`: corrections (a date, a magnetic heading). `formatters`: in NMEA
    0183, an array (n,) per source; its bits are the formatters with the position of the row.
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
        """A recording of the sources that have rows."""
        found = {each.source: each for each in sources if len(each)}
        return cls(format, found, dict(counts), dict(skipped), tuple(notes))


def placed(fixes: Fixes, skipped: Counter[str]) -> Fixes:
    """The rows with a time and a position, in time order; other rows are counted in `skipped`."""
    for reason, good in (("no time", np.isfinite(fixes.time)), ("no position", fixes.has_position)):
        if lost := int((~good).sum()):
            skipped[reason] += lost
    return fixes.rows(np.isfinite(fixes.time) & fixes.has_position).in_order()


def fixes_at(source: str, rows: Mapping[float, Mapping[str, float]]) -> Fixes:
    """Fixes, in time order, from values by field name (SI, rad) at each time; times without values are left out."""
    names = ("latitude", "longitude", *REPORTED)
    table = [[row.get(name, np.nan) for name in names] for row in rows.values()]
    time, columns = np.array(list(rows), float), np.array(table, float).reshape(-1, len(names)).T
    known = np.isfinite(time) & np.isfinite(columns).any(axis=0)
    values: dict[str, Any] = dict(zip(names, columns, strict=True))
    return Fixes(time, **values, source=source).rows(known).in_order()


def fixes_of(source: str, rows: Sequence[Sequence[float]]) -> Fixes:
    """Fixes from rows (time, latitude, longitude, *REPORTED) in SI and radians, in time order."""
    names = ("time", "latitude", "longitude", *REPORTED)
    columns: dict[str, Any] = dict(zip(names, np.array(rows, float).reshape(-1, len(names)).T, strict=True))
    return Fixes(**columns, source=source).in_order()
