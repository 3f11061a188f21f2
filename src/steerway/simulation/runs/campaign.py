"""Results of many seeds in one table: median, 5 % and 95 % of every number."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.files import complete_or_absent, made_directory
from steerway.simulation.runs.files import write_results

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def gathered(results: Sequence[dict[str, float]]) -> dict[str, np.ndarray]:
    """Results by name, (seeds,) each."""
    return {name: np.array([each[name] for each in results]) for name in results[0]}


def spread(results: Sequence[dict[str, float]]) -> list[tuple[str, str, str, str, str]]:
    """(name, median, 5 %, 95 %, number of seeds without a value) of every number."""
    rows = []
    for name, values in gathered(results).items():
        known = values[np.isfinite(values)]
        if len(known) == 0:
            rows.append((name, "unknown", "", "", str(len(values))))
            continue
        low, middle, high = np.quantile(known, (0.05, 0.5, 0.95))
        rows.append((name, f"{middle:.4g}", f"{low:.4g}", f"{high:.4g}", str(len(values) - len(known) or "")))
    return rows


SPREAD_COLUMNS = ("", "median", "5 %", "95 %", "seeds without")


def write_campaign(
    seeds: Iterable[int], results: Sequence[dict[str, float]], directory: Path, title: str, remarks: Sequence[str] = ()
) -> list[Path]:
    """Write campaign.parquet (one row per seed), results.json (medians) and index.html; returns their paths."""
    import polars as pl

    from steerway.report.page import write_page

    directory = made_directory(directory)
    table, medians, page = directory / "campaign.parquet", directory / "results.json", directory / "index.html"
    columns = gathered(results)
    rows = [pl.Series("seed", list(seeds)), *(pl.Series(n, v, nan_to_null=True) for n, v in columns.items())]
    with complete_or_absent(table) as file:
        pl.DataFrame(rows).write_parquet(file)
    write_results({name: _median(values) for name, values in columns.items()} | {"seeds": len(results)}, medians)
    write_page(
        page,
        title,
        tables=[(f"{len(results)} seeds", SPREAD_COLUMNS, spread(results))],
        figures=lambda: [(_figure(columns), "Cumulative distribution of each number over the seeds.")],
        remarks=remarks,
    )
    return [table, medians, page]


def _median(values: Floats) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else None


_SHOWN = {
    "cross_track_rms_m": "true cross-track RMS (m)",
    "cog_rms_deg": "COG error RMS (°)",
    "sog_rms_mps": "SOG error RMS (m/s)",
    "duration_s": "time (s)",
}


def _figure(columns: dict[str, Floats]) -> "Figure":
    from matplotlib.figure import Figure

    from steerway.report.drawing import OURS

    figure = Figure(figsize=(11.0, 6.0), layout="constrained")
    for axes, (name, label) in zip(figure.subplots(2, 2).flat, _SHOWN.items(), strict=True):
        known = np.sort(columns[name][np.isfinite(columns[name])])
        axes.step(known, np.arange(1, len(known) + 1) / max(len(known), 1), where="post", color=OURS)
        axes.set_xlabel(label)
        axes.set_ylabel("share of seeds")
        axes.set_ylim(0.0, 1.02)
        axes.grid(alpha=0.25)
        if len(known) and known[-1] - known[0] < 1e-9 * max(abs(known[0]), 1.0) + 1e-12 and math.isfinite(known[0]):
            axes.set_xlim(known[0] - 1.0, known[0] + 1.0)
    return figure
