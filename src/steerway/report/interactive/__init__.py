"""The interactive page of an estimate: track, quantities over time and events, zoomed and read together, offline."""

from steerway.report.interactive.page import write_interactive_page

__all__ = ["write_interactive_page"]
