"""Names for this package's tests; not part of the public API."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.report.differences import differences, statistics, statistics_table
    from steerway.report.episodes import CONTRADICTED, DISAGREES, GAP, REFUSED, RESTARTED, episodes_of, events
    from steerway.report.interactive.data import mercator
    from steerway.report.motion_page import WRITERS, write_report
    from steerway.report.summary import summarise

__getattr__, __dir__ = on_demand(__name__)
