"""Rows of inputs and of the estimate, the autopilot's state and order, and the limits of possible values."""

import math
from collections.abc import Iterator, Mapping
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from steerway.core.earth import KNOT, STANDARD_GRAVITY
from steerway.core.records import LOST, REPORTED, Fixes


class InputRow(NamedTuple):
    """One measurement of one source, as a row of Fixes: SI, rad, NaN for values that it does not report.

    `time` is Unix time (UTC) from the instrument; `formatters` has a bit for each NMEA 0183 formatter that gave the
    position; `throttle` is the motors' throttle as a fraction of full, 0 when idling.
    """

    source: str
    time: float
    latitude: float = math.nan
    longitude: float = math.nan
    position_std: float = math.nan
    sog: float = math.nan
    cog: float = math.nan
    heading: float = math.nan
    water_speed: float = math.nan
    yaw_rate: float = math.nan
    bottom_speed: float = math.nan
    acceleration: float = math.nan
    shaft: float = math.nan
    formatters: int = 0
    throttle: float = math.nan

    @property
    def has_position(self) -> bool:
        """Whether the row has a position."""
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
    position_relative_std: float
    nis: float
    status: int

    @property
    def valid(self) -> bool:
        """Whether the position is known."""
        return not math.isnan(self.latitude)


def lost(time: float) -> Row:
    """The row of an unknown state."""
    return Row._make((time, *[math.nan] * 11, LOST))


def rows_of(sources: dict[str, Fixes], formatters: Mapping[str, np.ndarray] | None = None) -> Iterator[InputRow]:
    """The rows of all sources in time order, without AIS targets: those are other vessels.

    formatters: by source, (n,), as in `Recording`.
    """
    rows = []
    for name, fixes in sources.items():
        if fixes.mmsi is None:
            columns = [getattr(fixes, field).tolist() for field in ("time", "latitude", "longitude", *REPORTED)]
            bits = (formatters or {}).get(name)
            columns.append([0] * len(fixes) if bits is None else bits.tolist())
            rows += [InputRow(name, *values) for values in zip(*columns, strict=True)]
    yield from sorted(rows, key=lambda row: row.time)


class State(StrEnum):
    """Idle until all conditions are met; then ready to start; under way; stopped or finished until the next start."""

    IDLE = "idle"
    READY = "ready"
    RUNNING = "running"
    DEGRADED = "degraded"  # steers, but by dead reckoning, with rejected fixes, or after a late tick
    STOPPED = "stopped"
    FINISHED = "finished"  # at the end of the route


UNDER_WAY = (State.RUNNING, State.DEGRADED)
ENDED = (State.STOPPED, State.FINISHED)
FIT = (State.READY, *UNDER_WAY)
"""States in which another autopilot may steer by the leg."""


class Order(NamedTuple):
    """The command to the vessel; SI and rad. Outputs carry out an order only while it is `engaged`."""

    state: State
    reason: str = ""  # why the state is not RUNNING, "" when it is
    engaged: bool = False  # whether to carry the command out; also true for the safe output "stop"
    yaw_rate: float = 0.0  # rad/s, + to starboard
    thrust: float = 0.0  # fraction of full, -1 to 1
    port: float = 0.0  # propellers, -1 to 1 of full speed
    starboard: float = 0.0
    course: float = math.nan  # to steer, rad; NaN when unknown
    speed: float = math.nan  # desired over ground, m/s


_LAST_TIME = 1e10  # Unix time of the year 2286
_TURN = 2.0 * math.pi
_FASTEST = 1000.0 * KNOT  # as for NMEA 0183
_LIMITS = {
    "latitude": (-0.5 * math.pi, 0.5 * math.pi),
    "longitude": (-math.pi, math.pi),
    "position_std": (0.0, 1e4),  # m; a fix with a larger σ is no position
    "sog": (0.0, _FASTEST),
    "cog": (-_TURN, _TURN),
    "heading": (-_TURN, _TURN),
    "water_speed": (-_FASTEST, _FASTEST),
    "bottom_speed": (-_FASTEST, _FASTEST),
    "yaw_rate": (-10.0, 10.0),  # rad/s; 1 is high even for a small boat
    "acceleration": (-20.0 * STANDARD_GRAVITY, 20.0 * STANDARD_GRAVITY),
    "shaft": (-1000.0, 1000.0),  # rev/s
    "throttle": (-1.0, 1.0),
}
_PLACE = ("latitude", "longitude", "position_std")


def believable(row: InputRow) -> InputRow | None:
    """The row without impossible values: the same object if all are possible, None if nothing is left."""
    if not abs(row.time) < _LAST_TIME:
        return None
    wrong = {name for name, (least, most) in _LIMITS.items() if _is_beyond(getattr(row, name), least, most)}
    if not wrong:
        return row
    wrong.update(_PLACE if wrong.intersection(_PLACE) else ())
    nothing: dict[str, Any] = dict.fromkeys(wrong, math.nan)
    row = row._replace(**nothing)
    return row if any(not math.isnan(getattr(row, name)) for name in _LIMITS) else None


def _is_beyond(value: float, least: float, most: float) -> bool:
    """Whether a value is reported (not NaN) and beyond its limits; an integer from JSON may exceed every float."""
    return value == value and not least <= value <= most
