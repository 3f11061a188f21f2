"""The numbers of one structure as flat keys of a profile, and its model.

Its vessel has one mode, in which white noise drives speed and course rate. With `turn_time` it has more: a course held
for long, a course just taken up, and a turn. Shaping filters add persistent acceleration, and yaw in
waves, if the profile has them.
"""

import math
from typing import NamedTuple, Self

import numpy as np
from pydantic import BaseModel, model_validator

from steerway.core.arrays import Floats
from steerway.core.settings import positive_number
from steerway.estimation.filter.bank import LEAST_SHARE
from steerway.estimation.filter.model import MODE, ON_ACCELERATION, ON_AID, ON_COURSE, ON_FIX, RECEIVER, Model
from steerway.estimation.vessel.aids import TABLE, AidNoise
from steerway.estimation.vessel.structures import Shaping, Structure, assembled

SHORTEST_PERIOD = 3.0
"""Shortest period (s) of wave-induced yaw: the longest step of a prediction. Faster yaw is noise of the course."""
_LEAST_DECAY = 1e-3
"""Least decay (1/s) of the course rate in the long run: with less, a course rate outlasts every forecast."""
_OF_A_MODE = ("speed_noise", "course_rate_noise", "course_rate_decay")
FOLLOWED_AFTER = 2.0
"""Time, s, for which fixes that agree on another place are rejected: a jump of one second is no step of the
receiver."""
_LARGEST_START_RATE = math.radians(20.0)
"""Largest 1σ (rad/s) of the course rate at the start: a small craft in a hard turn."""
_AGES, _AGES_SMOOTHED = (0.8,), (0.8, 0.3, 0.1)
"""Mean durations, in mean turns, of the modes of a course just taken up, the youngest last. A course just taken up is
uncertain; in one mode with courses held for long, it would keep those uncertain too. The duration is about one turn, in
which the rest of the turn dies away. A smoother sees a course from both sides, so that one mode for all ages loses
more: held courses then err by 14 % more at 2.5 m of noise, and by 4 % more at 0.5 m. Ages of turns improve nothing.
Judged by `steerway study estimator-limits`."""
_LEAST_SHARE_SMOOTHED = 0.3
"""Replaces `bank.LEAST_SHARE`, 0.001, in a smoother. With 0.001, held courses err by 20 % more at 2.5 m of noise and by
10 % more at 0.5 m."""


class WeighedModel(NamedTuple):
    """A model and its weight."""

    weight: float
    model: Model


Weighed = Structure | WeighedModel


class MotionNoise(BaseModel):
    """How a vessel moves. Noise is a spectral density: it does not depend on the filter's rate.

    With `turn_time` there are two modes, a course held and a turn; without it one.
    """

    speed_noise: float = positive_number(0.0, unit="m²/s³", what="spectral density S_U of speed noise")
    course_rate_noise: float = positive_number(0.0, unit="rad²/s³", what="spectral density S_ω of course-rate noise")
    speed_decay: float = positive_number(0.0, or_zero=True, unit="1/s", what="speed decay α1", most=10.0)
    course_rate_decay: float = positive_number(0.1, or_zero=True, unit="1/s", what="course-rate decay α2")
    # Persistent acceleration along the course; 0: none.
    acceleration_std: float = positive_number(0.0, or_zero=True, unit="m/s²", what="1σ of the persistent acceleration")
    acceleration_time: float = positive_number(5.0, unit="s", what="time constant of the acceleration")
    # Wave-induced yaw about a mean course; 0: none.
    yawing_period: float = positive_number(0.0, or_zero=True, unit="s", what="period of wave-induced yaw")
    yawing_time: float = positive_number(15.0, unit="s", what="time constant of the mean course")
    steerageway: float = positive_number(0.3, unit="m/s", what="speed below which course is not defined", most=20.0)
    turn_time: float = positive_number(0.0, or_zero=True, unit="s", what="mean duration of a turn")
    straight_time: float = positive_number(0.0, or_zero=True, unit="s", what="mean duration of a held course")
    turn_speed_noise: float = positive_number(0.0, or_zero=True, unit="m²/s³", what="S_U in a turn")
    turn_course_rate_noise: float = positive_number(0.0, or_zero=True, unit="rad²/s³", what="S_ω in a turn")
    turn_course_rate_decay: float = positive_number(0.0, or_zero=True, unit="1/s", what="α2 in a turn")


