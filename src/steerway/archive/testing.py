"""Internal names of this package that tests use."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.archive import association, filters, levels, page, running, smoothing, tracks, unit
    from steerway.archive.encounters import encounters
    from steerway.archive.inspecting import digest, status
    from steerway.archive.selecting import export
    from steerway.archive.store import Store

__getattr__, __dir__ = on_demand(__name__)
