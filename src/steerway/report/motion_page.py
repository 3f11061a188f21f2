"""The page (or picture) of one estimate."""

import math
from collections.abc import Callable
from pathlib import Path

from steerway.core.errors import InputError
from steerway.core.files import complete_or_absent
from steerway.core.records import Fixes, Motion
from steerway.report.figures import signals_figure, track_figure
from steerway.report.page import write_page
from steerway.report.summary import sentences

_TRACK = "Track, coloured by speed over ground; grey below steerageway, where course is undefined."
_SIGNALS = (
    "Estimate with its ±2σ band. Dots: values reported by the receiver, which filters and delays them: no reference. "
    "Below: the innovation of each fix relative to its predicted standard deviation (1 expected), with "
    "the gate beyond which a fix is rejected."
)


def write_report(path: Path, title: str, fixes: Fixes, motion: Motion, summary: dict, tables=()) -> None:
    """Write the report of an estimate as .html (self-contained) or .png.

    Args:
        tables: further (heading, column names, rows) for the page.

    Raises InputError for another ending.
    """
    figures = [(track_figure(motion), _TRACK)]
    if motion.mmsi is None:
        figures.append((signals_figure(fixes, motion), _SIGNALS))
    vessels = [] if motion.mmsi is None else [_vessels(motion)]
    tables = [("Summary", ("", ""), sentences(summary)), *vessels, *tables]
    report_writer(path)(Path(path), title, tables, figures, summary["notes"])


def _picture(path, title, tables, figures, remarks):
    """The figures below one another in one PNG."""
    import io

    from PIL import Image

    images = []
    for figure, _ in figures:
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", dpi=120)
        images.append(Image.open(buffer))
    width, height = max(image.width for image in images), sum(image.height for image in images)
    sheet = Image.new("RGB", (width, height), "white")
    top = 0
    for image in images:
        sheet.paste(image, ((width - image.width) // 2, top))
        top += image.height
    with complete_or_absent(path) as file:
        sheet.save(file, format="PNG")


WRITERS = {".html": write_page, ".png": _picture}
"""The kinds of report by their endings."""


def report_writer(path: str | Path) -> Callable:
    """The writer for the ending of `path`. Raises InputError for an unknown one."""
    ending = Path(path).suffix.lower()
    if ending not in WRITERS:
        raise InputError(f"report {path} ends in {ending or 'nothing'!r}, expected {' or '.join(WRITERS)}")
    return WRITERS[ending]


def _vessels(motion: Motion):
    import numpy as np

    rows = []
    for mmsi, track in motion.tracks():
        minutes = (track.time[-1] - track.time[0]) / 60.0
        median = np.nanmedian(track.sog) if np.isfinite(track.sog).any() else math.nan
        rows.append((mmsi, len(track), f"{minutes:.1f}", f"{median:.2f}", f"{np.isfinite(track.cog).mean():.0%}"))
    names = ("mmsi", "rows", "minutes", "median SOG (m/s)", "course defined")
    return ("Vessels", names, sorted(rows, key=lambda row: -row[1]))
