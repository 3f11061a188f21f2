"""The page (or picture) of one estimate."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from steerway.core.errors import InputError
from steerway.core.files import complete_or_absent
from steerway.core.records import Fixes, Motion
from steerway.report.episodes import events
from steerway.report.page import ReportContents, Table, png
from steerway.report.summary import sentences


def write_report(
    path: Path, title: str, fixes: Fixes, motion: Motion, summary: dict[str, Any], tables: Sequence[Table] = ()
) -> None:
    """Write the report of an estimate as .html (interactive, self-contained) or .png.

    Args:
        tables: further (heading, column names, rows) for the page.

    Raises InputError for any other ending.
    """
    vessels = [] if motion.mmsi is None else [_vessels(motion)]
    tables = [("Summary", ("", ""), sentences(summary)), *vessels, *tables]
    found = events(fixes, motion) if motion.mmsi is None else []
    gate = not summary["structures"]
    report_writer(path)(Path(path), ReportContents(title, fixes, motion, tables, summary["notes"], found, gate=gate))


def _page(path: Path, report: ReportContents) -> None:
    from steerway.report.interactive import write_interactive_page

    write_interactive_page(path, report)


def _picture(path: Path, report: ReportContents) -> None:
    """Write the figures as one PNG, one below the other."""
    import io

    from PIL import Image

    from steerway.report.figures import signals_figure, track_figure

    figures = [track_figure(report.motion)]
    if report.motion.mmsi is None:
        figures.append(signals_figure(report.fixes, report.motion, report.gate))
    images = [Image.open(io.BytesIO(png(figure))) for figure in figures]
    width, height = max(image.width for image in images), sum(image.height for image in images)
    sheet = Image.new("RGB", (width, height), "white")
    top = 0
    for image in images:
        sheet.paste(image, ((width - image.width) // 2, top))
        top += image.height
    with complete_or_absent(path) as file:
        sheet.save(file, format="PNG")


WRITERS = {".html": _page, ".png": _picture}
"""Ending of a report's path → function that writes it, of the path and `ReportContents`."""


def report_writer(path: str | Path) -> Callable[[Path, ReportContents], None]:
    """The writer for the ending of `path`. Raises InputError for an unknown one."""
    ending = Path(path).suffix.lower()
    if ending not in WRITERS:
        raise InputError(f"report {path} ends in {ending or 'nothing'!r}, expected {' or '.join(WRITERS)}")
    return WRITERS[ending]


def _vessels(motion: Motion) -> Table:
    import numpy as np

    rows = []
    for mmsi, track in motion.tracks():
        minutes = (track.time[-1] - track.time[0]) / 60.0
        median = f"{np.nanmedian(track.sog):.2f}" if np.isfinite(track.sog).any() else "–"
        rows.append((mmsi, len(track), f"{minutes:.1f}", median, f"{np.isfinite(track.cog).mean():.0%}"))
    names = ("MMSI", "rows", "min", "median SOG (m/s)", "with course")
    return ("Vessels", names, sorted(rows, key=lambda row: -row[1]))
