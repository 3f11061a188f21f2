"""The command that compares several results: plot."""

import math
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from steerway.commands.options import AS_JSON, expect_output
from steerway.commands.terminal import argument, option, print_json, print_table
from steerway.core.errors import InputError
from steerway.core.files import complete_or_absent

DIFFERENCES = ("track", "", "unit", "rows", "RMS", "median", "95 %", "max", "within ± 2σ")
ENDINGS = (".png", ".svg", ".pdf")
OUT = option("FIGURE", f"Output file: {', '.join(ENDINGS)}.", None, "-o", "--out")


def plot(
    files: list[str] = argument("FILE...", "Estimates, simulated runs or logs; the first is the reference."),
    out: Path | None = OUT,
    show_differences: Path | None = option(
        "FIGURE", "Output file for the differences from the first.", None, "--differences"
    ),
    as_json: bool = AS_JSON,
) -> None:
    """Compare results: plot the tracks in one figure, and print statistics of their differences from the first.

    A file is a table written by `estimate`, a run written by `simulate` (true and estimated motion), or a log (the
    receiver's own SOG and COG). The statistics are RMS, median, 95 % quantile and maximum of the absolute
    differences, and the share of differences within ± 2σ of the track. This share is 95 % if the first track is the
    truth and σ is calibrated.

    Examples:

        steerway plot causal.csv smoothed.csv sortie.nmea -o overlay.png

        steerway plot sailed/run.parquet --differences errors.pdf
    """
    from steerway.formats.results import read_tracks
    from steerway.report.differences import statistics_table
    from steerway.report.overlay import differences_figure, overlay_figure

    for path in filter(None, (out, show_differences)):
        if path.suffix.lower() not in ENDINGS:
            raise InputError(
                f"figure {path} ends in {path.suffix or 'nothing'!r}, expected one of {', '.join(ENDINGS)}"
            )
        expect_output(path, files)
    tracks = [track for path in files for track in read_tracks(path)]
    if len(tracks) < 2 and show_differences is not None:
        raise InputError("--differences compares tracks with the first, expected two files or more")
    table = statistics_table(tracks)
    written = [(out, overlay_figure)] if out is not None else []
    written += [(show_differences, differences_figure)] if show_differences is not None else []
    for path, figure in written:
        with complete_or_absent(path) as file:
            figure(tracks).savefig(file, format=path.suffix[1:].lower(), dpi=150)
    if as_json:
        print_json(table)
        return
    if table:
        print_table(f"differences from {tracks[0].name}", DIFFERENCES, difference_rows(table))
    for path, _ in written:
        print(f"wrote {path}")
    if not written:
        print(
            "-o overlay.png (or .svg .pdf) writes the tracks, --differences errors.png the differences from the first"
        )


def difference_rows(table: Iterable[dict[str, Any]]) -> Iterator[tuple[Any, ...]]:
    """Rows of `statistics_table` under the columns DIFFERENCES."""
    for row in table:
        numbers = (f"{row[key]:.3g}" for key in ("rms", "median", "p95", "max"))
        within = row["within_2sigma_pct"]
        share = "" if math.isnan(within) else f"{within:.1f} %"
        yield (row["track"], row["quantity"], row["unit"], row["n"], *numbers, share)