class ReceiverErrors(BaseModel):
    """Errors of fixes, north and east: white noise, and up to two first-order Gauss–Markov errors."""

    position_std: float = positive_number(0.0, most=1e4, unit="m", what="1σ of the white noise of a fix")
    time_std: float = positive_number(0.0, or_zero=True, unit="s", what="1σ of a fix's time stamp", most=60.0)
    error_std: float = positive_number(0.0, or_zero=True, unit="m", what="1σ of the slow error of the receiver")
    error_time: float = positive_number(60.0, unit="s", what="correlation time of the slow error")
    drift_std: float = positive_number(0.0, or_zero=True, unit="m", what="1σ of the slower error of the receiver")
    drift_time: float = positive_number(600.0, unit="s", what="correlation time of the slower error")
    # By default the median of its prior for a log of unknown origin.
    outlier_rate: float = positive_number(1e-3, or_zero=True, most=0.5, unit="1", what="share of outliers among fixes")


class Numbers(AidNoise, ReceiverErrors, MotionNoise):
    """The numbers of one structure."""

    @model_validator(mode="after")
    def _whole_turn(self) -> Self:
        given = {name: getattr(self, name) for name in ("straight_time", "turn_speed_noise", "turn_course_rate_noise")}
        if self.turn_time > 0.0 and not all(given.values()):
            missing = next(name for name, value in given.items() if not value)
            raise ValueError(f"turn_time is {self.turn_time}, which needs a positive {missing} too")
        return self

    @model_validator(mode="after")
    def _oscillation_alone(self) -> Self:
        if self.yawing_period > 0.0 and self.turn_time > 0.0:
            raise ValueError("yawing_period and turn_time are both given, expected one of them")
        if 0.0 < self.yawing_period < SHORTEST_PERIOD:
            raise ValueError(f"yawing_period is {self.yawing_period}, expected 0 or at least {SHORTEST_PERIOD} s")
        return self

    @property
    def turning(self) -> Self | None:
        """The mode of a turn as a profile of one mode; None for a profile that has one mode."""
        if self.turn_time == 0.0:
            return None
        update = {name: getattr(self, f"turn_{name}") for name in _OF_A_MODE} | {"turn_time": 0.0}
        return self.model_copy(update=update)

    @property
    def agility(self) -> float:
        """Spectral density of the course-rate noise in a turn, rad²/s³."""
        return self.turn_course_rate_noise if self.turn_time > 0.0 else self.course_rate_noise

    @property
    def on_average(self) -> Self:
        """The profile of one mode with the same asymptotic diffusion of speed and course."""
        turning = self.turning
        if turning is None:
            return self
        share = self.turn_time / (self.turn_time + self.straight_time)

        def dispersion(numbers: Numbers) -> float:
            return numbers.course_rate_noise / max(numbers.course_rate_decay, _LEAST_DECAY) ** 2

        speed = share * turning.speed_noise + (1.0 - share) * self.speed_noise
        course = share * dispersion(turning) + (1.0 - share) * dispersion(self)
        decay = max(turning.course_rate_decay, _LEAST_DECAY)
        update = {"speed_noise": speed, "course_rate_noise": course * decay**2, "course_rate_decay": decay}
        return turning.model_copy(update=update)


def model_of_profile(numbers: Numbers, aid: tuple[str, ...] = (), smoothed: bool = False) -> Model:
    """The model of a profile (`Profile`), with the states that these aids need; `smoothed`: for a smoother."""
    shapings = [*_motion(numbers), *_errors(numbers), *_companions(numbers, aid)]
    variances = {each.name: getattr(numbers, each.noise) ** 2 for each in TABLE if each.name in aid}
    return assembled(*_modes(numbers, smoothed), shapings, _receiver(numbers), variances)


def _modes(numbers: Numbers, smoothed: bool) -> tuple[np.ndarray, Floats]:
    """(m,) MODE of one mode, or of a held course, younger courses and a turn; (m, m) rates of change between them."""
    if numbers.turning is None:
        return _mode(numbers, 1.0), np.zeros((1, 1))
    ages = _AGES_SMOOTHED if smoothed else _AGES
    ends, begins, turn = 1.0 / numbers.turn_time, 1.0 / numbers.straight_time, len(ages) + 1
    turn_share = begins / (begins + ends)
    generator = np.zeros((turn + 1, turn + 1))
    generator[:turn, turn], generator[turn, turn - 1] = begins, ends
    for k, age in enumerate(ages):
        generator[k + 1, k] = ends / age
    np.fill_diagonal(generator, -generator.sum(axis=1))
    held = [_mode(numbers, 1.0 - turn_share), *[_mode(numbers, 0.0) for _ in ages]]
    modes = np.concatenate([*held, _mode(numbers.turning, turn_share)])
    if smoothed:
        modes["least_share"] = _LEAST_SHARE_SMOOTHED
    return modes, generator


