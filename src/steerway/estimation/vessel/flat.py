"""The model of a `Profile`, which has one structure.

Its vessel has one mode, in which white noise drives speed and course rate. With `turn_time` it has more: a course held
for long, a course just taken up, and a turn. Persistent acceleration and yaw in waves are shaping filters.
"""

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from steerway.core.arrays import Floats
from steerway.estimation.filter.bank import LEAST_SHARE
from steerway.estimation.filter.model import MODE, ON_ACCELERATION, ON_AID, ON_COURSE, ON_FIX, RECEIVER, Model
from steerway.estimation.vessel.aids import TABLE
from steerway.estimation.vessel.structures import Shaping, assembled

if TYPE_CHECKING:
    from steerway.estimation.vessel.profile import Profile

FOLLOWED_AFTER = 2.0
"""Time, s, for which fixes that agree on another place are rejected: a jump of one second is no step of the
receiver."""
_LARGEST_START_RATE = math.radians(20.0)
"""Largest 1σ (rad/s) of the course rate at the start: a small craft in a hard turn."""
_AGES, _AGES_SMOOTHED = (0.8,), (0.8, 0.3, 0.1)
"""Mean durations, in mean turns, of the modes of a course just taken up, the youngest last. A course just taken up is
uncertain; in one mode with courses held for long, it would keep them uncertain too. The duration is about one turn, in
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


def model_of_profile(profile: "Profile", aid: tuple[str, ...] = (), smoothed: bool = False) -> Model:
    """The model of a profile (`Profile`), with the states that these aids need; `smoothed`: for a smoother."""
    shapings = [*_motion(profile), *_errors(profile), *_companions(profile, aid)]
    variances = {each.name: getattr(profile, each.noise) ** 2 for each in TABLE if each.name in aid}
    return assembled(*_modes(profile, smoothed), shapings, _receiver(profile), variances)


def _modes(profile: "Profile", smoothed: bool) -> tuple[np.ndarray, Floats]:
    """(m,) MODE of one mode, or of a held course, younger courses and a turn; (m, m) rates of change between them."""
    if profile.turning is None:
        return _mode(profile, 1.0), np.zeros((1, 1))
    ages = _AGES_SMOOTHED if smoothed else _AGES
    ends, begins, turn = 1.0 / profile.turn_time, 1.0 / profile.straight_time, len(ages) + 1
    turn_share = begins / (begins + ends)
    generator = np.zeros((turn + 1, turn + 1))
    generator[:turn, turn], generator[turn, turn - 1] = begins, ends
    for k, age in enumerate(ages):
        generator[k + 1, k] = ends / age
    np.fill_diagonal(generator, -generator.sum(axis=1))
    held = [_mode(profile, 1.0 - turn_share), *[_mode(profile, 0.0) for _ in ages]]
    modes = np.concatenate([*held, _mode(profile.turning, turn_share)])
    if smoothed:
        modes["least_share"] = _LEAST_SHARE_SMOOTHED
    return modes, generator


def _mode(profile: "Profile", start: float) -> np.ndarray:
    """(1,) MODE of a profile of one mode; start: the probability of the mode at the start."""
    mode, noise, decay = np.zeros(1, MODE), profile.course_rate_noise, profile.course_rate_decay
    if profile.yawing_period > 0.0:
        noise, decay = _under_waves(profile)
    mode["speed_noise"], mode["speed_decay"] = profile.speed_noise, profile.speed_decay
    mode["rate_noise"], mode["rate_decay"] = noise, decay
    mode["start"], mode["start_rate"] = start, start_rate_std(noise, decay) ** 2
    mode["least_share"] = LEAST_SHARE
    mode["drift_speed"] = profile.steerageway  # with a tenth of it SOG of a boat that stops and goes is 10 % worse
    return mode


def start_rate_std(noise: float, decay: float) -> float:
    """Standard deviation (rad/s) of the course rate at the start: the stationary one, at most 20 °/s."""
    return min(math.sqrt(0.5 * noise / decay), _LARGEST_START_RATE) if decay > 0.0 else _LARGEST_START_RATE


def _under_waves(profile: "Profile") -> tuple[float, float]:
    """Noise and decay of the mean course's rate, for a vessel that yaws in waves; see `_yaw`."""
    decay, follows = profile.course_rate_decay, 1.0 / profile.yawing_time
    stiffness = (2.0 * math.pi / profile.yawing_period) ** 2
    share = follows * (decay + follows) / (stiffness + decay * follows)
    return profile.course_rate_noise * share**2, decay + follows


def _motion(profile: "Profile") -> list[Shaping]:
    """Shaping filters that drive the motion beside the noise of the modes."""
    found = []
    if profile.acceleration_std > 0.0:
        variance = profile.acceleration_std**2
        found.append(Shaping(ON_ACCELERATION, 1.0 / profile.acceleration_time, 0.0, variance))
    if profile.yawing_period > 0.0:
        found.append(_yaw(profile))
    return found


def _yaw(profile: "Profile") -> Shaping:
    """Yaw about a mean course that follows it, ω̇ = −α2 ω − κ d + w2 and ḋ = ω − β d, as one complex process.

    The second-order shaping filter of waves (T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control,
    2nd ed., §10.2). Its poles and the stationary variance of the deviation d are those of the two equations; over more
    than a period d is white noise, which the mean course follows (`_under_waves`).
    """
    decay, follows = profile.course_rate_decay, 1.0 / profile.yawing_time
    stiffness = (2.0 * math.pi / profile.yawing_period) ** 2
    per_deviation = stiffness + (decay + follows) * follows
    variance = profile.course_rate_noise / (2.0 * (stiffness * follows + decay * per_deviation))
    damping = 0.5 * (decay + follows)
    frequency = math.sqrt(max(stiffness + decay * follows - damping**2, 0.0))
    return Shaping(ON_COURSE, damping, frequency, variance)


def _errors(profile: "Profile") -> list[Shaping]:
    """Shaping filters of the receiver's slow errors."""
    slow = (profile.error_std, profile.error_time), (profile.drift_std, profile.drift_time)
    return [Shaping(ON_FIX, 1.0 / time, 0.0, std**2) for std, time in slow if std > 0.0]


def _companions(profile: "Profile", aid: tuple[str, ...]) -> list[Shaping]:
    """Shaping filters of the companions of the aids in use."""
    found = []
    for each in TABLE:
        if each.companion and each.name in aid:
            std, time = (getattr(profile, key) for key in each.companion)
            if std > 0.0:
                found.append(Shaping(ON_AID, 1.0 / time, 0.0, std**2, each.name))
    return found


def _receiver(profile: "Profile") -> np.ndarray:
    """(1,) RECEIVER, without poor fixes and steps."""
    receiver = np.zeros(1, RECEIVER)
    receiver["fix_variance"], receiver["time_variance"] = profile.position_std**2, profile.time_std**2
    receiver["outlier_rate"], receiver["poor_noise"] = profile.outlier_rate, 1.0
    receiver["followed_after"] = FOLLOWED_AFTER
    return receiver
