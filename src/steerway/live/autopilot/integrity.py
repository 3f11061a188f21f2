"""Whether the receiver sees and whether the boat answers, without the autopilot's own estimate.

That estimate explains a receiver that stands still by a current against the boat, and a boat that turns otherwise than
ordered by a current that changes. Positions that do not scatter as before, and a turn that is not the ordered one, are
judged here by themselves.
"""

import math
from collections import deque

import numpy as np

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.earth import displacement

LEAST_QUIET, QUIET_INTERVALS = 1.0, 5
"""s, and intervals of fixes, for which positions may stand still under way."""
DOUBTED, DOUBTED_INTERVALS = 1.5, 2
"""s, and at the least intervals of fixes, after which positions that stand still are said."""
_QUIET_SHARE = 0.1
"""Of the receiver's scatter: positions within so much of one another stand still. Chosen: of six that scatter as before
one in 10⁹ times."""
_SQUARES, _MEDIAN = 20.0, 1.386
"""Sum of the squared weights of a third difference, and the median of χ² with 2 degrees of freedom."""
_USUALLY, _SLOWEST = 3.0, 0.05
"""Times the usual time between two places for which one may stay, and m/s at which a boat crosses the last digit."""
_PACES, _KEPT = 20, 100  # places over which their usual time is taken, and third differences for the scatter
_LEAST_KNOWN = 10
_UNDER_WAY = 0.3  # m/s over ground, from which on that time is learned
_ROUNDING = 1e-3  # s
LARGEST_MISSED = math.radians(45.0)
"""rad by which the boat may have turned otherwise than ordered, of what is forgotten in `FORGETS` s. In a
prototype sound boats that take yaw rates peaked at 16 to 19°. By propellers, where turns are not judged, an Otter
reached 63°."""
DOUBTED_MISSED = math.radians(30.0)
MISSED_SHARE = 0.5
"""Of what was ordered in that time that the boat may miss: at its start, with little thrust, a boat of 80°/s makes 35
of 60°/s for 4 s. Chosen."""
FORGETS = 10.0
_CURRENT_TIME = 20.0
"""s in which another estimate of the current is believed here: an estimate led astray changes in less. Chosen."""
_LEAST_SPEED = 0.4
"""Share of the usual speed through the water below which its direction tells no turn."""
_DELAYS = np.array((0.3, 1.0, 2.0, 3.0))
"""s by which the turn of a velocity made of positions may be behind that of the bow. Chosen: a small boat's sideslip
takes about one, the filters of receiver and navigator up to two."""
_CURRENTS = 3
LASTING = 2.0
"""s for which a turn has to be missed."""
_OTHERWISE = "the boat does not turn as ordered"
_LONGEST = 3.0  # s between two fixes over which a turn is compared
_TRACK, _EVERY = 15.0, 1.0
"""s of a track that is compared with the orders, and s between two comparisons."""
_LEAST_TURN = math.radians(20.0)  # ordered in it
_LEAST_GAIN, _MIRRORED, _PERHAPS = 4.0, 20.0, 10.0
"""By how much the mirror image of the orders has to fit a track better at a comparison, in twice the nats, and the sums
of what is beyond that from which on the boat is taken to turn otherwise, and from which on it is said. Chosen on a desk
boat in currents of 0.2 to 0.96 m/s with receivers that wander by up to 1 m: of 38 sound routes one is above, and of 21
reversals 19 after at most 9 s of orders of 5°/s or more."""
_ERROR, _ERROR_TIME = 0.35, 0.3
"""m, and s of the usual speed, 1σ of the error of one s of a track: receiver, sideslip, speed lost in turns. Chosen."""
_CURRENT_SHARE, _SPEED_SHARE = 0.5, 0.3
"""1σ of a component of the current, and of the speed through the water, in shares of the usual speed. Chosen."""


