"""Profiles: what a filter has to know of a vessel and its receiver, as named, validated numbers in a TOML file."""

import json
import math
from pathlib import Path
from typing import Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from steerway.core.errors import InputError
from steerway.core.toml import read_toml

GATE = 13.8
OUTLIER = 20.0
"""−2 log of the density of an outlier: one fix in a thousand is astray, by up to three metres. Of a vessel whose swings
are foretold the gate is centimetres wide; what is likelier than an outlier is then her, however rare of her."""
"""χ² with two degrees of freedom at 0.1 %."""
TELLING = 10.0
"""A log whose 95 % interval of a number is wider than this factor cannot tell it."""
_NOISES = "speed_noise", "course_rate_noise"
_LEAST_DECAY = 1e-3
_PATIENCE = 2.0
_START_SPEED_STD = 20.0
_LARGEST_START_RATE_STD = math.radians(20.0)

AIDS = ("sog", "cog", "heading", "water_speed", "yaw_rate")
"""What an estimate can be aided by, in the order of the kernels' aiding table."""

_LONG_HELD, _YOUNG_COURSE, _TURN = 1, 2, 3
_YOUNG = 0.8
"""Mean time for which a course just taken up counts as such, in mean turns: from 0.3 to 1 little changes."""
_SHORTEST_YAWING = 3.0
"""s: a shorter oscillation means nothing from steps of up to a second."""
_MANNER = ("speed_noise", "course_rate_noise", "course_rate_decay")

_positive = Field(gt=0.0, allow_inf_nan=False)
_not_negative = Field(ge=0.0, allow_inf_nan=False)


