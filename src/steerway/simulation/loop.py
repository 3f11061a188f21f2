"""The simulation loop: one fixed step for any vessel, environment, instruments and pilot.

The vessel integrates its equations of motion (RK4 or Euler) and the pilot runs its blocks; the loop keeps the time, the
state and the record.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.checks import positive
from steerway.core.errors import InputError
from steerway.core.estimate import Estimate, Measurements
from steerway.core.kinematics import GroundMotion, WaveMotion
from steerway.core.leg import LegState
from steerway.core.noise import Seed
from steerway.core.records import Rows, rows_of
from steerway.pilot import Orders
from steerway.vessels.environment import Environment
from steerway.vessels.vessel import Vessel

COLUMNS = (
    *(f"true_{name}" for name in GroundMotion._fields),
    *(f"read_{name}" for name in Measurements._fields),
    *(f"estimated_{name}" for name in Estimate._fields),
    *(f"leg_{name}" for name in LegState._fields),
    *("desired_angle", "desired_rate", "desired_acceleration"),
    *("reference_angle", "reference_rate", "reference_acceleration"),
    *("asked_speed", "force", "yaw", "mode", "by_course"),
    *("current_north", "current_east", "force_north", "force_east", "moment"),
)
"""The columns of a run beside time, commands and vessel state; SI, rad, NaN for unknown."""


class Instruments(Protocol):
    """Instruments that can be started: `sensors.suite.Suite`, `sensors.suite.Truth`."""

    def start(self, seed: Seed) -> "Switched": ...


class Switched(Protocol):
    """Started instruments."""

    def step(self, time: float, motion: GroundMotion, waves: WaveMotion) -> Measurements: ...


class Driven(Protocol):
    """The interface of a pilot: `pilot.Pilot`, `PositioningPilot`, `ManoeuvringPilot`."""

    @property
    def finished(self) -> bool: ...

    def step(self, measurements: Measurements, dt: float) -> Orders: ...


P = TypeVar("P", bound=Driven)


class Start(NamedTuple):
    """The initial state of a vessel: m, rad, m/s through the water (None: the vessel's own)."""

    north: float = 0.0
    east: float = 0.0
    heading: float = 0.0
    speed: float | None = None


@dataclass(frozen=True, eq=False)
class Run:
    """A simulated run. `run["true_north"]` is a column of COLUMNS, (n,); time (n,) s; command (n, actuators).

    Row k contains true motion, measurements and estimate at time k·step, and the command of the following step; state
    (n, states) is the vessel's.
    """

    time: np.ndarray
    values: np.ndarray
    command: np.ndarray
    state: np.ndarray

    def __len__(self) -> int:
        return len(self.time)

    def __getitem__(self, name: str) -> np.ndarray:
        return self.values[:, COLUMNS.index(name)]

    @property
    def true_sog(self) -> np.ndarray:
        """(n,) speed over ground, m/s."""
        return np.hypot(self["true_north_velocity"], self["true_east_velocity"])

    @property
    def true_cog(self) -> np.ndarray:
        """(n,) course over ground, rad in [−π, π]."""
        return np.arctan2(self["true_east_velocity"], self["true_north_velocity"])

    @property
    def true_cross_track(self) -> np.ndarray:
        """(n,) true cross-track error, m: the estimated one minus the position error across the leg."""
        north, east = (self[f"estimated_{axis}"] - self[f"true_{axis}"] for axis in ("north", "east"))
        direction = self["leg_direction"]
        return self["leg_cross_track"] - (east * np.cos(direction) - north * np.sin(direction))

    def rows(self, chosen: Rows) -> "Run":
        """The run restricted to the rows of a slice, mask or index array."""
        return Run(*(rows_of(each, chosen) for each in (self.time, self.values, self.command, self.state)))


def sail(
    vessel: Vessel,
    pilot: P,
    instruments: Instruments,
    duration: float,
    step: float,
    *,
    start: Start | tuple[float, ...] = Start(),  # noqa: B008
    environment: Environment = Environment(),  # noqa: B008
    seed: Seed = 0,
    until: Callable[[P], bool] = lambda pilot: pilot.finished,
    progress: Callable[[float], None] | None = None,
) -> Run:
    """Simulate `duration` s in steps of `step` s, or until `until(pilot)` is true; the same seed gives the same run.

    Environment and instruments have independent random streams. `progress` is called with the fraction done, 0 to 1.
    Raises InputError for a duration or step that is not positive, and when the vessel's state is no longer finite: the
    step is too long or the loop is unstable.
    """
    positive("duration", duration)
    positive("step", step)
    sea_seed, instrument_seed = np.random.default_rng(seed).spawn(2)
    sea, instruments_on = environment.start(sea_seed, step), instruments.start(instrument_seed)
    state = vessel.start(*(each for each in start if each is not None))
    rows, commands, states = [], [], []
    n = max(1, round(duration / step))
    report_every = max(1, n // 200)
    for k in range(n):
        motion = vessel.motion(state, sea.conditions)
        measurements = instruments_on.step(k * step, motion, sea.waves)
        orders = pilot.step(measurements, step)
        rows.append(_row(motion, measurements, orders, sea.conditions))
        commands.append(orders.command)
        states.append(state)
        if until(pilot):
            break
        state = vessel.step(state, orders.command, sea.conditions, step)
        sea.advance(motion)
        if not math.isfinite(state[0]):
            raise InputError(
                f"the vessel's state is not finite after {k * step:g} s, expected a smaller step than {step:g} s"
            )
        if progress and k % report_every == 0:
            progress(k / n)
    if progress:
        progress(1.0)
    return Run(np.arange(len(rows)) * step, np.array(rows), np.array(commands), np.array(states))


def _row(motion: GroundMotion, measurements: Measurements, orders: Orders, conditions: Floats) -> tuple[float, ...]:
    _, estimate, leg, desired, reference, *rest = orders
    return (*motion, *measurements, *estimate, *leg, *desired, *reference, *rest, *conditions.tolist())
