"""Monitors for a frozen receiver and for a boat that does not turn as ordered.

They do not use the autopilot's estimate, which explains a frozen receiver by a current against the boat, and a wrong
turn by a changing current. One monitor checks that positions scatter as before. The other compares turns with the
orders, by a gyro, or by the track where there is no gyro.
"""

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from steerway.control.boats import Boat
from steerway.core.arrays import Floats
from steerway.core.earth import displacement
from steerway.live.autopilot.limits import TurnLimit
from steerway.live.rows import InputRow

LEAST_QUIET, QUIET_INTERVALS = 1.0, 4
"""The boat stops once positions stand still under way for LEAST_QUIET s, but at least QUIET_INTERVALS fix intervals."""
DOUBTED, DOUBTED_INTERVALS = 1.5, 2
"""Positions that stand still for DOUBTED s, but at least DOUBTED_INTERVALS fix intervals, are reported."""
_QUIET_SHARE = 0.1
"""Largest change of a position that counts as standing still, as a fraction of the receiver's scatter. Chosen: if the
scatter is unchanged, five positions count as standing still once in 10⁹ times."""
_SQUARES, _MEDIAN = 20.0, 1.386
"""Sum of the squared weights of a third difference; median of χ² with 2 degrees of freedom."""
_USUALLY, _SLOWEST = 3.0, 0.05
"""Longest time at one rounded position, in multiples of the usual time; least speed assumed for the usual time, m/s."""
_PACES, _KEPT = 20, 100  # number of positions for their usual time; number of third differences for the scatter
_LEAST_KNOWN = 10
_UNDER_WAY = 0.3  # speed over ground above which the usual time is learned, m/s
_ROUNDING = 1e-3  # s
LARGEST_MISSED = math.radians(45.0)
"""Largest difference between measured and ordered turn, rad. Past differences decay with the time constant `FORGETS`.
In a prototype, sound boats that take yaw rates peaked at 16 to 19°. An Otter commanded by propellers, where turns are
not monitored, reached 63°."""
DOUBTED_MISSED = math.radians(30.0)
MISSED_SHARE = 0.5
"""Largest difference from the ordered turn, as a fraction of the turn. Chosen: a sound boat that started with little
thrust turned at 35°/s for 4 s instead of the ordered 60°/s."""
FORGETS = 10.0
LASTING = 2.0
"""Time for which the difference has to last, s."""
_OTHERWISE = "the boat does not turn as ordered"
_LONGEST = 3.0  # longest interval between two fixes over which a turn is compared, s
_TRACK, _SHORTEST, _EVERY = 15.0, 3.0, 1.0
"""Longest and shortest track that is compared with the orders, s; time between two comparisons, s."""
_DELAYS = np.array((0.3, 1.0, 2.0, 3.0))
"""Compared delays from bow to motion through the water, s. Chosen: a small boat's sideslip takes about 1 s."""
_RATES = np.radians(np.arange(-18.0, 19.0, 3.0))
"""Yaw rates at which the boat may turn whatever is ordered, rad/s; 0: it does not turn."""
_UNLIKELY = np.concatenate((np.zeros(len(_DELAYS)), np.where(_RATES == 0.0, 0.0, 6.0)))
"""Cost of each alternative to the ordered turn: the mirror images, then the rates. Chosen: among many rates, one always
fits the errors of a track. Without this cost a receiver that wanders by 0.4 m would stop a sound boat."""
_LEAST_GAIN, _CERTAIN, _PERHAPS = 4.0, 15.0, 8.0
"""Evidence for another turn, 2 ln of the likelihood ratio. Each comparison adds its evidence minus _LEAST_GAIN to a sum
of at least 0. The boat stops if the sum exceeds _CERTAIN; above _PERHAPS the doubt is reported. Chosen on a desk boat
in currents of up to 0.9 m/s with receivers that wander by up to 0.4 m: on 32 sound routes the sum is at most 4. Of 50
faults in the first minute, 49 exceed _CERTAIN after at most 20 s of orders of 5°/s or more. In the other one, the boat
was stuck at a yaw rate that for half of this time was the ordered one."""
_ERROR, _ERROR_TIME = 0.35, 0.3
"""1σ of the track's error over 1 s from sideslip and speed lost in turns: _ERROR m, and _ERROR_TIME s times the usual
speed. Both and the receiver's error are added in quadrature."""
_CURRENT_SHARE, _SPEED_SHARE = 0.5, 0.3
"""1σ of a component of the current and of the speed through the water, as fractions of the usual speed."""


