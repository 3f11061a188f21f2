"""Reports: figures and self-contained pages."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.report.drawing import BAD, OURS, QUIET, THEIRS, broken
    from steerway.report.figures import track_figure
    from steerway.report.page import png, write_page
    from steerway.report.plots import PALETTE, TRUTH, Band, Curve, Panel, bars, series, track

__all__ = [
    "BAD",
    "OURS",
    "PALETTE",
    "QUIET",
    "THEIRS",
    "TRUTH",
    "Band",
    "Curve",
    "Panel",
    "bars",
    "broken",
    "png",
    "series",
    "track",
    "track_figure",
    "write_page",
]
__getattr__, __dir__ = on_demand(__name__)
