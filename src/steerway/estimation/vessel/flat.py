"""A profile of single numbers as the model of one structure.

Its vessel has one mode, in which speed and course rate are driven by white noise, or with `turn_time` three: a course
long held, one just taken up, and a turn. Acceleration that persists and yaw in waves are shaping filters.
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
"""s for which fixes elsewhere that agree are refused. Chosen: a jump of a second is no step of the receiver."""
_LARGEST_START_RATE = math.radians(20.0)
"""rad/s of course rate at the start: a small craft in a hard turn; a stationary value may be infinite. Chosen."""
_AGES, _AGES_SMOOTHED = (0.8,), (0.8, 0.3, 0.1)
"""Mean times, in mean turns, for which a course counts as of each age before it is long held, the youngest last. The
filter of a course just taken up is uncertain of it; as one mode with that of a course long held it would keep widening
that. Chosen: about one turn, in which what is left of it dies away. A smoother knows the course from both sides, so
that more is lost in a mean of ages: with one age as here its courses held are off by 14 % more (2.5 m) and 4 % (0.5 m);
with ages of turns as well nothing is better. `steerway study estimator-limits` judges them."""
_LEAST_SHARE_SMOOTHED = 0.3
"""In place of `bank.LEAST_SHARE`. Chosen with the ages: with 0.001 courses held are off by 20 % more (2.5 m)
and 10 % (0.5 m)."""


class WeighedModel(NamedTuple):
    """A model and how much it counts."""

    weight: float
    model: Model


def model_of_profile(profile: "Profile", aid: tuple[str, ...] = (), smoothed: bool = False) -> Model:
    """The model of a profile (`Profile`), with the states that these aids need; `smoothed`: for a smoother."""
    shapings = [*_motion(profile), *_errors(profile), *_companions(profile, aid)]
    variances = {each.name: getattr(profile, each.noise) ** 2 for each in TABLE if each.name in aid}
    return assembled(*_modes(profile, smoothed), shapings, _receiver(profile), variances)


def _modes(profile: "Profile", smoothed: bool) -> tuple[np.ndarray, Floats]:
    """MODE of the only mode, or of a course long held, of younger ones and of a turn; and the rates of change."""
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
    """(1,) MODE of a profile of one mode."""
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
    """Standard deviation of the course rate at the start, rad/s: the stationary one, within limits."""
    return min(math.sqrt(0.5 * noise / decay), _LARGEST_START_RATE) if decay > 0.0 else _LARGEST_START_RATE


def _under_waves(profile: "Profile") -> tuple[float, float]:
    """Noise and decay of the rate of the mean course, of a vessel that waves make yaw; see `_yaw`."""
    decay, follows = profile.course_rate_decay, 1.0 / profile.yawing_time
    stiffness = (2.0 * math.pi / profile.yawing_period) ** 2
    share = follows * (decay + follows) / (stiffness + decay * follows)
    return profile.course_rate_noise * share**2, decay + follows


def _motion(profile: "Profile") -> list[Shaping]:
    """What drives the motion beside the noise of the modes."""
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
    """Slow errors of the receiver."""
    slow = (profile.error_std, profile.error_time), (profile.drift_std, profile.drift_time)
    return [Shaping(ON_FIX, 1.0 / time, 0.0, std**2) for std, time in slow if std > 0.0]


def _companions(profile: "Profile", aid: tuple[str, ...]) -> list[Shaping]:
    """Slow errors of the aids in use."""
    found = []
    for each in TABLE:
        if each.companion and each.name in aid:
            std, time = (getattr(profile, key) for key in each.companion)
            if std > 0.0:
                found.append(Shaping(ON_AID, 1.0 / time, 0.0, std**2, each.name))
    return found


def _receiver(profile: "Profile") -> np.ndarray:
    """(1,) RECEIVER: no poor fixes, and no steps."""
    receiver = np.zeros(1, RECEIVER)
    receiver["fix_variance"], receiver["time_variance"] = profile.position_std**2, profile.time_std**2
    receiver["outlier_rate"], receiver["poor_noise"] = profile.outlier_rate, 1.0
    receiver["followed_after"] = FOLLOWED_AFTER
    return receiver
