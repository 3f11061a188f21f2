"""Archives of many vessels and days, out of core: estimates, trips and events from files of AIS reports or logs."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.archive.running import Report, run
    from steerway.archive.selecting import scan

__all__ = ["Report", "run", "scan"]
__getattr__, __dir__ = on_demand(__name__)
