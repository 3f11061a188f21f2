"""One row from an input, and one row of the estimate."""

import math
from collections import namedtuple
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from steerway.core.records import LOST, REPORTED, Fixes

_OPTIONAL = dict.fromkeys(("latitude", "longitude", *REPORTED), math.nan) | {"formatters": 0, "throttle": math.nan}


class InputRow(namedtuple("InputRow", ("source", "time", *_OPTIONAL), defaults=_OPTIONAL.values())):
    """One measurement of one source, as a row of Fixes: SI, rad, NaN for what it does not report.

    `time` is Unix UTC, by the instrument; `formatters` are bits of the NMEA 0183 formatters that gave the position;
    `throttle` is the share of full that drives the motors, 0 where they idle.
    """

    __slots__ = ()

    @property
    def has_position(self) -> bool:
        """Whether it reports a position."""
        return not (math.isnan(self.latitude) or math.isnan(self.longitude))


class Row(NamedTuple):
    """One estimate, as a row of Motion: SI, rad, NaN for unknown, `status` an index into `records.STATUSES`."""

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
        """Whether the position is known."""
        return not math.isnan(self.latitude)


def lost(time: float) -> Row:
    """The row of an unknown state."""
    return Row(time, *[math.nan] * 10, LOST)


def rows_of(sources: dict[str, Fixes], formatters: Mapping[str, np.ndarray] | None = None) -> Iterator[InputRow]:
    """The rows of all sources in time order, without vessels reported by AIS, which are not aboard.

    formatters: by source, (n,), as of `Recording`.
    """
    rows = []
    for name, fixes in sources.items():
        if fixes.mmsi is None:
            columns = [getattr(fixes, field).tolist() for field in ("time", "latitude", "longitude", *REPORTED)]
            bits = (formatters or {}).get(name)
            columns.append([0] * len(fixes) if bits is None else bits.tolist())
            rows += [InputRow(name, *values) for values in zip(*columns, strict=True)]
    yield from sorted(rows, key=lambda row: row.time)
