"""The page around the charts: one self-contained HTML file."""

import html
import math
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from bokeh.embed import components
from bokeh.resources import Resources

from steerway.core.files import complete_or_absent
from steerway.core.records import Motion
from steerway.core.timestamps import iso
from steerway.report.drawing import course_cut, thinned
from steerway.report.interactive import charts
from steerway.report.interactive.data import MOST_ROWS, mercator, pack, script_json
from steerway.report.page import ReportContents, html_table


def write_interactive_page(path: str | Path, report: ReportContents) -> None:
    """Write the page of an estimate; a click on an entry of its list of events moves the charts to it."""
    motion, remarks, tables = report.motion, report.remarks, report.tables
    shown, alone = thinned(motion, MOST_ROWS), motion.mmsi is None
    if len(shown) < len(motion):
        remarks = [*remarks, f"The charts show every {-(-len(motion) // len(shown))}th of {len(motion)} rows."]
    fastest = max(float(np.nanquantile(shown.sog, 0.999)) if np.isfinite(shown.sog).any() else 0.0, 0.1)
    parts, data = _charts(report, shown, fastest)
    script, divisions = components(parts, wrap_script=False)
    package = files("steerway.report.interactive")
    page = Template((package / "page.html").read_text(encoding="utf-8"))
    first, *others = tables
    text = page.substitute(
        title=html.escape(report.title),
        library=Resources(mode="inline", components=["bokeh"]).render_js(),
        charts=script,
        script=(package / "page.js").read_text(encoding="utf-8"),
        data=script_json(data),
        map=divisions["map"],
        strips="".join(divisions[name] for name in ("sog", "cog", "rate", "ratio") if name in divisions),
        hidden="" if alone else "hidden",
        without_truth="hidden" if report.truth is None else "",
        without_gate="" if report.gate else "hidden",
        without_ratio="" if "ratio" in divisions else "hidden",
        without_reported="" if np.isfinite([report.fixes.sog, report.fixes.cog]).any() else "hidden",
        lead=f"<p>{html.escape(report.lead)}</p>" if report.lead else "",
        fastest=f"{fastest:.2g}",
        summary=html_table(*first),
        tables="".join(html_table(*each) for each in others),
        remarks="".join(f"<li>{html.escape(each)}</li>" for each in remarks) or "<li>none</li>",
        events="".join(_event(number, *each) for number, each in enumerate(report.events)) or "<li>none</li>",
    )
    with complete_or_absent(path) as file:
        file.write(text.encode())


def _charts(report: ReportContents, shown: Motion, fastest: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """The charts by name, and the data that the page's script draws in them."""
    known = np.isfinite(shown.latitude)
    cosine = math.cos(float(np.nanmedian(shown.latitude))) if known.any() else 1.0
    colours = {"low": 0.0, "high": fastest}
    if shown.mmsi is not None:
        parts = {"map": charts.track_map(fastest, cosine, _tracks(shown), None)}
        return parts, {"events": [], "vessels": True, "colours": colours}
    parts = {"map": charts.track_map(fastest, cosine, [_box(shown)], _ends(shown))}
    cut = course_cut(shown.cog)
    data = pack(report.fixes, shown, cut, None if report.truth is None else thinned(report.truth, MOST_ROWS))
    data |= {"events": [list(each) for each in report.events], "vessels": False, "colours": colours}
    innovations, limit = bool(np.isfinite(shown.nis).any()), data["gate"] if report.gate else None
    drawn = charts.strips(float(shown.time[0]), float(shown.time[-1]), cut, innovations, limit)
    return parts | {chart.name: chart for chart in drawn}, data


def _tracks(motion: Motion) -> list[dict[str, Any]]:
    """One line for each vessel, with its median speed."""
    found = []
    for mmsi, track in motion.tracks():
        track = track.rows(np.isfinite(track.latitude))
        if len(track) > 1:
            x, y = _line(track)
            known = track.sog[np.isfinite(track.cog)]
            speed = float(np.median(known)) if len(known) else math.nan
            found.append({"xs": x, "ys": y, "speed": speed, "name": str(mmsi)})
    return found


def _box(motion: Motion) -> dict[str, Any]:
    """A diagonal of the whole track, from which the map has its ranges until the script draws the track."""
    x, y = _line(motion)
    return {"xs": [x.min(), x.max()], "ys": [y.min(), y.max()], "speed": math.nan, "name": ""}


def _ends(motion: Motion) -> dict[str, Any]:
    x, y = _line(motion)
    return {"x": x[[0, -1]].tolist(), "y": y[[0, -1]].tolist()}


def _line(motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """x, y (m) of the rows with a position."""
    x, y = mercator(motion.latitude, motion.longitude)
    known = np.isfinite(x) & np.isfinite(y)
    return x[known], y[known]


def _event(number: int, start: float, stop: float, what: str) -> str:
    moment = iso(round(start, 1))[11:19]
    lasts = f", {stop - start:.1f} s" if stop > start else ""
    return f'<li><button type="button" data-event="{number}">{moment}{lasts}: {html.escape(what)}</button></li>'
