"""Profiles: the vessel and its receiver as named, validated numbers in a TOML file."""

from abc import abstractmethod
from pathlib import Path
from typing import ClassVar, Self

from pydantic import BaseModel, Field, model_validator

from steerway.core.errors import InputError
from steerway.core.files import complete_or_absent
from steerway.core.settings import Table, positive_number, read_toml, toml_value
from steerway.estimation.vessel.aids import AidNoise
from steerway.estimation.vessel.flat import WeighedModel, model_of_profile
from steerway.estimation.vessel.presets import PRESETS

SHORTEST_PERIOD = 3.0
"""Shortest period (s) of wave-induced yaw: the longest step of a prediction. Faster yaw is noise of the course."""
_LEAST_DECAY = 1e-3
"""Least decay (1/s) of the course rate in the long run: with less, a course rate outlasts every forecast."""
_OF_A_MODE = ("speed_noise", "course_rate_noise", "course_rate_decay")


class MotionNoise(BaseModel):
    """How a vessel moves. Noise is a spectral density: it does not depend on the filter's rate.

    With `turn_time` there are two modes, a course held and a turn; without it one.
    """

    speed_noise: float = positive_number(unit="m²/s³", what="spectral density S_U of speed noise")
    course_rate_noise: float = positive_number(unit="rad²/s³", what="spectral density S_ω of course-rate noise")
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

    position_std: float = positive_number(most=1e4, unit="m", what="1σ of the white noise of a fix")
    time_std: float = positive_number(0.0, or_zero=True, unit="s", what="1σ of a fix's time stamp", most=60.0)
    error_std: float = positive_number(0.0, or_zero=True, unit="m", what="1σ of the slow error of the receiver")
    error_time: float = positive_number(60.0, unit="s", what="correlation time of the slow error")
    drift_std: float = positive_number(0.0, or_zero=True, unit="m", what="1σ of the slower error of the receiver")
    drift_time: float = positive_number(600.0, unit="s", what="correlation time of the slower error")
    # By default the median of its prior for a log of unknown origin.
    outlier_rate: float = positive_number(1e-3, or_zero=True, most=0.5, unit="1", what="share of outliers among fixes")


class ProfileFile(Table):
    """Base of both kinds of profile: a name, and a TOML file."""

    name: str = "custom"
    description: str = ""

    @abstractmethod
    def toml(self) -> str:
        """The profile as the text of a TOML file."""

    def save(self, path: str | Path) -> None:
        """Write the profile as a TOML file that `load` reads."""
        with complete_or_absent(path) as file:
            file.write(self.toml().encode())


class Profile(AidNoise, ReceiverErrors, MotionNoise, ProfileFile):
    """The parameters of the filter for a vessel and its receiver."""

    intervals: dict[str, tuple[float, float]] = Field(default_factory=dict)
    """95 % intervals by name, in files of earlier versions."""

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

    recognises: ClassVar[bool] = False
    """Whether a record is searched for copies of fixes and the like: with given numbers every fix counts as it is."""

    @classmethod
    def named(cls, name: str) -> "Profile":
        """A built-in profile. Raises InputError, with the built-in names, for another one."""
        if name not in BUILT_IN:
            raise InputError(f"profile {name!r} is unknown, expected one of {', '.join(BUILT_IN)} or a .toml file")
        return BUILT_IN[name]

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """A profile from a TOML file. Raises InputError naming the file and the key that is wrong."""
        table = read_toml(path, "profile")
        if "structures" in table:
            raise InputError(f"profile {path} has structures, expected one of the five-state filter")
        return cls.made_of(table, f"profile {path}")

    def toml(self) -> str:
        values = self.model_dump(exclude={"intervals"}).items()
        text = "".join(f"{key} = {toml_value(value)}\n" for key, value in values)
        if not self.intervals:
            return text
        ends = "".join(f"{name} = [{low!r}, {high!r}]\n" for name, (low, high) in self.intervals.items())
        return f"{text}\n[intervals]  # 95 %, from the log that it was tuned on\n{ends}"

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

        def dispersion(profile: Profile) -> float:
            return profile.course_rate_noise / max(profile.course_rate_decay, _LEAST_DECAY) ** 2

        speed = share * turning.speed_noise + (1.0 - share) * self.speed_noise
        course = share * dispersion(turning) + (1.0 - share) * dispersion(self)
        decay = max(turning.course_rate_decay, _LEAST_DECAY)
        update = {"speed_noise": speed, "course_rate_noise": course * decay**2, "course_rate_decay": decay}
        return turning.model_copy(update=update)

    def models(self, aid: tuple[str, ...] = (), smoothed: bool = False) -> tuple[WeighedModel, ...]:
        """The model that filters (or smoothers) run, with the states that these aids need; its weight is 1."""
        return (WeighedModel(1.0, model_of_profile(self, aid, smoothed)),)


BUILT_IN = {profile.name: profile for profile in map(Profile.model_validate, PRESETS)}
"""The built-in profiles by name."""