class Profile(BaseModel):
    """Tuning of the filter. Noise of motion is a spectral density: it does not depend on the filter's rate."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = "custom"
    description: str = ""

    speed_noise: float = _positive  # S_U, m²/s³
    course_rate_noise: float = _positive  # S_ω, rad²/s³
    speed_decay: float = Field(0.0, ge=0.0, allow_inf_nan=False)  # α1, 1/s
    course_rate_decay: float = Field(0.1, ge=0.0, allow_inf_nan=False)  # α2, 1/s
    acceleration_std: float = Field(0.0, ge=0.0, allow_inf_nan=False)  # m/s², acceleration that lasts; 0: none
    acceleration_time: float = Field(5.0, gt=0.0, allow_inf_nan=False)  # s, for how long
    yawing_period: float = Field(0.0, ge=0.0, allow_inf_nan=False)  # s, of swinging about a course held; 0: none
    yawing_time: float = Field(15.0, gt=0.0, allow_inf_nan=False)  # s in which the course held follows the vessel's
    steerageway: float = Field(0.3, gt=0.0, allow_inf_nan=False)  # m/s: below it course means nothing

    # A vessel that holds her course for a while, as above, and turns for a while, as below; with turn_time = 0 she
    # has one manner of moving, the one above.
    turn_time: float = Field(0.0, ge=0.0, allow_inf_nan=False)  # s, how long a turn lasts in the mean
    straight_time: float = Field(0.0, ge=0.0, allow_inf_nan=False)  # s, how long a course is held in the mean
    turn_speed_noise: float = Field(0.0, ge=0.0, allow_inf_nan=False)  # S_U in a turn, m²/s³
    turn_course_rate_noise: float = Field(0.0, ge=0.0, allow_inf_nan=False)  # S_ω in a turn, rad²/s³
    turn_course_rate_decay: float = Field(0.0, ge=0.0, allow_inf_nan=False)  # α2 in a turn, 1/s

    position_std: float = _positive  # white part of a fix, north and east, m
    time_std: float = Field(0.0, ge=0.0, allow_inf_nan=False)  # s, of the moment a fix claims
    error_std: float = Field(0.0, ge=0.0, allow_inf_nan=False)  # slowly varying part of a fix, m
    error_time: float = Field(60.0, gt=0.0, allow_inf_nan=False)  # its correlation time, s
    drift_std: float = Field(0.0, ge=0.0, allow_inf_nan=False)  # a second, slower one, m
    drift_time: float = Field(600.0, gt=0.0, allow_inf_nan=False)  # its correlation time, s

    sog_std: float = Field(0.1, gt=0.0, allow_inf_nan=False)  # m/s, receiver's own SOG
    velocity_std: float = Field(0.1, gt=0.0, allow_inf_nan=False)  # m/s across the course, receiver's own COG
    heading_std: float = Field(math.radians(1.0), gt=0.0, allow_inf_nan=False)  # rad
    crab_std: float = Field(math.radians(10.0), ge=0.0, allow_inf_nan=False)  # rad, crab angle and compass bias
    crab_time: float = Field(60.0, gt=0.0, allow_inf_nan=False)  # s
    water_speed_std: float = Field(0.1, gt=0.0, allow_inf_nan=False)  # m/s
    stream_std: float = Field(0.5, ge=0.0, allow_inf_nan=False)  # m/s, water's speed along the course, and log's bias
    stream_time: float = Field(300.0, gt=0.0, allow_inf_nan=False)  # s
    yaw_rate_std: float = Field(math.radians(0.2), gt=0.0, allow_inf_nan=False)  # rad/s
    gyro_bias_std: float = Field(math.radians(0.5), ge=0.0, allow_inf_nan=False)  # rad/s
    gyro_bias_time: float = Field(1000.0, gt=0.0, allow_inf_nan=False)  # s

    # What the log that it was tuned on says: 95 % intervals of the numbers above, by name.
    intervals: dict[str, tuple[float, float]] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _whole_turn(self) -> Self:
        given = {name: getattr(self, name) for name in ("straight_time", "turn_speed_noise", "turn_course_rate_noise")}
        if self.turn_time > 0.0 and not all(given.values()):
            missing = next(name for name, value in given.items() if not value)
            raise ValueError(f"turn_time is {self.turn_time}, which needs a positive {missing} too")
        return self

    @model_validator(mode="after")
    def _yawing(self) -> Self:
        if self.yawing_period > 0.0 and self.turn_time > 0.0:
            raise ValueError("yawing_period and turn_time are both given, expected one of them")
        if 0.0 < self.yawing_period < _SHORTEST_YAWING:
            raise ValueError(f"yawing_period is {self.yawing_period}, expected 0 or at least {_SHORTEST_YAWING} s")
        return self

    @classmethod
    def named(cls, name: str) -> Self:
        """A built-in profile. Raises InputError with the names there are."""
        if name not in BUILT_IN:
            raise InputError(f"profile {name!r} is unknown, expected one of {', '.join(BUILT_IN)} or a .toml file")
        return BUILT_IN[name]

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """A profile from a TOML file. Raises InputError naming the file and the key that is wrong."""
        try:
            return cls(**read_toml(path, "profile"))
        except ValidationError as error:
            first = error.errors()[0]
            key = ".".join(map(str, first["loc"]))
            raise InputError(f"profile {path}: {key} is {first['input']!r}, expected: {first['msg']}") from None

    def save(self, path: str | Path) -> None:
        """Write the profile as a TOML file that `load` reads."""
        Path(path).write_text(self.toml(), encoding="utf-8")

    def toml(self) -> str:
        """The text of such a file."""
        values = self.model_dump(exclude={"intervals"}).items()
        text = "".join(f"{key} = {_toml(value)}{self._comment(key)}\n" for key, value in values)
        if not self.intervals:
            return text
        ends = "".join(f"{name} = [{low!r}, {high!r}]\n" for name, (low, high) in self.intervals.items())
        return f"{text}\n[intervals]  # 95 %, from the log that it was tuned on\n{ends}"

    def _comment(self, name) -> str:
        if name not in self.intervals:
            return ""
        words = "" if self.told(name) else "this log cannot tell: "
        return "  # {}{:g} to {:g}".format(words, *self.intervals[name])

    def told(self, name: str) -> bool:
        """Whether the log that it was tuned on tells this number; True of one that was not fitted."""
        low, high = self.intervals.get(name, (1.0, 1.0))
        return high <= TELLING * low

    @property
    def turning(self) -> Self | None:
        """The vessel in a turn, as if she did nothing else; None for one that has one manner of moving."""
        if self.turn_time == 0.0:
            return None
        update = {name: getattr(self, f"turn_{name}") for name in _MANNER} | {"turn_time": 0.0}
        return self.model_copy(update=update)

    @property
    def agility(self) -> float:
        """Spectral density of the course-rate noise when she turns, rad²/s³: what a course can change by."""
        return self.turn_course_rate_noise if self.turn_time > 0.0 else self.course_rate_noise

    @property
    def on_average(self) -> Self:
        """The vessel with one manner of moving whose speed and course wander as far in the long run."""
        turning = self.turning
        if turning is None:
            return self
        share = self.turn_time / (self.turn_time + self.straight_time)

        def wander(profile):
            return profile.course_rate_noise / max(profile.course_rate_decay, _LEAST_DECAY) ** 2

        speed = share * turning.speed_noise + (1.0 - share) * self.speed_noise
        course = share * wander(turning) + (1.0 - share) * wander(self)
        decay = max(turning.course_rate_decay, _LEAST_DECAY)
        update = {"speed_noise": speed, "course_rate_noise": course * decay**2, "course_rate_decay": decay}
        return turning.model_copy(update=update)

    @property
    def start_rate_std(self) -> float:
        """Course rate of which a filter that knows none yet supposes the vessel capable, rad/s."""
        if self.yawing_period > 0.0:
            return min(math.sqrt(self._yawing_variances[0]), _LARGEST_START_RATE_STD)
        if self.course_rate_decay == 0.0:
            return _LARGEST_START_RATE_STD
        stationary = math.sqrt(self.course_rate_noise / (2.0 * self.course_rate_decay))
        return min(stationary, _LARGEST_START_RATE_STD)

    @property
    def _yawing_variances(self) -> tuple[float, float]:
        """Stationary variances of course rate and of the deviation from the course held (`estimation.yawing`)."""
        stiffness, follows, decay = self._yawing_stiffness, 1.0 / self.yawing_time, self.course_rate_decay
        of_rate = stiffness + (decay + follows) * follows
        deviation = self.course_rate_noise / (2.0 * (stiffness * follows + decay * of_rate))
        return of_rate * deviation, deviation

    @property
    def _yawing_stiffness(self) -> float:
        return (2.0 * math.pi / self.yawing_period) ** 2

    def model(self, aids: tuple[str, ...] = ()) -> np.ndarray:
        """The kernels' parameter vector (see `steerway.estimation.course.model`), with the states that these aids need.

        A vessel that holds her course and turns by turns has several, (1 + modes, m): for her while her manner is
        unknown or she has no way, on a course long held, on one just taken up, and in a turn (see
        `steerway.estimation.course.mixture`).
        """
        turning = self.turning
        if turning is None:
            return self._vector(aids)
        ends, begins = 1.0 / self.turn_time, 1.0 / self.straight_time
        turn_share = begins / (begins + ends)
        young = _YOUNG * self.turn_time
        restless = {name: max(getattr(self, name), getattr(turning, name)) for name in _NOISES}
        rows = (
            turning.model_copy(update=restless)._vector(aids),
            self._vector(aids, starts_in=1.0 - turn_share, leaving=begins, switches_to=_TURN),
            self._vector(aids, leaving=begins, switches_to=_TURN, ageing=1.0 / young, ages_to=_LONG_HELD),
            turning._vector(aids, starts_in=turn_share, leaving=ends, switches_to=_YOUNG_COURSE),
        )
        return np.stack(rows)

    def manners(self) -> np.ndarray:
        """(2, m): the parameter vectors of a straight course and of a turn, with the rates (1/s) at which they end."""
        straight = self._vector((), leaving=1.0 / self.straight_time)
        return np.stack([straight, self.turning._vector((), leaving=1.0 / self.turn_time)])

    def _vector(self, aids, starts_in=0.0, leaving=0.0, switches_to=0, ages_to=0, ageing=0.0) -> np.ndarray:
        extras = []

        def extra(std, time):
            extras.append((1.0 / time, 2.0 * std**2 / time, std**2))
            return 4 + len(extras)

        slow = [(self.error_std, self.error_time), (self.drift_std, self.drift_time)]
        slow = [(std, time) for std, time in slow if std > 0.0]
        error = 5 if slow else 0
        for std, time in slow:
            extra(std, time)
            extra(std, time)
        crab = extra(self.crab_std, self.crab_time) if "heading" in aids and self.crab_std > 0.0 else 0
        gyro = extra(self.gyro_bias_std, self.gyro_bias_time) if "yaw_rate" in aids and self.gyro_bias_std > 0.0 else 0
        stream = extra(self.stream_std, self.stream_time) if "water_speed" in aids and self.stream_std > 0.0 else 0
        lasting = extra(self.acceleration_std, self.acceleration_time) if self.acceleration_std > 0.0 else 0
        yawing, steered_back = 0, (0.0, 0.0)
        if self.yawing_period > 0.0:
            extras.append((0.0, 0.0, self._yawing_variances[1]))
            yawing, steered_back = 4 + len(extras), (self._yawing_stiffness, 1.0 / self.yawing_time)
        head = (
            self.speed_noise,
            self.course_rate_noise,
            self.speed_decay,
            self.course_rate_decay,
            self.position_std**2,
            self.steerageway,
            self.time_std**2,
            _START_SPEED_STD**2,
            self.start_rate_std**2,
            GATE,
            OUTLIER if self.yawing_period > 0.0 else -math.inf,
            _PATIENCE,
            self.sog_std**2,
            self.velocity_std**2,
            self.heading_std**2,
            self.water_speed_std**2,
            self.yaw_rate_std**2,
            error,
            len(slow),
            crab,
            gyro,
            stream,
            lasting,
            yawing,
            *steered_back,
            starts_in,
            leaving,
            switches_to,
            ageing,
            ages_to,
        )
        return np.array([*head, *np.ravel(extras)], dtype=np.float64)


def _toml(value) -> str:
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(float(value))


BUILT_IN = {
    profile.name: profile
    for profile in (
        # Otter and Mariner: the process noise of P0 §6–7 as a spectral density, S = h Q_d, scaled to R in metres.
        Profile(
            name="otter",
            description="Otter USV, 2 m, up to 2 m/s",
            speed_noise=1e-2,
            course_rate_noise=1e-2,
            course_rate_decay=0.1,
            position_std=0.5,
        ),
        Profile(
            name="mariner-usv",
            description="Mariner USV, 6 m, up to 12 m/s",
            speed_noise=2e-2,
            course_rate_noise=2e-5,
            course_rate_decay=0.1,
            position_std=0.5,
        ),
        Profile(
            name="small-usv",
            description="small craft of any kind",
            speed_noise=5e-3,
            course_rate_noise=1e-3,
            course_rate_decay=0.2,
            position_std=0.15,
        ),
        Profile(
            name="sailing-yacht",
            description="sailing yacht or motor boat in a seaway",
            speed_noise=2e-2,
            course_rate_noise=2e-2,
            course_rate_decay=2.0,
            position_std=0.05,
            error_std=0.3,
            error_time=10.0,
        ),
        Profile(
            name="swell",
            description="any vessel whose speed and course a swell moves",
            speed_noise=1e-4,
            course_rate_noise=1e-3,
            course_rate_decay=0.5,
            acceleration_std=0.25,
            position_std=0.05,
        ),
        Profile(
            name="ship",
            description="ship of 50 m and more",
            speed_noise=2e-3,
            course_rate_noise=1e-6,
            course_rate_decay=0.05,
            position_std=0.5,
        ),
        Profile(
            name="ais",
            description="vessels as AIS reports them: seconds to minutes apart, times rounded and late",
            speed_noise=5e-3,
            course_rate_noise=1.5e-4,
            course_rate_decay=0.3,
            acceleration_std=0.07,
            acceleration_time=15.0,
            position_std=3.0,
            time_std=1.0,
            sog_std=0.2,
            velocity_std=0.2,
            steerageway=0.5,
        ),
    )
}
"""Profiles that come with the package, by name."""
