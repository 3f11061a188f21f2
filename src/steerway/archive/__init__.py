"""Archives of many vessels and days, larger than memory: estimates, trips and events from AIS reports or logs."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.archive.reading import scan
    from steerway.archive.running import Report, run

__all__ = ["Report", "run", "scan"]
__getattr__, __dir__ = on_demand(__name__)
