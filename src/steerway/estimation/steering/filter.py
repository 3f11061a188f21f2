"""SteeringFilter: motion through the water, current and response to orders, by a bank of hypotheses of the current.

One position tells speed and course over ground, not which of it is current. Every hypothesis of the current is an
extended Kalman filter of `motion`; the first turns show which is right.
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
"""s and fixes of the first straight line, and s at most. Chosen: in longer a boat turns."""
_START_STD = 0.1
"""1σ of the first velocity, in shares of the usual speed, that is waited for. Chosen: its direction is
then known to 6° at that speed."""
_CHANGES = 0.15
"""1σ of the difference between the velocity at the end of that line and its average, in shares of the usual speed, for
a vehicle with a speed loop of its own or a known throttle. Chosen: a boat that gathers way changes it by 0.1 in 1 s."""
_LOST = 3.0
"""s of refused fixes after which they are believed: the receiver's position has jumped. Chosen: longer than
`core.statistics.UNBROKEN_REJECTION`, as the orders give the motion."""
_LEAST_STD, _MOST_STD, _FIRST_SLOW = 0.01, 3.0, 0.1
"""m: limits of what is learned of the receiver, and its slow error before it is learned. Chosen:
receivers from real-time kinematics to one under trees."""
MODEL_TIME, MODEL_SHARE = 0.05, 0.05
"""s, and share, of the usual speed: position and velocity are not known better than the model of the motion.
Chosen after a ship's sideslip of 4°, 0.07 of the speed, was estimated as current."""
_LATELY, _WORST, _LARGEST_MISFIT = 0.1, 50.0, 9.0
"""Part of a fix in the mean NIS, the largest that counts, and the mean above which the hypotheses are made anew.
Chosen: 9.2 is the 99 % quantile of χ² with 2 degrees of freedom for a single fix."""
_REST, _UNKNOWN_STD = 0.25, 1.5
"""Share of the usual speed below which a boat without an order is at rest in the water, by its estimate or 1.4 time
constants of its speed after its motor began to idle; and 1σ (rad) that its heading has there at the least. Chosen: of
uniform directions it is π/√3 = 1.8.
"""
_GATHERED = 1.4
"""Time constants of its speed after which a boat whose motor drives it has gathered way. Chosen: 75 % of it."""
_UNSTEADY, _SETTLING = 0.25, 5.0
"""1σ of the speed beside its response, as a share, of a vehicle whose own speed loop begins, and s for which it does.
Chosen: the loop of a motorboat by ArduPilot's Rover begins without thrust, and loses a third of its speed."""
_DRIVEN_NOISE = 0.12
"""1σ of the speed beside the one that the throttle makes, as a share of the usual speed. Chosen."""
_GYRO_STD, _GYRO_LATE = math.radians(0.5), 0.05
"""σ of a measured yaw rate (rad/s), and the error of its time (s). Chosen: half of the interval at which
vehicles send it.
"""
_COMPASS_STD = math.radians(2.0)
"""rad of a compass beside its deviation. Chosen."""
_LEARNED = 0.02
"""Part of a reading in the mean NIS of an instrument, by which its variance is larger than said where that is above 1.
Chosen: fifty readings."""


