"""The charts of the interactive page: a map and four strips over time, whose data the page's script fills in."""

from collections.abc import Sequence
from typing import Any

from bokeh.models import (
    AdaptiveTicker,
    BoxZoomTool,
    ColumnDataSource,
    CustomJSTickFormatter,
    DatetimeTickFormatter,
    HoverTool,
    LinearColorMapper,
    PanTool,
    Range1d,
    ResetTool,
    ScaleBar,
    Span,
    WheelZoomTool,
    WMTSTileSource,
)
from bokeh.models.annotations.dimensional import ImperialLength
from bokeh.models.layouts import LayoutDOM
from bokeh.palettes import Viridis256
from bokeh.plotting import figure
from bokeh.transform import transform

from steerway.report.drawing import BAD, OURS, QUIET, THEIRS

DIFFERENCE, FIX = "#6b7682", "#111111"
_CLOSEST = 8.0
"""Width of the map at the closest zoom, m."""
_FORMATS = ("microseconds", "milliseconds", "seconds", "minsec", "minutes", "hourmin", "hours")


def track_map(
    fastest: float, cosine: float, tracks: Sequence[dict[str, Any]], start_and_end: dict[str, Any] | None
) -> LayoutDOM:
    """The map: tracks coloured by speed over a graticule, with scale bar; rows and fixes are filled in by the script.

    Args:
        fastest: speed (m/s) at the upper end of the colours.
        cosine: of the latitude; metres divided by it are metres of the projection.
        tracks: "xs", "ys" and "speed" (NaN: course not defined), and "name" of each piece of track.
        start_and_end: "x" and "y" of both, None for many vessels.
    """
    chart = figure(
        name="map",
        x_axis_type="mercator",
        y_axis_type="mercator",
        match_aspect=True,
        sizing_mode="stretch_both",
        min_height=320,
        min_border_left=52,
        tools=[PanTool(), BoxZoomTool(match_aspect=True), WheelZoomTool(zoom_on_axis=False), ResetTool()],
        toolbar_location="above",
        lod_threshold=None,
    )
    _plain(chart)
    chart.xgrid.grid_line_color = chart.ygrid.grid_line_color = "#c3cbd3"
    chart.xaxis.ticker.desired_num_ticks = 5
    mapper = LinearColorMapper(palette=Viridis256, low=0.0, high=fastest, nan_color=QUIET)
    chart.add_tile(_tiles(), name="tiles", visible=False)
    fixes = ColumnDataSource({"x": [], "y": []}, name="fixes")
    chart.scatter("x", "y", source=fixes, size=3, color=FIX, alpha=0.55, name="fix_dots", visible=False)
    window = ColumnDataSource({"x": [], "y": []}, name="window")
    chart.line("x", "y", source=window, line_width=9, color="#f0e442", alpha=0.8)
    keys = ("xs", "ys", "speed", "name")
    source = ColumnDataSource({key: [piece[key] for piece in tracks] for key in keys}, name="pieces")
    lines = chart.multi_line("xs", "ys", source=source, line_width=2.5, color=transform("speed", mapper))
    chart.x_range.renderers = chart.y_range.renderers = [lines]
    if start_and_end is None:
        chart.add_tools(
            HoverTool(renderers=[lines], tooltips=[("MMSI", "@name"), ("median SOG (m/s)", "@speed{0.00}")])
        )
    true = ColumnDataSource({"x": [], "y": []}, name="true_track")
    chart.line("x", "y", source=true, line_color="black", line_dash="dashed", line_width=1.2)
    rejected = ColumnDataSource({"x": [], "y": []}, name="rejected")
    chart.scatter("x", "y", source=rejected, marker="x", size=5, line_width=1, alpha=0.7, color=BAD)
    if start_and_end is not None:
        ends = ColumnDataSource(start_and_end | {"marker": ["circle", "square"]})
        chart.scatter("x", "y", source=ends, marker="marker", size=10, fill_color="white", line_color="black")
    cursor = ColumnDataSource({"x": [], "y": []}, name="map_cursor")
    chart.scatter(
        "x", "y", source=cursor, marker="circle_cross", size=18, fill_alpha=0.0, line_color="black", line_width=2
    )
    metres = ImperialLength(  # only this class of bokeh takes a basis: here metres on the ground
        basis={"u": (1.0, "u"), "m": (1.0 / cosine, "m"), "km": (1000.0 / cosine, "km")},
        ticks=[1, 2, 5, 10, 20, 50, 100, 200, 500],
    )
    chart.x_range.min_interval = chart.y_range.min_interval = _CLOSEST / cosine  # the bar stays above a metre
    chart.add_layout(
        ScaleBar(range=chart.x_range, unit="u", dimensional=metres, location="bottom_right", background_fill_alpha=0.8)
    )
    return chart


def _tiles() -> WMTSTileSource:
    """Map tiles of OpenStreetMap; loaded only when they are switched on."""
    return WMTSTileSource(
        url="https://tile.openstreetmap.org/{Z}/{X}/{Y}.png", attribution="© OpenStreetMap contributors", max_zoom=19
    )


