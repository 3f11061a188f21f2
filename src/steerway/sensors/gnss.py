"""Model of a GNSS receiver: position fixes from true motion, with realistic errors.

The error of a fix is white noise, plus Gauss–Markov errors (atmosphere, multipath), plus faults. The antenna has a
lever arm from the vessel's origin and moves with roll and pitch. A whole record (`Gnss.fixes`) and single steps in a
loop (`Gnss.start`) draw the same numbers in the same order: the same seed gives the same fixes.

Positions are north and east (m) in the scene's tangent plane. `earth.displaced` converts them to latitude and longitude
about `origin`. Its scale error N m north of the origin is N tan(latitude)/R: 0.02 % after 500 m at 63°, 0.4 % after 12
km. For a long scene put the origin on the equator, where the scale error vanishes.
"""

import math
from collections import deque
from typing import Annotated, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.earth import displaced_all
from steerway.core.noise import Seed
from steerway.core.records import Fixes
from steerway.core.settings import Flag, NotNegative, Positive, Rate, Table, Triple
from steerway.core.slow_error import ALONE, DIFFERENTIAL, FIXED, FLOAT, SLOW_STD
from steerway.sensors.gnss_errors import GOOD, LOST, Errors, Fault
from steerway.sensors.instrument import SLACK, Clock, epochs

_LEAST_WHITE = 0.01
"""Smallest 1σ (m) of white noise that a filter assumes: the noise of real-time kinematics."""
_NO_ERROR = 0.0, 60.0
_BLOCK = 128  # epochs drawn at once in a loop; the numbers do not depend on it


class Fix(NamedTuple):
    """One fix in the scene's plane: the time of its epoch (s), north and east (m), SOG (m/s) and COG (rad) or NaN."""

    time: float
    north: float
    east: float
    sog: float
    cog: float


class Gnss(Table):
    """Error model of a receiver. All 1σ are per axis, north and east. Raises InputError for numbers out of range."""

    rate: Annotated[Rate, "Hz"] = 5.0
    """Fixes per second."""
    white: Annotated[NotNegative, "m"] = 0.0
    """1σ per axis of the white noise of a fix."""
    markov: Annotated[tuple[tuple[NotNegative, Positive], ...], "m, s"] = ()
    """Gauss–Markov errors of position: 1σ per axis and time constant of each."""
    settled: Flag = True
    """Whether the Gauss–Markov errors start with their stationary variance; otherwise at 0, as in P1 (42)–(43)."""
    faults: tuple[Fault, ...] = ()
    """Faults of the receiver."""
    latency: Annotated[float, Field(strict=True, ge=0.0, le=60.0), "s"] = 0.0
    """Time from the epoch of a fix to its delivery."""
    stamped_on_arrival: Flag = False
    """Whether a fix is stamped with its delivery time in place of its epoch."""
    lever_arm: Annotated[Triple, "m"] = (0.0, 0.0, 0.0)
    """Position of the antenna from the vessel's origin: forward, starboard, down."""
    velocity_std: Annotated[NotNegative | None, "m/s"] = None
    """1σ per axis of the velocity that gives SOG and COG; without it the receiver reports neither."""

    @property
    def noise(self) -> dict[str, float]:
        """The errors as keys of a profile: `profile.model_copy(update=low_cost().noise)`.

        White noise of at least `_LEAST_WHITE`, and the two largest slow errors.
        """
        (first, first_time), (second, second_time) = sorted((*self.markov, _NO_ERROR, _NO_ERROR), reverse=True)[:2]
        return {
            "position_std": max(self.white, _LEAST_WHITE),
            "error_std": first,
            "error_time": first_time,
            "drift_std": second,
            "drift_time": second_time,
        }

    def start(self, seed: Seed) -> "GnssStream":
        """Start a stream of fixes, step by step."""
        return GnssStream(self, seed)

    def fixes(
        self,
        time: Floats,
        north: Floats,
        east: Floats,
        seed: Seed,
        *,
        roll: ArrayLike = 0.0,
        pitch: ArrayLike = 0.0,
        heading: ArrayLike = 0.0,
        north_velocity: ArrayLike = np.nan,
        east_velocity: ArrayLike = np.nan,
        origin: tuple[float, float] = (0.0, 0.0),
        source: str = "simulated GNSS",
    ) -> Fixes:
        """The fixes for a record of true motion, given as arrays (n,) or scalars in SI and radians.

        `time` rises and is sampled no slower than the receiver's rate; an epoch is the first sample at or after its due
        time. `origin` is the (latitude, longitude) of the scene's north = east = 0.
        """
        time = np.asarray(time, dtype=np.float64)
        columns = (time, north, east, roll, pitch, heading, north_velocity, east_velocity)
        motion = np.column_stack([np.broadcast_to(each, time.shape) for each in columns])[epochs(time, self.rate)]
        fixes = self.start(seed).observe(motion.astype(np.float64))
        time, north, east, sog, cog = fixes[np.isfinite(fixes[:, 0])].T
        latitude, longitude = displaced_all(*origin, north, east)
        if self.velocity_std is None:
            return Fixes(time, latitude, longitude, source=source)
        return Fixes(time, latitude, longitude, source=source, sog=sog, cog=cog)


class GnssTable(Gnss):
    """The receiver of a scenario; by default a low-cost one with errors of 1.5 m over 300 s and 0.25 m over 5 s."""

    white: Annotated[NotNegative, "m"] = 0.05
    markov: Annotated[tuple[tuple[NotNegative, Positive], ...], "m, s"] = ((1.5, 300.0), (0.25, 5.0))
    solution: Literal["single", "differential", "rtk-float", "rtk-fixed"] = "single"
    """Type of fix that the receiver reports; it sets the assumed σ of the slow position error."""

    @property
    def quality(self) -> int:
        """The fix quality indicator of GGA."""
        return {"single": ALONE, "differential": DIFFERENTIAL, "rtk-float": FLOAT, "rtk-fixed": FIXED}[self.solution]

    @property
    def slow_std(self) -> float:
        """1σ (m) of the slow error that is typical of this type of fix."""
        return float(SLOW_STD[self.quality])


