"""Names for this package's tests; not part of the public API."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.archive import association, filters, levels, page, running, smoothing, tracks, unit
    from steerway.archive.encounters import encounters
    from steerway.archive.reading import digest, export, status
    from steerway.archive.store import Store

__getattr__, __dir__ = on_demand(__name__)