def strips(begins: float, ends: float, cut: float, innovations: bool, gate: float | None) -> list[LayoutDOM]:
    """SOG, COG, course rate and, where they are known, innovations over one shared time axis (Unix s)."""
    margin = 0.01 * max(ends - begins, 1.0)
    span = Range1d(
        1e3 * (begins - margin),
        1e3 * (ends + margin),
        bounds=(1e3 * (begins - 9 * margin), 1e3 * (ends + 9 * margin)),
        name="time",
    )
    reported = ColumnDataSource({"t": [], "sog": [], "cog": []}, name="reported")
    differences = ColumnDataSource({"t": [], "sog": [], "cog": []}, name="differences")
    sog = _strip("sog", "SOG (m/s)", span)
    cog = _strip("cog", "COG (°)", span)
    rate = _strip("rate", "course rate (°/s)", span)
    for chart, name in ((sog, "sog"), (cog, "cog")):
        chart.line(
            "t", name, source=differences, color=DIFFERENCE, alpha=0.6, name=f"differences_{name}", visible=False
        )
        chart.scatter("t", name, source=reported, size=2.5, color=THEIRS, name=f"reported_{name}")
    for chart, name in ((sog, "sog"), (cog, "cog"), (rate, "rate")):
        band = ColumnDataSource({"t": [], "low": [], "high": []}, name=f"band_{name}")
        chart.varea("t", "low", "high", source=band, fill_color=OURS, fill_alpha=0.22)
        line = ColumnDataSource({"t": [], "value": []}, name=f"line_{name}")
        chart.line("t", "value", source=line, color=OURS, line_width=1.5)
        true = ColumnDataSource({"t": [], "value": []}, name=f"true_{name}")
        chart.line("t", "value", source=true, color="black", line_dash="dashed", line_width=1.2)
    cog.yaxis.formatter = CustomJSTickFormatter(
        code="const a = ((tick % 360) + 360) % 360; return (Math.round(1e3 * a) / 1e3).toString();"
    )
    cog.yaxis.ticker = AdaptiveTicker(base=10, mantissas=[1.0, 1.5, 3.0, 4.5, 9.0])
    cog.y_range.update(start=cut, end=cut + 360.0)
    rate.add_layout(Span(location=0.0, dimension="width", line_color=DIFFERENCE, line_width=0.8))
    charts = [sog, cog, rate]
    if innovations:
        charts.append(_innovations(span, gate))
    charts[-1].xaxis.axis_label = "time (UTC)"
    for chart in charts:
        chart.add_layout(
            Span(location=1e3 * begins, dimension="height", line_color="black", visible=False, name="cursor")
        )
    return charts


def _innovations(span: Range1d, gate: float | None) -> figure:
    ratio = _strip("ratio", "innovation ratio", span, y_axis_type="log", height=170)
    accepted = ColumnDataSource({"t": [], "ratio": []}, name="accepted")
    ratio.scatter("t", "ratio", source=accepted, size=2, color=OURS, alpha=0.6)
    refused = ColumnDataSource({"t": [], "ratio": []}, name="refused")
    ratio.scatter("t", "ratio", source=refused, marker="x", size=8, line_width=2, color=BAD)
    if gate is not None:
        ratio.add_layout(Span(location=gate, dimension="width", line_color=BAD, line_dash="dashed"))
    return ratio


def _strip(name: str, label: str, span: Range1d, height: int = 200, **options: Any) -> figure:
    chart = figure(
        name=name,
        height=height,
        sizing_mode="stretch_width",
        x_axis_type="datetime",
        x_range=span,
        y_range=Range1d(0.01, 1.0),
        tools=[
            PanTool(dimensions="width"),
            BoxZoomTool(dimensions="width"),
            WheelZoomTool(dimensions="width"),
            ResetTool(),
        ],
        toolbar_location=None,
        min_border_left=70,
        lod_threshold=None,
        **options,
    )
    _plain(chart)
    chart.toolbar.active_scroll = chart.select_one(WheelZoomTool)
    chart.toolbar.active_drag = chart.select_one(PanTool)
    chart.yaxis.axis_label = label
    formats = {key: "%H:%M:%S" if key in ("seconds", "minsec") else "%H:%M" for key in _FORMATS[2:]}
    chart.xaxis.formatter = DatetimeTickFormatter(**formats, milliseconds="%H:%M:%S.%3N", days="%d %b")
    return chart


def _plain(chart: figure) -> None:
    chart.toolbar.logo = None
    chart.outline_line_color = "#b6c0ca"
    for axis in chart.axis:
        axis.axis_label_text_font_style = "normal"
        axis.axis_label_text_color = axis.major_label_text_color = "#1b2733"
        axis.minor_tick_line_color = None
    chart.toolbar.active_scroll = chart.select_one(WheelZoomTool)