def white(std: float, rate: float = 5.0) -> Gnss:
    """A receiver with independent errors only, which the papers assume and no real receiver has."""
    return Gnss(rate=rate, white=std)


def low_cost(rate: float = 5.0) -> Gnss:
    """A low-cost receiver (u-blox type): errors of 1.5 m over 300 s, 0.25 m over 5 s and 0.05 m white.

    Two such receivers, mounted together, drifted apart by 0.05 m in 1 s, 0.25 m in 10 s and 0.5–1 m in 60 s.
    """
    return Gnss(rate=rate, white=0.05, markov=((1.5, 300.0), (0.25, 5.0)))


def navstar(rate: float = 10.0) -> Gnss:
    """The receiver of P1 (40)–(43): one Gauss–Markov error of 4.7 m over 1100 s, starting at zero."""
    return Gnss(rate=rate, markov=((4.7, 1100.0),), settled=False)


class GnssStream:
    """A running receiver: pass the true motion at every step; the result is a fix when one is due, else None."""

    def __init__(self, gnss: Gnss, seed: Seed) -> None:
        self.gnss = gnss
        velocity_std = gnss.velocity_std or 0.0
        self._source = Errors(gnss.rate, gnss.white, velocity_std, gnss.markov, gnss.settled, gnss.faults, seed)
        self._errors, self._outcome = np.empty((0, 4)), np.empty(0, dtype=np.uint8)
        self._clock = Clock(gnss.rate)
        self._last = np.full(2, math.nan)
        forward, starboard, down = map(float, gnss.lever_arm)
        self._arm = forward, starboard, down
        self._delay = gnss.latency if gnss.stamped_on_arrival else 0.0
        self._under_way: deque[tuple[float, Fix]] = deque()

    def step(
        self,
        time: float,
        north: float,
        east: float,
        roll: float = 0.0,
        pitch: float = 0.0,
        heading: float = 0.0,
        north_velocity: float = math.nan,
        east_velocity: float = math.nan,
    ) -> Fix | None:
        """The oldest fix that is not delivered yet, if its latency has passed, else None. Scalars, SI and radians."""
        if self._clock.due(time):
            row = (time, north, east, roll, pitch, heading, north_velocity, east_velocity)
            observed = self.observe(np.array([row], dtype=np.float64))[0].tolist()
            fix = None if math.isnan(observed[0]) else Fix(*observed)
            if self.gnss.latency == 0.0:
                return fix
            if fix is not None:
                self._under_way.append((time + self.gnss.latency, fix))
        if self._under_way and time >= self._under_way[0][0] - SLACK / self.gnss.rate:
            return self._under_way.popleft()[1]
        return None

    def observe(self, motion: Floats) -> Floats:
        """Fixes (n, 5) of the next n epochs, NaN where lost, for the motion (n, 8), a row per call of `step`."""
        n = len(motion)
        if (missing := n - len(self._outcome)) > 0:
            errors, outcome = self._source.draw(max(missing, _BLOCK))
            self._errors = np.concatenate((self._errors, errors))
            self._outcome = np.concatenate((self._outcome, outcome))
        reports = self.gnss.velocity_std is not None
        fixes = _observed(motion, self._errors[:n], self._outcome[:n], self._last, self._arm, self._delay, reports)
        self._errors, self._outcome = self._errors[n:], self._outcome[n:]
        return fixes


@kernel
def _observed(
    motion: Floats,
    errors: Floats,
    outcome: NDArray[np.uint8],
    last: Floats,
    arm: tuple[float, float, float],
    delay: float,
    reports: bool,
) -> Floats:
    """See `GnssStream.observe`; `last` (2,) is the position reported last, NaN before the first."""
    fixes = np.full((len(motion), 5), math.nan)
    for k in range(len(motion)):
        if outcome[k] == LOST:
            continue
        if outcome[k] == GOOD or math.isnan(last[0]):
            north, east = motion[k, 1], motion[k, 2]
            if arm[0] != 0.0 or arm[1] != 0.0 or arm[2] != 0.0:
                arm_north, arm_east = level(arm[0], arm[1], arm[2], motion[k, 3], motion[k, 4], motion[k, 5])
                north, east = north + arm_north, east + arm_east
            last[0], last[1] = north + errors[k, 0], east + errors[k, 1]
        fixes[k, 0] = motion[k, 0] + delay
        fixes[k, 1], fixes[k, 2] = last[0], last[1]
        if reports:
            north, east = motion[k, 6] + errors[k, 2], motion[k, 7] + errors[k, 3]
            fixes[k, 3], fixes[k, 4] = math.hypot(north, east), math.atan2(east, north)
    return fixes


@kernel
def level(
    forward: float, starboard: float, down: float, roll: float, pitch: float, heading: float
) -> tuple[float, float]:
    """(north, east) of a point of the hull relative to the vessel's origin, m; angles in rad.

    The first two rows of the rotation from body to NED by roll, pitch and heading, Fossen, Handbook of Marine Craft
    Hydrodynamics and Motion Control, 2nd ed. (2021), section 2.2.
    """
    ahead = forward * math.cos(pitch) + (starboard * math.sin(roll) + down * math.cos(roll)) * math.sin(pitch)
    abeam = starboard * math.cos(roll) - down * math.sin(roll)
    c, s = math.cos(heading), math.sin(heading)
    return ahead * c - abeam * s, ahead * s + abeam * c
