"""The record that every contender filters: a boat on a winding track, rows at 50 Hz, fixes at 5 Hz."""

from dataclasses import dataclass

import numpy as np

from steerway import Fixes, Profile
from steerway.core.earth import radii

STEP = 0.02
STEPS_A_FIX = 10
PROFILE = Profile(
    speed_noise=1e-2,
    course_rate_noise=1e-3,
    course_rate_decay=0.2,
    position_std=0.2,
    steerageway=1e-3,  # as in the paper's filter: no drift at the speeds of the record
    outlier_rate=0.0,  # every fix counts fully
)


@dataclass(frozen=True)
class Record:
    """Rows of one track; north and east (n,) are NaN where a row is no fix."""

    time: np.ndarray
    north: np.ndarray
    east: np.ndarray

    def __len__(self):
        return len(self.time)

    def positions(self, first: int, last: int) -> list[tuple[float, float]]:
        """Rows as pairs of floats for a loop, NaN where a row is no fix."""
        return list(zip(self.north[first:last].tolist(), self.east[first:last].tolist(), strict=True))


def winding(steps: int, seed: int = 0) -> Record:
    """A boat that turns to and fro at about 3 m/s; its fixes have noise of 0.15 m."""
    time = STEP * np.arange(steps)
    rng = np.random.default_rng(seed)
    phase = rng.uniform(0.0, 2.0 * np.pi)
    course = phase + np.cumsum(0.1 * np.sin(time / 20.0 + phase)) * STEP
    speed = 3.0 + 0.5 * np.sin(time / 31.0)
    noise = np.clip(0.15 * rng.standard_normal((2, steps)), -0.3, 0.3)
    north = np.cumsum(speed * np.cos(course)) * STEP + noise[0]
    east = np.cumsum(speed * np.sin(course)) * STEP + noise[1]
    between = np.arange(steps) % STEPS_A_FIX != 0
    north[between] = east[between] = np.nan
    return Record(time, north, east)


def fixes_of(record: Record) -> Fixes:
    """The record's fixes as `Fixes` at 59° N."""
    latitude, longitude = np.radians(59.0), np.radians(10.5)
    meridian, prime_vertical = radii(latitude)
    chosen = slice(0, None, STEPS_A_FIX)
    return Fixes(
        time=1.7e9 + record.time[chosen],
        latitude=latitude + record.north[chosen] / meridian,
        longitude=longitude + record.east[chosen] / (prime_vertical * np.cos(latitude)),
    )
