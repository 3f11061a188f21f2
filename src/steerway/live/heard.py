"""What one instrument said at one moment, and what is said of the boat at one moment."""

import math
from collections.abc import Iterator
from typing import NamedTuple

from steerway.core.records import LOST, Fixes


class Heard(NamedTuple):
    """A row of Fixes on its way: SI, rad, NaN for what was not said."""

    source: str
    time: float  # Unix UTC, as the instrument says
    latitude: float = math.nan
    longitude: float = math.nan
    position_std: float = math.nan
    sog: float = math.nan
    cog: float = math.nan
    heading: float = math.nan
    water_speed: float = math.nan
    yaw_rate: float = math.nan

    @property
    def has_position(self) -> bool:
        """Whether it says where."""
        return not (math.isnan(self.latitude) or math.isnan(self.longitude))


class Row(NamedTuple):
    """A row of Motion on its way: SI, rad, NaN for unknown, `status` an index into `records.STATUSES`."""

    time: float
    latitude: float
    longitude: float
    sog: float
    cog: float
    course_rate: float
    sog_std: float
    cog_std: float
    course_rate_std: float
    position_std: float
    nis: float
    status: int

    @property
    def valid(self) -> bool:
        """Whether there is a position to go by."""
        return not math.isnan(self.latitude)


def lost(time: float) -> Row:
    """Nothing is known."""
    return Row(time, *[math.nan] * 10, LOST)


def rows_of(sources: dict[str, Fixes]) -> Iterator[Heard]:
    """The rows of all sources in time order; vessels that AIS reports are not aboard and left out."""
    rows = []
    for name, fixes in sources.items():
        if fixes.mmsi is None:
            columns = [getattr(fixes, field).tolist() for field in Heard._fields[1:]]
            rows += [Heard(name, *values) for values in zip(*columns, strict=True)]
    yield from sorted(rows, key=lambda row: row.time)
