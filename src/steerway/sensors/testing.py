"""Names for this package's tests; not part of the public API."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.sensors import gnss
    from steerway.sensors.compass import CompassTable, deviation
    from steerway.sensors.gnss import GnssTable
    from steerway.sensors.gnss_errors import Fault
    from steerway.sensors.kinds import INSTRUMENTS

__getattr__, __dir__ = on_demand(__name__)
