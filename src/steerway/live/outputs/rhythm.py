"""When something periodic is due."""

import math

SLACK = 1e-4
"""Periods by which a row may be early: Unix times in float64 resolve a quarter of a microsecond."""


class Rhythm:
    """True once in every period of the rows' time, and at once when time goes back."""

    def __init__(self, period: float):
        self._period = period
        self._beat = math.nan

    def is_due(self, time: float) -> bool:
        """Whether a row of this time is the first of its period. Without a time: never."""
        beat = math.floor(time / self._period + SLACK) if math.isfinite(time) else self._beat
        is_new = beat != self._beat and math.isfinite(time)
        self._beat = beat
        return is_new
