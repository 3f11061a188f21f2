"""How late a vehicle's receiver is: the time by which its fixes lie behind the vehicle's own estimate.

The stamp of a fix is that of its delivery. The vehicle's estimate has the receiver's delay taken out and is given for
the moment of its message; along the motion the two differ by the speed times the delay.
"""

import math

from steerway.core.earth import displacement

_LARGEST = 1.0
"""s, and the largest that is believed; receivers take 0.1 to 0.4 s. Chosen."""
_WINDOW = 30.0
"""s in which an old difference loses its weight, a factor of e. Chosen."""
_SLOWEST, _TRAVELLED = 0.5, 3.0
"""m/s from which on a fix counts, and m of way that are needed: with fixes of 0.1 m the delay is then known to 0.03 s.
Chosen."""
_SLEW = 0.05
"""s of delay a second at the most by which it is corrected: intervals between fixes change by as much. Chosen."""
_FRESH = 0.5  # s that an estimate may be older than a fix


class ReceiverLag:
    """`own` gets the vehicle's estimates, `at` the fixes; `lag` is the delay in s, 0 before it is known."""

    def __init__(self):
        self.lag = 0.0
        self._own = (-math.inf, 0.0, 0.0, 0.0, 0.0)
        self._along = self._squares = self._way = 0.0
        self._before = -math.inf

    def own(self, time: float, latitude: float, longitude: float, north: float, east: float) -> None:
        """The vehicle's estimate at a time: rad, m/s."""
        self._own = (time, latitude, longitude, north, east)

    def at(self, time: float, latitude: float, longitude: float) -> float:
        """The delay of a fix that was delivered at a time, s."""
        since, known_latitude, known_longitude, north, east = self._own
        step, self._before = time - self._before, time
        squared = north * north + east * east
        if not (0.0 < step < _WINDOW and abs(time - since) < _FRESH and squared > _SLOWEST**2):
            return self.lag
        ahead = displacement(known_latitude, known_longitude, latitude, longitude)
        kept = math.exp(-step / _WINDOW)
        along = (ahead[0] * north + ahead[1] * east) + (time - since) * squared
        self._along = kept * self._along + step * along
        self._squares = kept * self._squares + step * squared
        self._way += step * math.sqrt(squared)
        if self._way > _TRAVELLED:
            found = min(_LARGEST, max(0.0, self._along / self._squares))
            self.lag += min(_SLEW * step, max(-_SLEW * step, found - self.lag))
        return self.lag