class ReceiverMonitor:
    """Notices a frozen receiver. It takes positions in order of arrival; `quiet`: time they have stood still, s."""

    def __init__(self) -> None:
        self._last: deque[tuple[float, float, float]] = deque(maxlen=4)  # time (s), north and east (m)
        self._third: deque[float] = deque(maxlen=_KEPT)
        self._paces: deque[float] = deque(maxlen=_PACES)
        self._digit = math.inf  # least change between two positions, m
        self._origin: tuple[float, float] | None = None
        self.restart()

    def restart(self) -> None:
        """Reset: the boat is under way from now on."""
        self.quiet = 0.0
        self._stood = math.nan, math.nan, math.nan  # time of arrival at the present position, and this position
        self._speed = 0.0  # speed over ground at that time
        self._doubted = self._most = math.inf

    def fix(self, time: float, latitude: float, longitude: float, sog: float, interval: float) -> None:
        """Take a position (s; rad), the estimated speed over ground (m/s) and the usual interval (s); NaN: unknown."""
        self._origin = self._origin or (latitude, longitude)
        place = displacement(latitude, longitude, *self._origin)
        since, *stood = self._stood
        moved = math.dist(place, stood)
        if 0.0 < moved < self._digit:
            self._digit = moved
        self._learn(time, *place)
        if not moved <= _QUIET_SHARE * self.scatter or time < since:
            if self._speed > _UNDER_WAY and time > since:
                self._paces.append(time - since)
            since, self._stood, self._speed = time, (time, *place), sog if math.isfinite(sog) else 0.0
        self.quiet = time - since
        interval = interval if math.isfinite(interval) else 0.0
        honest, usual = self._honest(interval), QUIET_INTERVALS * interval
        self._most = max(LEAST_QUIET, usual, honest)
        self._doubted = max(DOUBTED_INTERVALS * interval, min(usual, DOUBTED), 0.5 * honest)

    @property
    def scatter(self) -> float:
        """1σ of a position in one axis, m, from third differences; 0 while there are fewer than ten."""
        if len(self._third) < _LEAST_KNOWN:
            return 0.0
        return math.sqrt(sorted(self._third)[len(self._third) // 2] / (_SQUARES * _MEDIAN))

    @property
    def trouble(self) -> str:
        """Why to stop; "" while the positions move or scatter as before."""
        return self._words if self.quiet >= self._most - _ROUNDING else ""

    @property
    def doubt(self) -> str:
        """The same as `trouble`, with a lower threshold."""
        return self._words if self.quiet >= self._doubted - _ROUNDING else ""

    @property
    def _words(self) -> str:
        return f"the receiver's position stands still for {self.quiet:.1f} s"

    def _learn(self, time: float, north: float, east: float) -> None:
        self._last.append((time, north, east))
        if len(self._last) == 4:
            (_, n0, e0), (_, n1, e1), (_, n2, e2), (_, n3, e3) = self._last
            self._third.append((n3 - 3.0 * (n2 - n1) - n0) ** 2 + (e3 - 3.0 * (e2 - e1) - e0) ** 2)

    def _honest(self, interval: float) -> float:
        """Time (s) for which positions may stand still under way, because they are rounded or repeated."""
        crossing = _USUALLY * self._digit / max(self._speed, _SLOWEST) if math.isfinite(self._digit) else 0.0
        if len(self._paces) < _LEAST_KNOWN:
            return crossing
        pace = sorted(self._paces)[3 * len(self._paces) // 4]
        return max(crossing, _USUALLY * pace) if pace > 1.5 * interval else crossing


class ResponseMonitor:
    """Compares the gyro with the ordered turn; `missed`: measured minus ordered angle, rad, + to starboard."""

    def __init__(self, boat: Boat):
        self._time = max(boat.nomoto_time, 1e-3)
        self.restart()

    def restart(self) -> None:
        """Reset: the boat is under way from now on."""
        self._rate = self._turned = 0.0  # expected yaw rate, rad/s; expected turn since the last fix, rad
        self._asked = self._missed = 0.0  # size of the expected turns, and measured minus expected turn, rad
        self._fixed = math.nan
        self._lately: deque[tuple[float, float]] = deque()

    def order(self, yaw_rate: float, dt: float) -> None:
        """Add the yaw rate ordered over the last dt s (rad/s); NaN if the autopilot did not steer."""
        self._rate += (_or_zero(yaw_rate) - self._rate) * -math.expm1(-dt / self._time)
        self._turned += self._rate * dt

    def fix(self, time: float, yaw_rate: float) -> None:
        """Take a fix's time (s) and the yaw rate of a gyro (rad/s; NaN without a gyro)."""
        step, self._fixed = time - self._fixed, time
        expected, self._turned = self._turned, 0.0
        if not 0.0 < step < _LONGEST:
            return
        kept = math.exp(-step / FORGETS)
        self._asked = kept * self._asked + abs(expected)
        self._missed *= kept
        if math.isfinite(yaw_rate):
            self._missed += yaw_rate * step - expected
        self._lately.append((time, self._missed))
        while time - self._lately[0][0] > LASTING + _ROUNDING:
            self._lately.popleft()

    @property
    def missed(self) -> float:
        """The difference smallest in size over the last `LASTING` s, rad; 0 if its sign changed."""
        lately = [missed for _, missed in self._lately] or [0.0]
        return min(lately) if min(lately) > 0.0 else min(max(lately), 0.0)

    @property
    def trouble(self) -> str:
        """Why to stop; "" while the boat turns as ordered."""
        return self._words(LARGEST_MISSED)

    @property
    def doubt(self) -> str:
        """The same as `trouble`, with a lower threshold."""
        return self._words(DOUBTED_MISSED)

    def _words(self, most: float) -> str:
        said = f"{_OTHERWISE}, by {abs(math.degrees(self.missed)):.0f}° in {FORGETS:g} s"
        return said if abs(self.missed) > max(most, MISSED_SHARE * self._asked) else ""


class TrackMonitor:
    """Whether the positions of the last `_TRACK` s fit the ordered turns, or fit other turns better.

    Current, initial heading and the speed at usual thrust are unknown here. The position, as north + i east, is
    p + V t + A ∫ s exp(iθ) dt, with the ordered turn θ, and the speed s that the thrust gives, as a fraction of the
    usual speed U. The priors are V ~ N(0, σ_V²) for the current and |A| ~ N(U, σ_U²). The alternatives to θ are its
    mirror image, no turn, and constant yaw rates. Without s, a boat that turns at low speed would seem not to turn.
    """

    def __init__(self, boat: Boat):
        self._time, self._usual = max(boat.nomoto_time, 1e-3), boat.cruise
        self._top, self._surge_time = boat.top_speed, max(boat.surge_time, 1e-3)
        self.restart()

    def restart(self) -> None:
        """Reset: the boat is under way from now on."""
        self._rate, self._seen = 0.0, np.zeros(len(_DELAYS))  # expected yaw rate, and after each delay, rad/s
        self._turned, self._drive = np.zeros(len(_DELAYS)), 1.0  # θ for each delay, rad; speed fraction s
        self._track: deque[tuple[float, complex, Floats, float]] = deque()
        self._origin = 0.0, 0.0
        self._compared, self._evidence, self._error = math.nan, 0.0, _ERROR

    def order(self, yaw_rate: float, thrust: float, dt: float) -> None:
        """Add the yaw rate (rad/s) and the fraction of full thrust ordered over the last dt s; NaN: no order."""
        self._rate += (_or_zero(yaw_rate) - self._rate) * -math.expm1(-dt / self._time)
        self._seen += (self._rate - self._seen) * -np.expm1(-dt / _DELAYS)
        self._turned = self._turned + self._seen * dt
        if math.isfinite(thrust):
            made = max(thrust, 0.0) * self._top / self._usual
            self._drive += (made - self._drive) * -math.expm1(-dt / self._surge_time)

    def fix(self, time: float, latitude: float, longitude: float, error: float) -> None:
        """Take a position (s; rad). error: 1σ of the mean of the positions of one second, m."""
        self._error = math.hypot(_ERROR, error)
        if self._track and not 0.0 < time - self._track[-1][0] < _LONGEST:
            self.restart()
        if not self._track:
            self._origin = latitude, longitude
        place = complex(*displacement(latitude, longitude, *self._origin))
        self._track.append((time, place, self._turned, self._drive))
        while time - self._track[0][0] > _TRACK:
            self._track.popleft()
        if not time - self._compared < _EVERY - _ROUNDING:
            self._compared = time
            self._compare()

    @property
    def trouble(self) -> str:
        """Why to stop; "" while the boat turns as ordered."""
        return f"{_OTHERWISE}, its track is another" if self._evidence > _CERTAIN else ""

    @property
    def doubt(self) -> str:
        """The same as `trouble`, with a lower threshold."""
        return f"{_OTHERWISE}, its track is nearer to another" if self._evidence > _PERHAPS else ""

    def _compare(self) -> None:
        times, places, turns, drives = (np.array(each) for each in zip(*self._track, strict=True))
        if len(times) < _LEAST_KNOWN or times[-1] - times[0] < _SHORTEST:
            return
        t = times - times[0]
        costs = self._costs(t, places, drives * np.exp(1j * np.concatenate((turns.T, -turns.T, np.outer(_RATES, t)))))
        ordered, other = costs[: len(_DELAYS)].min(), (costs[len(_DELAYS) :] + _UNLIKELY).min()
        gained = (ordered - other) / max(1.0, other / (2.0 * _TRACK))  # scaled by the residuals
        self._evidence = max(0.0, self._evidence + float(gained) - _LEAST_GAIN)

    def _costs(self, t: Floats, places: NDArray[np.complex128], velocities: NDArray[np.complex128]) -> Floats:
        """−2 log density, without its constant, of positions (n,), m, for each of k courses of velocity (k, n)."""
        usual, steps = self._usual, np.diff(t)
        way = np.zeros_like(velocities)
        np.cumsum(0.5 * steps * (velocities[:, 1:] + velocities[:, :-1]), axis=1, out=way[:, 1:])
        share = np.minimum(np.concatenate((steps[:1], steps)), 1.0) / (self._error**2 + (_ERROR_TIME * usual) ** 2)
        columns = np.stack([np.broadcast_to(each, way.shape) for each in (np.ones(len(t)), t, way, places)], axis=1)
        products = (columns.conj() * share) @ columns.swapaxes(1, 2)
        products[:, 1, 1] += (_CURRENT_SHARE * usual) ** -2
        for k in range(2):  # eliminate the first position and the current
            products = products - products[:, :, k, None] * products[:, None, k] / products[:, k, k, None, None]
            products[:, k, k] = 1.0
        known = np.maximum(products[:, 2, 2].real, 1e-12)
        speed = np.abs(products[:, 2, 3]) / known
        left = products[:, 3, 3].real - known * speed**2
        return left + (speed - usual) ** 2 / (1.0 / known + (_SPEED_SHARE * usual) ** 2)


class TurnMonitor:
    """Compares the turns of a boat that takes yaw rates with the orders: by its gyro, or without one by its track.

    `limit`: the limit of the ordered yaw rate. declared: the mission's largest yaw rate, °/s; None: the vehicle's.
    """

    def __init__(self, boat: Boat, declared: float | None):
        self.limit = TurnLimit(None if declared is None else math.radians(declared))
        self._response, self._track = ResponseMonitor(boat), TrackMonitor(boat)
        self._fixed = math.nan

    def restart(self) -> None:
        """Reset: the boat is under way from now on."""
        self._response.restart()
        self._track.restart()

    def order(self, yaw_rate: float, thrust: float, dt: float, throttle: float = math.nan) -> None:
        """See `TrackMonitor`. throttle: reported share of full throttle, NaN without a report."""
        self._response.order(yaw_rate, dt)
        self._track.order(yaw_rate, thrust, dt)
        self.limit.order(yaw_rate, thrust, dt, throttle)

    def fix(self, row: InputRow, error: float) -> None:
        """Take a fix; error: see `TrackMonitor.fix`."""
        self.limit.turned(row.yaw_rate, row.time - self._fixed)
        self._fixed = row.time
        self._response.fix(row.time, row.yaw_rate)
        if math.isnan(row.yaw_rate):  # with a gyro the response monitor notices a wrong turn sooner
            self._track.fix(row.time, row.latitude, row.longitude, error)

    @property
    def trouble(self) -> str:
        """Why to stop; "" while the boat turns as ordered."""
        return self._response.trouble or self._track.trouble

    @property
    def doubt(self) -> str:
        """The same as `trouble`, with a lower threshold."""
        return self._response.doubt or self._track.doubt


def _or_zero(value: float) -> float:
    return value if math.isfinite(value) else 0.0
