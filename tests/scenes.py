"""Generated sorties for tests: true motion, and fixes of it with white noise; a log and what is inferred from it."""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from steerway.core import Fixes, radii, wrap_array
from steerway.core.testing import displaced
from steerway.estimation import Profile
from steerway.estimation.testing import (
    LogEstimator,
    Structure,
    advance,
    bank_start,
    medians_of,
    model_empty_bank,
    model_of,
    take_fix,
)
from steerway.sensors import TRUE_TCM2, DynamicCompass
from steerway.vessels import RPM, Springer, conditions

EPOCH = 1_700_000_000.0
HOME = (math.radians(63.43), math.radians(10.40))


@dataclass(frozen=True)
class Scene:
    """True motion at the times of the fixes: s, m, m/s and rad; north and east around `home`."""

    time: np.ndarray
    north: np.ndarray
    east: np.ndarray
    sog: np.ndarray
    cog: np.ndarray
    home: tuple[float, float] = HOME

    def fixes(self, std: float, seed: int, disturbance=None) -> Fixes:
        """Fixes with white noise (m); `disturbance(time) -> (north, east)` in m is laid on top."""
        noise = np.random.default_rng(seed).normal(0.0, std, (2, len(self.time)))
        north, east = self.north + noise[0], self.east + noise[1]
        if disturbance is not None:
            further = disturbance(self.time - self.time[0])
            north, east = north + further[0], east + further[1]
        return Fixes(self.time, *self._placed(north, east))

    def place(self, k: int) -> tuple[float, float]:
        """True latitude and longitude (rad) at row k."""
        return self._place(self.north[k], self.east[k])

    def _placed(self, north, east):
        places = np.array([self._place(n, e) for n, e in zip(north, east, strict=True)])
        return places[:, 0], places[:, 1]

    def _place(self, north, east):
        """Along the meridian (by its radius half-way), then along the parallel: good at any latitude."""
        latitude = self.home[0]
        for _ in range(2):
            latitude = self.home[0] + north / radii(0.5 * (self.home[0] + latitude))[0]
        return latitude, displaced(latitude, self.home[1], 0.0, east)[1]


def sailed(sog, cog, rate=5.0, home=HOME) -> Scene:
    """The scene of a speed and a course given at every fix (n,), at `rate` fixes a second."""
    sog, cog = np.broadcast_arrays(np.asarray(sog, float), np.asarray(cog, float))
    dt = 1.0 / rate
    middle = cog[:-1] + 0.5 * np.diff(cog)
    step = 0.5 * (sog[:-1] + sog[1:]) * dt * np.sinc(np.diff(cog) / (2.0 * math.pi))
    north = np.r_[0.0, np.cumsum(step * np.cos(middle))]
    east = np.r_[0.0, np.cumsum(step * np.sin(middle))]
    return Scene(EPOCH + dt * np.arange(len(sog)), north, east, sog.copy(), cog.copy(), home)


def straight(speed, course, duration, rate=5.0, home=HOME) -> Scene:
    """A straight run at constant speed (m/s) and course (rad) for a duration (s)."""
    n = round(duration * rate) + 1
    return sailed(np.full(n, speed), np.full(n, course), rate, home)


def thinned(scene, every) -> Scene:
    """A finely sailed scene, of which every so manieth row is seen."""
    return Scene(*(getattr(scene, name)[::every] for name in ("time", "north", "east", "sog", "cog")), scene.home)


def turning(speed, start, duration, rate=5.0, seed=0, decay=0.3, density=2e-3, home=HOME) -> Scene:
    """A wandering course: the course rate is Gauss–Markov as in P0 (15), rad, 1/s and rad²/s³."""
    n = round(duration * rate) + 1
    left = math.exp(-decay / rate)
    spread = math.sqrt(density / (2.0 * decay))
    kicks = np.random.default_rng([seed, 1]).normal(0.0, spread * math.sqrt(1.0 - left**2), n)
    turn_rate = np.zeros(n)
    for k in range(1, n):
        turn_rate[k] = left * turn_rate[k - 1] + kicks[k]
    return sailed(np.full(n, speed), start + np.cumsum(turn_rate) / rate, rate, home)


def angle_error(estimated, true) -> np.ndarray:
    """Absolute smallest difference, rad."""
    return np.abs(wrap_array(np.asarray(estimated) - true))


def binary_sequence(n, hold, size, rng):
    """(n,) ± size, changed at random every `hold` rows: a manoeuvre to identify from."""
    return size * np.repeat(rng.choice((-1.0, 1.0), -(-n // hold)), hold)[:n]


def usual_profile(*parts, **numbers) -> Profile:
    """A profile of one structure with the prior medians, but for these numbers."""
    return Profile.of([Structure(weight=1.0, parts=parts, values=medians_of(parts) | numbers)])


def banked(parts, places, quantum=(0.0, 0.0), **numbers):
    """(Model of these parts, its bank after fixes at these places (m), one a second, and a second more)."""
    model = model_of(parts, medians_of(parts) | numbers, quantum)
    bank = model_empty_bank(model)
    bank_start(bank, model, 0.0, 0.0)
    for place in places:
        advance(bank, model, 1.0)
        take_fix(bank, model, *place, 1.0)
    advance(bank, model, 1.0)
    return model, bank


STD = 0.4


@cache
def small_craft():
    """A boat of 1.5 m/s that wanders, 5 Hz: the scene, its fixes (STD m of noise), and the estimator of the log."""
    scene = turning(1.5, 0.7, 200.0, seed=1)
    fixes = scene.fixes(STD, 1)
    return scene, fixes, LogEstimator(fixes)


def record(
    seconds=60, compass=TRUE_TCM2, plant="paper", current=(0.0, 0.15), seed=0, heading=0.0, card=(0.0,) * 5, **vessel
):
    """(propeller speed differences, compass readings, headings, velocities) of a weaving Springer, one per second."""
    rng = np.random.default_rng(seed)
    boat, stream = Springer(plant, **vessel), DynamicCompass(compass, card).start(heading, rng)
    state, around, rows = boat.start(heading=heading), conditions(current), []
    for k in range(seconds):
        difference = 60.0 * RPM * math.sin(k / 15.0)
        motion = boat.motion(state, around)
        velocity = (
            motion.north_velocity + 0.1 * rng.standard_normal(),
            motion.east_velocity + 0.1 * rng.standard_normal(),
        )
        rows.append((difference, stream.second(boat.heading(state)), boat.heading(state), velocity))
        state = boat.step(state, (difference,), around, 1.0)
    return tuple(zip(*rows, strict=True))
