"""SteeringFilter: motion through the water, current and response to orders, by a bank of hypotheses of the current.

Positions determine the velocity over ground, but not which part of it is current. Every hypothesis of the current is an
extended Kalman filter of `motion`. The first turns show which hypothesis is right.
"""

import math
from collections import deque

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.checks import positive
from steerway.core.estimate import NOTHING_KNOWN, Estimate
from steerway.estimation.steering.correction import GOOD, REFUSED, fold, take_number, take_position, take_velocity
from steerway.estimation.steering.mixture import Mixture, estimate_of, over_ground
from steerway.estimation.steering.motion import HEADING, WATER_SPEED, YAW_RATE, moved_by_orders
from steerway.estimation.steering.prediction import predict_bank
from steerway.estimation.steering.receiver import ReceiverNoise
from steerway.estimation.steering.response import Response
from steerway.estimation.steering.start import (
    any_heading,
    departing,
    drifting,
    forget_speed_gain,
    hypotheses,
    straight_line,
)

START_TIME, START_FIXES, LONGEST_START = 2.0, 3, 6.0
"""Least time (s), least number of fixes and longest time (s) of the first straight line. Chosen: in a longer time a
boat turns."""
_START_STD = 0.1
"""The filter starts when 1σ of the first velocity is below this share of the usual speed. Chosen: the direction is then
known to 6°."""
_CHANGES = 0.15
"""1σ of the difference between the velocity at the end of the first line and the mean along it, as a share of the usual
speed. It applies to vehicles with a speed loop of their own or a known throttle. Chosen: a boat that starts gains a
tenth of the usual speed in 1 s."""
_LOST = 3.0
"""Time, s, of unbroken refusals after which the fixes are used: the receiver's position has jumped. Chosen: longer than
`core.statistics.UNBROKEN_REJECTION`, because the orders determine the motion meanwhile."""
_LEAST_STD, _MOST_STD, _FIRST_SLOW = 0.01, 3.0, 0.1
"""Bounds of the learned 1σ of the receiver's white noise and slow error, and the 1σ of its slow error before it is
learned; m. Chosen: the bounds range from real-time kinematics to a receiver under trees."""
MODEL_TIME, MODEL_SHARE = 0.05, 0.05
"""Least 1σ of a measured position (s, times the usual speed) and velocity (share of the usual speed): the model of the
motion is no better. Chosen after a ship's sideslip of 4°, 0.07 of the speed, was estimated as current."""
_LATELY, _WORST, _LARGEST_MISFIT = 0.1, 50.0, 9.0
"""Weight of one fix in the running mean of the NIS; the NIS at which one fix is clipped; and the mean above which the
hypotheses are made again. Chosen: for a single fix, 9.2 is the 99 % quantile of χ² with 2 degrees of freedom."""
_REST, _UNKNOWN_STD = 0.25, 1.5
"""Share of the usual speed below which a boat without an order counts as at rest in the water (an idling one after 1.4
time constants of its speed); and least 1σ of the heading at rest, rad. Chosen: uniform directions have π/√3 = 1.8.
"""
_GATHERED = 1.4
"""A driven boat counts as moving after this many time constants of its speed. Chosen: 75 % of the final speed."""
_UNSTEADY, _SETTLING = 0.25, 5.0
"""1σ of the speed about the modelled response while a vehicle's own speed loop settles, as a share of the usual speed,
and the settling time, s. Chosen: ArduPilot's Rover begins without thrust; a motorboat loses a third of its speed."""
_DRIVEN_NOISE = 0.12
"""1σ of the speed about the one that the throttle yields, as a share of the usual speed. The value is chosen."""
_FULL = 0.95
"""Share of the top speed above which a throttle counts as full. Chosen: without it, orders that a vehicle cannot carry
out in a current gave a wrong gain of the speed, 0.78 instead of 1."""
_GYRO_STD, _GYRO_LATE = math.radians(0.5), 0.05
"""1σ of a measured yaw rate, rad/s, and the error of its time, s. Chosen: this error is half the interval at which
vehicles send the yaw rate.
"""
_COMPASS_STD = math.radians(2.0)
"""1σ of a compass reading beside its deviation, rad. The value is chosen."""
_LEARNED = 0.02
"""Weight of one reading in an instrument's mean NIS. If this mean is above 1, it multiplies the instrument's variance.
Chosen: the mean is over some fifty readings."""