class SteeringFilter:
    """The filter of one boat; times are s of any one clock.

    `idle_since`, to be set before a fix: the time since which the motor is known to idle, inf where it is not. At rest
    in the water the boat then moves with current and wind alone, so that the current is known when it departs.

    `driven_since`, likewise, the time since which it is known to drive the boat: that is then not at rest.

    response: what the boat makes of orders. position_std (m): of a fix, where learning begins. velocity_std (m/s): of
    the receiver's velocity. learn: whether the receiver's noise is learned from its fixes.
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
        self._drifts = False  # at rest in the water, since the motor idles
        self._parameters = response.packed
        unsteady = max(response.speed_noise, _UNSTEADY if response.over_ground else 0.0)
        self._at_first = response._replace(speed_noise=unsteady).packed
        self._driven = response._replace(speed_noise=_DRIVEN_NOISE, over_ground=False).packed
        self._is_by_throttle = False  # the speed of the last order is the one that the throttle makes
        self._noise = ReceiverNoise()
        self.slow_std = _FIRST_SLOW
        self._misfit = 2.0  # NIS in the mean of the last fixes
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
        self._larger = {HEADING: 1.0, YAW_RATE: 1.0}  # the variance of an instrument over what is said

    @property
    def started(self) -> bool:
        """Whether the motion is known."""
        return len(self._mixture.states) > 0

    def order(self, time: float, yaw_rate: float, speed: float, driven: float = math.nan) -> None:
        """What is ordered from now on: yaw rate (rad/s) as the boat settles at, speed through the water (m/s).

        NaN where someone else steers, or the speed is not controlled. driven: the speed through the water that the
        throttle makes, m/s, NaN where that is not known. It counts while someone else steers, and at first afterwards.
        """
        _, rate, before = last = self._orders[-1]
        at_first = math.isnan(rate) or time - self._taken < _SETTLING
        is_driven = math.isfinite(driven) and (math.isnan(yaw_rate) or at_first)
        if self._is_by_throttle and not is_driven and self.started:
            forget_speed_gain(self._mixture.states, self._mixture.covariances, self.response)
        self._is_by_throttle, speed = is_driven, driven if is_driven else speed
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
        """Orders before this time have no further effect."""
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
        """Use a fix of a time: m, m/s, rad and rad/s, NaN for what is not measured. GOOD, MANOEUVRED or REFUSED."""
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
            self._recent = deque([(time, north, east)])  # after a jump, those before it tell no velocity
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
        fold(self._mixture.states, self._mixture.covariances, self.response.linear)
        if len(self._mixture.weights) > 1:
            self._mixture = self._mixture.pruned(0.05 * self.response.speed)
        self._forget_heading()
        self._ahead = (math.nan, self._ahead[1])
        self._deviations = None
        return kind

    def _parameters_at(self, time: float) -> Response:
        """The response until a time after the last fix."""
        if self._is_by_throttle:
            return self._driven
        return self._at_first if time - self._taken < _SETTLING else self._parameters

    def _read(self, number: float, std: float, what: int) -> None:
        """Use a reading of compass or gyro, NaN for none; its variance is learned where it is larger than said."""
        if not math.isfinite(number):
            return
        larger = max(1.0, self._larger[what])
        nis = take_number(*self._mixture, number, math.sqrt(larger) * std, what)
        self._larger[what] += _LEARNED * (min(larger * nis, _WORST) - self._larger[what])

    def _way(self, time: float) -> float:
        """1σ of the speed through the water (m/s) that is left of the usual one where the motor is known to idle; inf
        where it is not, and before the boat is at rest.
        """
        if math.isfinite(self._orders[-1][1]):
            return math.inf
        left = math.exp(min((self.idle_since - time) / self.response.speed_time, 0.0))
        return left * self.response.speed if left < _REST else math.inf

    def _is_driven(self, time: float) -> bool:
        """Whether the boat has gathered way by its motor."""
        return time - self.driven_since > _GATHERED * self.response.speed_time

    def _drift_or_depart(self, time: float) -> None:
        """In a drift there is no speed through the water but what is left; at first that tells hypotheses apart."""
        way, drifted = self._way(time), self._drifts
        self._drifts = self.started and math.isfinite(way)
        if drifted and not self._drifts:
            departing(self._mixture.covariances, self.response)
        if self._drifts:
            if not drifted:
                take_number(*self._mixture, 0.0, way, WATER_SPEED)
            drifting(self._mixture.states, self._mixture.covariances, way)

    def _forget_heading(self) -> None:
        """Without an order and at rest in the water nothing tells the heading.

        The current does not change: a boat whose velocity over ground does is under way, and the hypotheses begin anew.
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
        if math.dist(velocity, self._drift) > slow:
            self._begin(self._time, 0.5 * START_TIME)
        elif self._mixture.heading_std() < _UNKNOWN_STD:
            found = any_heading(x, self._mixture.covariances[best], self.response, self._way(self._time))
            self._mixture = Mixture(*found)

    def at(self, time: float) -> Estimate:
        """The motion at a time, by the orders since the last fix; the heading is that through the water."""
        if not self.started:
            return NOTHING_KNOWN
        best = self._mixture.best
        age, pivot = time - self._time, self.response.pivot
        x, p = self._moved(best, time), self._mixture.covariances[best]
        if self._deviations is None:  # the same until the next fix
            self._deviations = self._mixture.heading_std(), self._mixture.current_std()
        return estimate_of(x, p, *self._deviations, age, pivot)

    def _moved(self, best: int, time: float) -> Floats:
        """The state at a time, from the state asked for last where that was earlier."""
        before, x = self._ahead
        if not before <= time:
            before, x = self._time, self._mixture.states[best]
        x = moved_by_orders(x, self._table, self._driven if self._is_by_throttle else self._parameters, before, time)
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
        """Hypotheses by a straight line through the last fixes; none before they span `least` s.

        Anew where fixes do not fit for long: the position has jumped, or all hypotheses have gone astray.
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
        """The receiver's noise is what its fixes show."""
        if not math.isnan(self._noise.white):
            self.position_std = min(_MOST_STD, max(self._least_std, self._noise.white))
        if not math.isnan(self._noise.slow):
            self.slow_std = min(_MOST_STD, max(_LEAST_STD, self._noise.slow))


def _same(one: float, other: float) -> bool:
    return one == other or (math.isnan(one) and math.isnan(other))
