"""The HTML page of an archive: map, counts, coverage in time, intervals, consistency by class, worst vessels."""

import itertools
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from steerway.archive.store import Store, date_of, left_out_of
from steerway.archive.tables import COUNTED_INTERVALS
from steerway.archive.tracks import INTERVALS
from steerway.core.arrays import Floats
from steerway.formats.ais_tables import MOBILES
from steerway.report.page import Table, write_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_MAP_POINTS = 200_000
_WORST = 20
_LEAST_FIXES = 100
"""Minimum number of fixes to show a mean NIS; with so many its standard deviation is 0.2."""


def write(store: Store, manifest: dict[str, Any]) -> None:
    """Write index.html; nothing if no unit is done."""
    units = sorted(store.done())
    if not units:
        return
    numbers = {unit: store.numbers(*unit) for unit in units}
    totals: Counter[str] = Counter()
    for each in numbers.values():
        totals.update({name: value for name, value in each.items() if isinstance(value, int | float)})
    days = sorted({day for day, _ in units})
    counts = [
        ("days", f"{date_of(days[0])} to {date_of(days[-1])}, {len(days)}"),
        ("reports", f"{totals['reports']:,}, of which {totals['doubled']:,} were duplicates"),
        ("rows", f"{totals['rows']:,}"),
        ("rejected even as a manoeuvre", f"{totals['rejected']:,}"),
        *((f"left out: {reason}", f"{count:,}") for reason, count in left_out_of(manifest).most_common()),
    ]
    names = store.names()
    intervals = np.sum([each["intervals"] for each in numbers.values()], axis=0)
    tables: list[Table] = [
        ("Counts", ("", ""), counts),
        (
            "Consistency (2 is expected)",
            ("class", "interval (s)", "", "fixes", "mean NIS"),
            _consistency(numbers.values()),
        ),
        ("Events", ("event", "count"), _event_counts(store)),
        ("Vessels with the most jumps and wrong values", ("vessel", "events"), _named(_worst(store), names)),
        (
            "Vessels with the largest mean NIS under way (2 is expected)",
            ("vessel", "fixes", "mean NIS"),
            _named(_inconsistent(numbers.values()), names),
        ),
    ]

    def figures() -> list[tuple["Figure", str]]:
        return [
            (_map(store, totals["rows"]), "Estimated positions; lighter where there are more."),
            (_coverage(numbers, days), "Rows per day."),
            (_intervals(intervals), "Intervals between reports."),
        ]

    count = len(manifest["inputs"])
    title = f"Archive of {count} input{'' if count == 1 else 's'}"
    write_page(store.root / "index.html", title, tables=tables, figures=figures)


def _consistency(numbers: Iterable[dict[str, Any]]) -> list[tuple[str, ...]]:
    fixes, total = np.sum([each["cells"] for each in numbers], axis=0)
    intervals = [f"≤ {edge:g}" for edge in INTERVALS] + [f"> {INTERVALS[-1]:g}"]
    cells = itertools.product(MOBILES, intervals, ("at rest", "under way"))
    return [(*words, f"{n:,.0f}", f"{nis / n:.2f}") for words, n, nis in zip(cells, fixes, total, strict=True) if n]


def _event_counts(store: Store) -> list[tuple[str, str]]:
    files = store.files("events")
    counted = pl.scan_parquet(files, glob=False).group_by("event").len().collect().sort("len", descending=True)
    return [(event, f"{count:,}") for event, count in counted.iter_rows()]


def _worst(store: Store) -> list[tuple[Any, ...]]:
    wrong = pl.col("event").is_in(["jump", "moved", "another ship", "speed", "course"])
    events = pl.scan_parquet(store.files("events"), glob=False).filter(wrong)
    counted = events.group_by("mmsi").len().sort(["len", "mmsi"], descending=[True, False]).head(_WORST).collect()
    return list(counted.iter_rows())


def _inconsistent(numbers: Iterable[dict[str, Any]]) -> list[tuple[Any, ...]]:
    fixes, total = Counter[int](), Counter[int]()
    for each in numbers:
        vessels, counts, sums = each["nis_of"]
        fixes.update(dict(zip(vessels, map(int, counts), strict=True)))
        total.update(dict(zip(vessels, sums, strict=True)))
    judged = [(vessel, count, total[vessel] / count) for vessel, count in fixes.items() if count >= _LEAST_FIXES]
    judged.sort(key=lambda row: (-row[2], row[0]))
    return [(vessel, f"{count:,}", f"{mean:.2f}") for vessel, count, mean in judged[:_WORST]]


def _named(rows: Iterable[Sequence[Any]], names: dict[int, str]) -> list[tuple[Any, ...]]:
    return [(names.get(vessel, vessel), *others) for vessel, *others in rows]


def _drawing(height: float) -> tuple["Figure", "Axes"]:
    """A figure with one pair of axes. Fixed margins save the time of a layout engine."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, height))
    return figure, figure.add_axes((0.08, 0.6 / height, 0.9, 1.0 - 0.7 / height))


def _map(store: Store, rows: int) -> "Figure":
    every = max(1, rows // _MAP_POINTS)
    parts = [
        pl.scan_parquet(path, glob=False).select("lon_deg", "lat_deg").gather_every(every).collect().drop_nulls()
        for path in store.files("estimate")
    ]
    points = pl.concat(parts)
    longitude, latitude = points["lon_deg"].to_numpy(), points["lat_deg"].to_numpy()
    figure, axes = _drawing(8.0)
    if len(points):
        axes.hexbin(longitude, latitude, gridsize=300, bins="log", mincnt=1, cmap="viridis", linewidths=0.0)
        axes.set_aspect(1.0 / max(np.cos(np.radians(np.median(latitude))), 0.1))
    axes.set_xlabel("longitude (°)")
    axes.set_ylabel("latitude (°)")
    axes.grid(alpha=0.25)
    return figure


def _coverage(numbers: dict[tuple[int, int], dict[str, Any]], days: Sequence[int]) -> "Figure":
    figure, axes = _drawing(3.0)
    rows = [sum(each["rows"] for (day, _), each in numbers.items() if day == wanted) for wanted in days]
    axes.bar([date_of(day) for day in days], rows)
    axes.set_ylabel("rows")
    if len(days) > 10:
        axes.set_xticks(range(0, len(days), -(-len(days) // 10)))
    return figure


def _intervals(counts: Floats) -> "Figure":
    figure, axes = _drawing(3.0)
    names = [f"≤ {edge:g}" for edge in COUNTED_INTERVALS] + ["longer"]
    axes.bar(names, counts)
    axes.set_xlabel("interval (s)")
    axes.set_ylabel("reports")
    return figure