class SteeringFilter:
    """The filter of one boat; times are s of any one clock.

    `idle_since`, to be set before a fix: the time since which the motor is known to idle; inf if this is unknown. An
    idling boat soon drifts with current and wind alone, so that the current is known when it departs.

    `driven_since`, also set before a fix: the time since which the motor is known to drive the boat (then not at rest).

    response: of the boat to orders. position_std: 1σ of a fix before it is learned, m. velocity_std: 1σ of the
    receiver's velocity, m/s. learn: whether the receiver's noise is learned from its fixes.
    """

    def __init__(self, response: Response, position_std: float = 0.3, velocity_std: float = 0.1, *, learn: bool = True):
        self.response = response
        self._least_std = max(_LEAST_STD, MODEL_TIME * response.speed)
        self.position_std = max(positive("position_std", position_std), self._least_std)
        self.velocity_std = max(positive("velocity_std", velocity_std), MODEL_SHARE * response.speed)
        self.learn = learn
        self.refused_for = 0.0  # s since the last fix that fitted
        self.idle_since = self.driven_since = math.inf
        self._taken = -math.inf  # when orders began
        self._drifts = False  # whether the boat is at rest in the water because the motor idles
        self._parameters = response.packed
        unsteady = max(response.speed_noise, _UNSTEADY if response.over_ground else 0.0)
        self._at_first = response._replace(speed_noise=unsteady).packed
        self._driven = response._replace(speed_noise=_DRIVEN_NOISE, over_ground=False).packed
        self._is_by_throttle = False  # whether the last ordered speed is the one that the throttle yields
        self._forgets = False  # whether the gain of the speed is reset at the next order of a speed
        self._noise = ReceiverNoise()
        self.slow_std = _FIRST_SLOW
        self._misfit = 2.0  # mean NIS of the latest fixes
        self._recent: deque[tuple[float, float, float]] = deque()
        self._begun = -math.inf  # when the hypotheses were made
        self._orders: deque[tuple[float, float, float]] = deque([(-math.inf, math.nan, math.nan)])
        self._table = np.array(self._orders)
        self._mixture = Mixture(np.empty((0, 0)), np.empty((0, 0, 0)), np.empty(0))
        self._time = math.nan
        self._ahead = (math.nan, np.empty(0))
        self._deviations: tuple[float, float] | None = None
        self._drift: tuple[float, float] | None = None  # velocity over ground of a boat at rest in the water
        self._measured_rate = math.nan  # the last yaw rate
        self._larger = {HEADING: 1.0, YAW_RATE: 1.0}  # ratio of an instrument's variance to the assumed one

    @property
    def started(self) -> bool:
        """Whether the motion is known."""
        return len(self._mixture.states) > 0

    def order(self, time: float, yaw_rate: float, speed: float, driven: float = math.nan) -> None:
        """Set the orders in force from `time` on: steady yaw rate (rad/s) and speed through the water (m/s).

        yaw_rate is NaN while someone else steers, speed is NaN if it is not controlled. driven: the speed through the
        water that the throttle yields, m/s, NaN if unknown. It is used while someone else steers, `_SETTLING` s longer,
        and at full throttle: the boat may then be slower than ordered.
        """
        _, rate, before = last = self._orders[-1]
        at_first = math.isnan(rate) or time - self._taken < _SETTLING
        by_throttle = math.isfinite(driven) and (math.isnan(yaw_rate) or at_first)
        if self._forgets and not by_throttle and self.started:
            forget_speed_gain(self._mixture.states, self._mixture.covariances, self.response)
        self._forgets = by_throttle
        self._is_by_throttle = by_throttle or driven > _FULL * self.response.top_speed
        speed = driven if self._is_by_throttle else speed
        if _same(rate, yaw_rate) and _same(before, speed):
            return
        if math.isnan(rate) and math.isfinite(yaw_rate):
            self._taken = time
        if time <= last[0]:
            self._orders.pop()
        self._orders.append((time, yaw_rate, speed))
        while len(self._orders) > 2 and self._orders[1][0] < self._oldest:
            self._orders.popleft()
        self._table = np.array(self._orders)
        self._drift_or_depart(time)

    @property
    def _oldest(self) -> float:
        """The time before which orders have no further effect."""
        return self._time - 1.0 if self.started else math.inf

    def fix(
        self,
        time: float,
        north: float,
        east: float,
        north_velocity: float = math.nan,
        east_velocity: float = math.nan,
        heading: float = math.nan,
        yaw_rate: float = math.nan,
    ) -> int:
        """Use a fix and other measurements (m, m/s, rad, rad/s; NaN for none). Returns GOOD, MANOEUVRED or REFUSED."""
        self._remember(time, north, east)
        if not self.started:
            self._begin(time, START_TIME)
            return GOOD
        interval = max(time - self._time, 0.0)
        predict_bank(*self._mixture[:2], self._table, self._parameters_at(time), self.slow_std**2, self._time, time)
        self._time = time
        self._drift_or_depart(time)
        kind, nis = take_position(
            *self._mixture,
            north,
            east,
            self.position_std,
            interval,
            self.response.speed,
            self.response.rate,
            self.response.pivot,
        )
        if kind == REFUSED and self.refused_for == 0.0:
            self._recent = deque([(time, north, east)])  # a line through fixes before a jump misleads
        self.refused_for = self.refused_for + interval if kind == REFUSED else 0.0
        if kind != REFUSED:
            self._misfit += _LATELY * (min(nis, _WORST) - self._misfit)
        if self.refused_for > _LOST or (self._misfit > _LARGEST_MISFIT and time - self._begun > LONGEST_START):
            self._begin(time, 0.5 * START_TIME)
            return kind
        if math.isfinite(north_velocity + east_velocity) and kind != REFUSED:
            measured = north_velocity, east_velocity, self.velocity_std, self.response.pivot
            take_velocity(*self._mixture, *measured)
        self._read(heading, _COMPASS_STD, HEADING)
        change = (yaw_rate - self._measured_rate) / max(interval, 0.1)
        self._read(yaw_rate, math.hypot(_GYRO_STD, _GYRO_LATE * change if math.isfinite(change) else 0.0), YAW_RATE)
        self._measured_rate = yaw_rate
        slow = _REST * self.response.speed
        fold(self._mixture.states, self._mixture.covariances, self.response.linear, slow)
        if len(self._mixture.weights) > 1:
            self._mixture = self._mixture.pruned(0.05 * self.response.speed)
        self._forget_heading()
        self._ahead = (math.nan, self._ahead[1])
        self._deviations = None
        return kind

    def _parameters_at(self, time: float) -> Response:
        """The parameters of the response for a prediction from the last fix to this time."""
        if self._is_by_throttle:
            return self._driven
        return self._at_first if time - self._taken < _SETTLING else self._parameters

    def _read(self, number: float, std: float, what: int) -> None:
        """Use a reading of compass or gyro, NaN for none. Its variance is learned, but is at least the assumed one."""
        if not math.isfinite(number):
            return
        larger = max(1.0, self._larger[what])
        nis = take_number(*self._mixture, number, math.sqrt(larger) * std, what)
        self._larger[what] += _LEARNED * (min(larger * nis, _WORST) - self._larger[what])

    def _way(self, time: float) -> float:
        """1σ (m/s) of the speed through the water of a boat at rest with an idling motor; inf for any other boat."""
        if math.isfinite(self._orders[-1][1]):
            return math.inf
        left = math.exp(min((self.idle_since - time) / self.response.speed_time, 0.0))
        return left * self.response.speed if left < _REST else math.inf

    def _is_driven(self, time: float) -> bool:
        """Whether the motor has driven the boat for long enough that it is not at rest."""
        return time - self.driven_since > _GATHERED * self.response.speed_time

    def _drift_or_depart(self, time: float) -> None:
        """Set the speed through the water of a drifting boat to what remains of it; note when the drift ends."""
        way, drifted = self._way(time), self._drifts
        self._drifts = self.started and math.isfinite(way)
        if drifted and not self._drifts:
            departing(self._mixture.covariances, self.response)
        if self._drifts:
            if not drifted:
                take_number(*self._mixture, 0.0, way, WATER_SPEED)
            drifting(self._mixture.states, self._mixture.covariances, way)

    def _forget_heading(self) -> None:
        """Make the heading unknown if the boat has no order and no gyro and is at rest in the water: no fix shows it.

        The current hardly changes. If the velocity over ground changes although the motor is not known to idle, the
        boat moves: hypotheses are made again.
        """
        slow = _REST * self.response.speed
        if math.isfinite(self._orders[-1][1]) or np.any(self._mixture.states[:, WATER_SPEED] > slow):
            self._drift = None
            return
        if self._is_driven(self._time):
            self._begin(self._time, 0.5 * START_TIME)
            return
        best = self._mixture.best
        x = self._mixture.states[best]
        velocity = over_ground(x)
        self._drift = self._drift or velocity
        if math.dist(velocity, self._drift) > slow and not self._drifts:
            self._begin(self._time, 0.5 * START_TIME)
        elif self._mixture.heading_std() < _UNKNOWN_STD and math.isnan(self._measured_rate):
            found = any_heading(x, self._mixture.covariances[best], self.response, self._way(self._time))
            self._mixture = Mixture(*found)

    def at(self, time: float) -> Estimate:
        """The motion at a time, predicted from the last fix by the orders since then."""
        if not self.started:
            return NOTHING_KNOWN
        best = self._mixture.best
        age, pivot = time - self._time, self.response.pivot
        x, p = self._moved(best, time), self._mixture.covariances[best]
        if self._deviations is None:  # the same until the next fix
            self._deviations = self._mixture.heading_std(), self._mixture.current_std()
        return estimate_of(x, p, *self._deviations, age, pivot)

    def _moved(self, best: int, time: float) -> Floats:
        """The state at a time, predicted from the last fix or from the time of the last call, if that was earlier."""
        before, x = self._ahead
        if not before <= time:
            before, x = self._time, self._mixture.states[best]
        x = moved_by_orders(x, self._table, self._parameters_at(time), before, time)
        self._ahead = time, x
        return x

    def _remember(self, time: float, north: float, east: float) -> None:
        self._noise.add(time, north, east)
        if self.learn:
            self._learn()
        self._recent.append((time, north, east))
        while time - self._recent[0][0] > LONGEST_START and len(self._recent) > START_FIXES:
            self._recent.popleft()

    def _begin(self, time: float, least: float) -> None:
        """Make the hypotheses from a straight line through the last fixes, once these span `least` s.

        They are made again if fixes do not fit for long: the position has jumped, or all hypotheses are wrong.
        """
        fixes = np.array(self._recent)
        line = None
        for since in range(len(fixes) - START_FIXES, -1, -1):
            lasted = time - fixes[since, 0]
            if lasted < least:
                continue
            moments, north, east = fixes[since:].T
            line = straight_line(moments, north, east, self.position_std)
            if line[3] < _START_STD * self.response.speed:
                break
        if line is None or (
            not self.started and line[3] > _START_STD * self.response.speed and lasted < 0.9 * LONGEST_START
        ):
            return
        way = self._way(time)
        self._drifts = math.isfinite(way)
        changes = _CHANGES * self.response.speed if self._is_by_throttle or self.response.over_ground else 0.0
        self._mixture = Mixture(*hypotheses(*line, self.response, way, self._is_driven(time), changes))
        self._time = self._begun = time
        self._misfit, self.refused_for, self._drift = 2.0, 0.0, None
        self._ahead = (math.nan, self._ahead[1])
        self._deviations = None

    def _learn(self) -> None:
        """Set the receiver's noise to the one that its fixes show."""
        if not math.isnan(self._noise.white):
            self.position_std = min(_MOST_STD, max(self._least_std, self._noise.white))
        if not math.isnan(self._noise.slow):
            self.slow_std = min(_MOST_STD, max(_LEAST_STD, self._noise.slow))


def _same(one: float, other: float) -> bool:
    return one == other or (math.isnan(one) and math.isnan(other))