class ReceiverMonitor:
    """Positions in the order of their arrival; `quiet` is for how long they have stood still, s."""

    def __init__(self):
        self._last: deque[tuple[float, float, float]] = deque(maxlen=4)  # time, and places as differences
        self._third: deque[float] = deque(maxlen=_KEPT)
        self._paces: deque[float] = deque(maxlen=_PACES)
        self._digit = math.inf  # m, the least difference of two places
        self._origin: tuple[float, float] | None = None
        self.restart()

    def restart(self) -> None:
        """The boat is under way from now on."""
        self.quiet = 0.0
        self._stood = math.nan, math.nan, math.nan  # since when, and where
        self._speed = 0.0  # over ground, when it came there
        self._doubted = self._most = math.inf

    def fix(self, time: float, latitude: float, longitude: float, sog: float, interval: float) -> None:
        """A position of a time (s; rad), the estimated speed over ground and the usual interval (s); NaN: unknown."""
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
        """1σ of one axis by the third differences of positions, m; 0 before there are enough."""
        if len(self._third) < _LEAST_KNOWN:
            return 0.0
        return math.sqrt(sorted(self._third)[len(self._third) // 2] / (_SQUARES * _MEDIAN))

    @property
    def trouble(self) -> str:
        """Why to stop, "" while the positions move, or scatter as they did."""
        return self._words if self.quiet >= self._most - _ROUNDING else ""

    @property
    def doubt(self) -> str:
        """The same, earlier."""
        return self._words if self.quiet >= self._doubted - _ROUNDING else ""

    @property
    def _words(self):
        return f"the receiver's position stands still for {self.quiet:.1f} s"

    def _learn(self, time, north, east):
        self._last.append((time, north, east))
        if len(self._last) == 4:
            (_, n0, e0), (_, n1, e1), (_, n2, e2), (_, n3, e3) = self._last
            self._third.append((n3 - 3.0 * (n2 - n1) - n0) ** 2 + (e3 - 3.0 * (e2 - e1) - e0) ** 2)

    def _honest(self, interval):
        """s for which positions of few digits, or given several times, stand still although the boat moves."""
        crossing = _USUALLY * self._digit / max(self._speed, _SLOWEST) if math.isfinite(self._digit) else 0.0
        if len(self._paces) < _LEAST_KNOWN:
            return crossing
        pace = sorted(self._paces)[3 * len(self._paces) // 4]
        return max(crossing, _USUALLY * pace) if pace > 1.5 * interval else crossing


class ResponseMonitor:
    """How far the boat has turned otherwise than ordered: `missed`, rad, + to starboard of the order.

    A gyro tells that at once. Without one the turn is that of the motion through the water, by positions alone. It
    follows the order later, by a slip and by a filter that are not known, and the current is not known either: of some
    delays and currents the one counts by which least is missed, and nothing where they disagree about the side.

    time: in which the yaw rate follows an order, s; speed: usual through the water, m/s.
    """

    def __init__(self, time: float, speed: float):
        self._time, self._usual = max(time, 1e-3), speed
        self._slow = math.nan, math.nan
        self.restart()

    def restart(self) -> None:
        """The boat is under way from now on."""
        self._rate, self._seen = 0.0, np.zeros(len(_DELAYS))  # that is expected, and as it is seen delayed, rad/s
        self._turned, self._seen_turned = 0.0, np.zeros(len(_DELAYS))  # since the last fix, rad
        self._asked = 0.0  # size of the turns ordered, forgotten as what is missed, rad
        self._by_gyro, self._by_positions = 0.0, np.zeros((_CURRENTS, len(_DELAYS)))
        self._fixed = math.nan
        self._velocity = math.nan, math.nan
        self._lately: deque[tuple[float, float]] = deque()

    def order(self, yaw_rate: float, dt: float) -> None:
        """Adds the yaw rate ordered over the last dt s (rad/s); NaN if the autopilot did not steer."""
        yaw_rate = yaw_rate if math.isfinite(yaw_rate) else 0.0
        self._rate += (yaw_rate - self._rate) * -math.expm1(-dt / self._time)
        self._seen += (self._rate - self._seen) * -np.expm1(-dt / _DELAYS)
        self._turned += self._rate * dt
        self._seen_turned += self._seen * dt

    def fix(self, time: float, sog: float, cog: float, yaw_rate: float, current: tuple[float, float]) -> None:
        """A fix of a time (s): the velocity over ground by positions alone, the yaw rate of a gyro, and the current as
        the autopilot estimates it; NaN for unknown.
        """
        step, self._fixed = time - self._fixed, time
        expected, seen = self._turned, self._seen_turned
        self._turned, self._seen_turned = 0.0, np.zeros(len(_DELAYS))
        before, self._velocity = self._velocity, (sog * math.cos(cog), sog * math.sin(cog))
        if not 0.0 < step < _LONGEST:
            return
        kept = math.exp(-step / FORGETS)
        self._asked = kept * self._asked + abs(expected)
        self._by_gyro *= kept
        self._by_positions *= kept
        if math.isfinite(yaw_rate):
            self._by_gyro += yaw_rate * step - expected
        for k, each in enumerate(self._currents(current, step)):
            turned = self._turn(before, each)
            if math.isfinite(turned):
                self._by_positions[k] += turned - seen
        self._lately.append((time, self._by_gyro if math.isfinite(yaw_rate) else _least(self._by_positions)))
        while time - self._lately[0][0] > LASTING + _ROUNDING:
            self._lately.popleft()

    @property
    def missed(self) -> float:
        """The least of the last `LASTING` s."""
        return _least(np.array([missed for _, missed in self._lately])) if self._lately else 0.0

    @property
    def trouble(self) -> str:
        """Why to stop, "" while the boat turns as ordered."""
        return self._words if abs(self.missed) > max(LARGEST_MISSED, MISSED_SHARE * self._asked) else ""

    @property
    def doubt(self) -> str:
        """The same, earlier."""
        return self._words if abs(self.missed) > max(DOUBTED_MISSED, MISSED_SHARE * self._asked) else ""

    @property
    def _words(self):
        return f"{_OTHERWISE}, by {abs(math.degrees(self.missed)):.0f}° in {FORGETS:g} s"

    def _currents(self, current, step):
        """None, that of the estimate, and that of the estimate long ago."""
        if math.isfinite(sum(current)):
            share = -math.expm1(-step / _CURRENT_TIME) if math.isfinite(sum(self._slow)) else 1.0
            before = self._slow if share < 1.0 else current
            self._slow = tuple(old + share * (new - old) for old, new in zip(before, current, strict=True))
        known = [each for each in (current, self._slow) if math.isfinite(sum(each))]
        return [(0.0, 0.0), *known, *[(0.0, 0.0)] * (_CURRENTS - 1 - len(known))]

    def _turn(self, before, current):
        """Of the motion through the water since the last fix, rad; NaN where it is too slow to tell."""
        ways = [(north - current[0], east - current[1]) for north, east in (before, self._velocity)]
        if not min(math.hypot(*each) for each in ways) > _LEAST_SPEED * self._usual:
            return math.nan
        return wrap(math.atan2(*ways[1][::-1]) - math.atan2(*ways[0][::-1]))


class TrackMonitor:
    """Whether the places of the last `_TRACK` s show the turns that were ordered or their mirror image.

    Each explains a track by some current and some heading, both unknown here: the place is p + V t + A ∫exp(±iθ)dt with
    the turn θ that was ordered, complex, north + i east. Errors, current V ~ N(0, σ_V²) and speed |A| ~ N(U, σ_U²) are
    weighed. A current that mirrors turns is one that turns about, or twice the speed of the boat; neither is probable.

    time, speed: as of `ResponseMonitor`.
    """

    def __init__(self, time: float, speed: float):
        self._time, self._usual = max(time, 1e-3), speed
        self.restart()

    def restart(self) -> None:
        """The boat is under way from now on."""
        self._rate, self._seen = 0.0, np.zeros(len(_DELAYS))  # rad/s, as of `ResponseMonitor`
        self._turned = np.zeros(len(_DELAYS))  # rad
        self._track: deque[tuple[float, complex, Floats]] = deque()
        self._origin = 0.0, 0.0
        self._compared, self._evidence, self._error = math.nan, 0.0, _ERROR

    def order(self, yaw_rate: float, dt: float) -> None:
        """See `ResponseMonitor`."""
        yaw_rate = yaw_rate if math.isfinite(yaw_rate) else 0.0
        self._rate += (yaw_rate - self._rate) * -math.expm1(-dt / self._time)
        self._seen += (self._rate - self._seen) * -np.expm1(-dt / _DELAYS)
        self._turned = self._turned + self._seen * dt

    def fix(self, time: float, latitude: float, longitude: float, slow: float) -> None:
        """A position of a time: s; rad; slow: 1σ of what its errors have in common for seconds, m."""
        self._error = math.hypot(_ERROR, slow)
        if self._track and not 0.0 < time - self._track[-1][0] < _LONGEST:
            self.restart()
        if not self._track:
            self._origin = latitude, longitude
        self._track.append((time, complex(*displacement(latitude, longitude, *self._origin)), self._turned))
        while time - self._track[0][0] > _TRACK:
            self._track.popleft()
        if not time - self._compared < _EVERY - _ROUNDING:
            self._compared = time
            self._compare()

    @property
    def trouble(self) -> str:
        """Why to stop, "" while the boat turns as ordered."""
        return f"{_OTHERWISE}, its track is the mirror image" if self._evidence > _MIRRORED else ""

    @property
    def doubt(self) -> str:
        """The same, earlier."""
        return f"{_OTHERWISE}, its track is nearer to the mirror image" if self._evidence > _PERHAPS else ""

    def _compare(self):
        times, places, turns = (np.array(each) for each in zip(*self._track, strict=True))
        gained = 0.0
        if len(times) >= _LEAST_KNOWN and np.ptp(turns[:, 0]) >= _LEAST_TURN:
            delays = range(len(_DELAYS))
            ordered = min(self._cost(times, places, turns[:, k]) for k in delays)
            mirrored = min(self._cost(times, places, -turns[:, k]) for k in delays)
            gained = (ordered - mirrored) / max(1.0, mirrored / (2.0 * _TRACK))  # in errors as large as are left
        self._evidence = max(0.0, self._evidence + gained - _LEAST_GAIN)

    def _cost(self, times, places, turn):
        """Twice the −log density of places (n,; complex, m) for a turn (n,; rad), but for a constant."""
        usual, t = self._usual, times - times[0]
        steps = np.diff(t)
        way = np.exp(1j * turn)
        way = np.concatenate(([0.0], np.cumsum(0.5 * steps * (way[1:] + way[:-1]))))
        share = np.minimum(np.concatenate((steps[:1], steps)), 1.0) / (self._error**2 + (_ERROR_TIME * usual) ** 2)
        columns = np.stack((np.ones(len(t)), t, way, places))
        products = (columns.conj() * share) @ columns.T
        products[1, 1] += (_CURRENT_SHARE * usual) ** -2
        for k in range(2):  # without place and current
            products = products - np.outer(products[:, k], products[k]) / products[k, k]
            products[k, k] = 1.0
        known = max(products[2, 2].real, 1e-12)
        speed = abs(products[2, 3]) / known
        left = products[3, 3].real - known * speed**2
        return left + (speed - usual) ** 2 / (1.0 / known + (_SPEED_SHARE * usual) ** 2)


def _least(values):
    """The one nearest to 0; 0 where they have not one sign."""
    least, most = float(values.min()), float(values.max())
    return least if least > 0.0 else min(most, 0.0)
