"""Current, wind and waves: simple, repeatable models.

An `Environment` holds the parameters. Its `start` returns a `Sea`, which supplies the conditions (current and forces,
see `vessel`) and the wave motion of the antenna at every step. Directions are from true north: where current and waves
go to, and where the wind comes from.
"""

import math
from collections.abc import Iterator
from typing import Annotated

import numpy as np
from pydantic import Field

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.kinematics import GroundMotion, WaveMotion
from steerway.core.noise import Seed, markov_decay, markov_step, oscillator, oscillator_step
from steerway.core.settings import NotNegative, Number, Positive, Table
from steerway.vessels.vessel import FORCE_NORTH

AIR_DENSITY = 1.225
_BLOCK = 512  # steps drawn at once; the numbers do not depend on it
_DRAWS = 11


class Current(Table):
    """A current, with a Gauss–Markov variation."""

    speed: Annotated[float, Field(strict=True, ge=0.0, le=10.0), "m/s"] = 0.0
    """Mean speed of the current."""
    direction_deg: Number = 0.0
    """Direction to which the current flows, from true north."""
    std: Annotated[NotNegative, "m/s"] = 0.0
    """1σ per axis of the current's Gauss–Markov variation."""
    time_constant: Annotated[Positive, "s"] = 600.0
    """Time constant of the variation."""

    @property
    def velocity(self) -> tuple[float, float]:
        """North and east of the mean current, m/s."""
        return _towards(self.speed, self.direction_deg)


class Wind(Table):
    """Wind, with Gauss–Markov gusts. The relative wind V exerts the force ½ ρ A V|V|, A = `drag_area`."""

    speed: Annotated[float, Field(strict=True, ge=0.0, le=80.0), "m/s"] = 0.0
    """Mean true wind speed."""
    direction_deg: Number = 0.0
    """Direction from which the wind blows, from true north."""
    drag_area: Annotated[NotNegative, "m²"] = 0.0
    """Drag coefficient times projected area of the boat above water, the same from every side."""
    gust_std: Annotated[NotNegative, "m/s"] = 0.0
    """1σ per axis of the Gauss–Markov gusts."""
    gust_time: Annotated[Positive, "s"] = 10.0
    """Time constant of the gusts."""
    arm: Annotated[Number, "m"] = 0.0
    """Distance of the wind's point of attack ahead of the origin."""


class Waves(Table):
    """Wave motion along the direction of the waves, roll and pitch, and a slow drift force.

    Displacement, roll and pitch are independent oscillators with the damping ratio `damping`. Wave motion is added to
    the vessel's motion and does not affect it: Fossen (2021), section 10.2.
    """

    direction_deg: Number = 0.0
    """Direction to which the waves travel, from true north."""
    frequency: Annotated[Positive, "rad/s"] = 1.2
    """Peak frequency of the waves."""
    damping: Annotated[float, Field(strict=True, gt=0.0, lt=1.0), "1"] = 0.1
    """Damping ratio of the oscillators: the width of the spectrum."""
    displacement_std: Annotated[NotNegative, "m"] = 0.0
    """1σ of the horizontal wave motion."""
    roll_std_deg: NotNegative = 0.0
    """1σ of the roll angle."""
    pitch_std_deg: NotNegative = 0.0
    """1σ of the pitch angle."""
    drift: Annotated[Number, "N"] = 0.0
    """Mean wave-drift force along the direction of the waves."""
    drift_std: Annotated[NotNegative, "N"] = 0.0
    """1σ of the variation of the wave-drift force."""
    drift_time: Annotated[Positive, "s"] = 60.0
    """Time constant of the variation of the wave-drift force."""


class Environment(Table):
    """Current, wind, waves, and a constant force and moment with Gauss–Markov variations."""

    current: Current = Current()
    """Ocean current."""
    wind: Wind = Wind()
    """Wind and its gusts."""
    waves: Waves = Waves()
    """First-order wave motion and wave drift."""
    force: Annotated[tuple[Number, Number], "N"] = (0.0, 0.0)
    """Constant force on the boat, north and east."""
    moment: Annotated[Number, "N·m"] = 0.0
    """Constant yaw moment on the boat."""
    force_std: Annotated[tuple[NotNegative, NotNegative], "N"] = (0.0, 0.0)
    """1σ of the Gauss–Markov variation of the force, north and east."""
    moment_std: Annotated[NotNegative, "N·m"] = 0.0
    """1σ of the Gauss–Markov variation of the moment."""
    force_time: Annotated[Positive, "s"] = 50.0
    """Time constant of the variations of force and moment."""

    def start(self, seed: Seed, step: float) -> "Sea":
        """Start the environment, in steps of `step` s."""
        return Sea(self, seed, step)