def _mode(numbers: Numbers, start: float) -> np.ndarray:
    """(1,) MODE of a profile of one mode; start: the probability of the mode at the start."""
    mode, noise, decay = np.zeros(1, MODE), numbers.course_rate_noise, numbers.course_rate_decay
    if numbers.yawing_period > 0.0:
        noise, decay = _under_waves(numbers)
    mode["speed_noise"], mode["speed_decay"] = numbers.speed_noise, numbers.speed_decay
    mode["rate_noise"], mode["rate_decay"] = noise, decay
    stationary = math.sqrt(0.5 * noise / decay) if decay > 0.0 else math.inf
    mode["start"], mode["start_rate"] = start, min(stationary, _LARGEST_START_RATE) ** 2
    mode["least_share"] = LEAST_SHARE
    mode["drift_speed"] = numbers.steerageway  # at a tenth of this, SOG of a boat that stops and goes errs 10 % more
    return mode


def _under_waves(numbers: Numbers) -> tuple[float, float]:
    """Noise and decay of the mean course's rate, for a vessel that yaws in waves; see `_yaw`."""
    decay, follows = numbers.course_rate_decay, 1.0 / numbers.yawing_time
    stiffness = (2.0 * math.pi / numbers.yawing_period) ** 2
    share = follows * (decay + follows) / (stiffness + decay * follows)
    return numbers.course_rate_noise * share**2, decay + follows


def _motion(numbers: Numbers) -> list[Shaping]:
    """Shaping filters that drive the motion beside the noise of the modes."""
    found = []
    if numbers.acceleration_std > 0.0:
        variance = numbers.acceleration_std**2
        found.append(Shaping(ON_ACCELERATION, 1.0 / numbers.acceleration_time, 0.0, variance))
    if numbers.yawing_period > 0.0:
        found.append(_yaw(numbers))
    return found


def _yaw(numbers: Numbers) -> Shaping:
    """Yaw about a mean course that follows it, ω̇ = −α2 ω − κ d + w2 and ḋ = ω − β d, as one complex process.

    The second-order shaping filter of waves (T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control,
    2nd ed., §10.2). Its poles and the stationary variance of the deviation d are those of the two equations; over
    longer times than a period, d is white noise, which the mean course follows (`_under_waves`).
    """
    decay, follows = numbers.course_rate_decay, 1.0 / numbers.yawing_time
    stiffness = (2.0 * math.pi / numbers.yawing_period) ** 2
    per_deviation = stiffness + (decay + follows) * follows
    variance = numbers.course_rate_noise / (2.0 * (stiffness * follows + decay * per_deviation))
    damping = 0.5 * (decay + follows)
    frequency = math.sqrt(max(stiffness + decay * follows - damping**2, 0.0))
    return Shaping(ON_COURSE, damping, frequency, variance)


def _errors(numbers: Numbers) -> list[Shaping]:
    """Shaping filters of the receiver's slow errors."""
    slow = (numbers.error_std, numbers.error_time), (numbers.drift_std, numbers.drift_time)
    return [Shaping(ON_FIX, 1.0 / time, 0.0, std**2) for std, time in slow if std > 0.0]


def _companions(numbers: Numbers, aid: tuple[str, ...]) -> list[Shaping]:
    """Shaping filters of the companions of the aids in use."""
    found = []
    for each in TABLE:
        if each.companion and each.name in aid:
            std, time = (getattr(numbers, key) for key in each.companion)
            if std > 0.0:
                found.append(Shaping(ON_AID, 1.0 / time, 0.0, std**2, each.name))
    return found


def _receiver(numbers: Numbers) -> np.ndarray:
    """(1,) RECEIVER, without poor fixes and steps."""
    receiver = np.zeros(1, RECEIVER)
    receiver["fix_variance"], receiver["time_variance"] = numbers.position_std**2, numbers.time_std**2
    receiver["outlier_rate"], receiver["poor_noise"] = numbers.outlier_rate, 1.0
    receiver["followed_after"] = FOLLOWED_AFTER
    return receiver
