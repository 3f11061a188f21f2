"""Limits of what a vessel can report. Every row of every link, and of a replayed log, is checked here first.

Links differ in what their formats can hold; of JSON and of floats in packets that is any number. A value beyond its
limit is taken as not reported, and a row without its time, or with nothing left, as not sent.
"""

import math

from steerway.core.earth import KNOT, STANDARD_GRAVITY
from steerway.live.base.rows import InputRow

_LAST_TIME = 1e10  # Unix time of the year 2286
_TURN = 2.0 * math.pi
_FASTEST = 1000.0 * KNOT  # as of NMEA 0183
_LIMITS = {
    "latitude": (-0.5 * math.pi, 0.5 * math.pi),
    "longitude": (-math.pi, math.pi),
    "position_std": (0.0, 1e4),  # m; who knows it no better has no position
    "sog": (0.0, _FASTEST),
    "cog": (-_TURN, _TURN),
    "heading": (-_TURN, _TURN),
    "water_speed": (-_FASTEST, _FASTEST),
    "bottom_speed": (-_FASTEST, _FASTEST),
    "yaw_rate": (-10.0, 10.0),  # rad/s; of a small boat's gyro 1 is much
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
    row = row._replace(**dict.fromkeys(wrong, math.nan))
    return row if any(not math.isnan(getattr(row, name)) for name in _LIMITS) else None


def _is_beyond(value, least, most):
    """Whether a value is reported, other than NaN, and beyond its limits; an integer of JSON may be any."""
    return value == value and not least <= value <= most