class Sea:
    """A running environment: `conditions` (5,) and `waves` of the present step; `advance` computes the next."""

    def __init__(self, environment: Environment, seed: Seed, step: float) -> None:
        current, wind, waves = environment.current, environment.wind, environment.waves
        slow = [(current.std, current.time_constant)] * 2 + [(wind.gust_std, wind.gust_time)] * 2
        slow.append((waves.drift_std, waves.drift_time))
        swings = np.array([waves.displacement_std, *map(math.radians, (waves.roll_std_deg, waves.pitch_std_deg))])
        self._varies = any(std for std, _ in slow) or swings.any()
        self._met = wind.drag_area > 0.0
        self._draws = np.random.default_rng(seed)
        self._rows: Iterator[Floats] = iter(())
        self._decays = np.array([(markov_decay(constant, step), std) for std, constant in slow])
        self._wander = self._draws.standard_normal(5) * self._decays[:, 1]
        self._oscillator = oscillator(waves.frequency, waves.damping, step)
        self._swing_stds = swings
        self._swings = self._draws.standard_normal((3, 2)) * (1.0 / waves.frequency, 1.0)
        self._mean = np.array(
            [
                *current.velocity,
                *environment.force,
                environment.moment,
                *_towards(-wind.speed, wind.direction_deg),
                *_towards(1.0, waves.direction_deg),
                waves.drift,
                0.5 * AIR_DENSITY * wind.drag_area,
                wind.arm,
            ]
        )
        stds = *environment.force_std, environment.moment_std
        self._push = _Push(stds, environment.force_time, self._draws.spawn(1)[0], step) if any(stds) else None
        self._update(None)

    def advance(self, motion: GroundMotion | None = None) -> None:
        """Advance one step. `motion` of the vessel gives the relative wind; None: at rest, heading north."""
        if self._varies:
            _advance(self._wander, self._decays, self._swings, self._oscillator, self._next_row())
        if self._push is not None:
            self._push.advance()
        if self._varies or self._met or self._push is not None:
            self._update(motion)

    def _next_row(self) -> Floats:
        for row in self._rows:
            return row
        self._rows = iter(self._draws.standard_normal((_BLOCK, _DRAWS)))
        return next(self._rows)

    def _update(self, motion: GroundMotion | None) -> None:
        moving = (0.0, 0.0, 0.0) if motion is None else (motion.north_velocity, motion.east_velocity, motion.heading)
        self.conditions, waves = _conditions_and_waves(
            self._mean, self._wander, self._swings, self._swing_stds, *moving
        )
        if self._push is not None:
            self.conditions[FORCE_NORTH:] += self._push.force
        self.waves = WaveMotion(*waves)


class _Push:
    """The varying part (3,) of force and moment, from a random stream of its own."""

    def __init__(self, stds: tuple[float, ...], time: float, draws: np.random.Generator, step: float) -> None:
        self._draws, self._std = draws, np.array(stds)
        self._decay = markov_decay(time, step)
        self.force = self._std * draws.standard_normal(3)

    def advance(self) -> None:
        normals = self._draws.standard_normal(3)
        steps = zip(self.force.tolist(), self._std.tolist(), normals.tolist(), strict=True)
        self.force = np.array([markov_step(value, self._decay, std, normal) for value, std, normal in steps])


@kernel
def _advance(wander: Floats, decays: Floats, swings: Floats, model: Floats, normals: Floats) -> None:
    for i in range(5):
        wander[i] = markov_step(wander[i], decays[i, 0], decays[i, 1], normals[i])
    for i in range(3):
        k = 5 + 2 * i
        swings[i, 0], swings[i, 1] = oscillator_step(model, swings[i, 0], swings[i, 1], normals[k], normals[k + 1])


@kernel
def _conditions_and_waves(
    mean: Floats,
    wander: Floats,
    swings: Floats,
    stds: Floats,
    north_velocity: float,
    east_velocity: float,
    heading: float,
) -> tuple[Floats, tuple[float, float, float, float]]:
    wind_north = mean[5] + wander[2] - north_velocity
    wind_east = mean[6] + wander[3] - east_velocity
    push = mean[10] * math.hypot(wind_north, wind_east)
    drift = mean[9] + wander[4]
    conditions = np.empty(5)
    conditions[0] = mean[0] + wander[0]
    conditions[1] = mean[1] + wander[1]
    conditions[2] = mean[2] + push * wind_north + drift * mean[7]
    conditions[3] = mean[3] + push * wind_east + drift * mean[8]
    across = push * (wind_east * math.cos(heading) - wind_north * math.sin(heading))
    conditions[4] = mean[4] + mean[11] * across
    away = stds[0] * swings[0, 1]
    return conditions, (away * mean[7], away * mean[8], stds[1] * swings[1, 1], stds[2] * swings[2, 1])


def _towards(speed: float, direction_deg: float) -> tuple[float, float]:
    direction = math.radians(direction_deg)
    return speed * math.cos(direction), speed * math.sin(direction)
