"""A Kalman filter of a vessel whose actuator forces are known: position, heading and velocity from fixes.

The filter of P2 §II in the form of its errata, extended by the environment's force, waves, a gate, adaptive measurement
noise and a smoother (`vessel_smoother`). With 6 states it is P2's, with 9 the force is estimated, with 13 the
waves too.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.checks import array_of, not_negative, positive
from steerway.core.compiled import kernel, lean_kernel
from steerway.core.errors import InputError
from steerway.core.kalman import Fix, correct, correct_scalar, innovation, normalised_square, place_by_fix
from steerway.core.linear_algebra import symmetric
from steerway.core.statistics import FIX_GATE
from steerway.estimation.positioning.low_speed import (
    BODY,
    HEADING,
    WAVE,
    WITH_FORCE,
    WITH_WAVES,
    advance_mean,
    pack,
    spread,
    transition,
)

PATIENCE = 5
"""Number of fixes rejected in a row after which the position is reset to the fix."""


class VesselMotion(NamedTuple):
    """Output of an observer: position, heading, velocity (surge, sway, yaw rate), external force (north, east, yaw)."""

    north: float
    east: float
    heading: float
    velocity: tuple[float, float, float]
    force: tuple[float, float, float]


class Observer(Protocol):
    """The interface of every filter and observer of vessel motion that closes a positioning loop."""

    def start(self, north: float, east: float, heading: float) -> None:
        """Begin at rest at a place."""

    def predict(self, force: Floats, dt: float) -> None:
        """Predict by dt s under the actuators' force (surge N, sway N, yaw N·m)."""

    def update(self, north: float, east: float) -> float:
        """Take a fix (m). Returns its NIS, NaN where there is none."""

    def update_heading(self, heading: float) -> None:
        """Take a compass reading (rad)."""

    @property
    def motion(self) -> VesselMotion:
        """The estimate now."""


class FixNoise(Protocol):
    """Measurement noise that changes: see `changing_noise`."""

    def start(self, variances: tuple[float, float]) -> None:
        """Begin with the variances (north, east; m²) of the filter."""

    def expected(self, x: Floats) -> tuple[float, float]:
        """The variances expected of a fix, for the state x."""

    def learned(self, x: Floats, p: Floats, north: float, east: float) -> tuple[float, float]:
        """The variances after a fix, for the state x and covariance P before it."""


@dataclass(frozen=True)
class VesselNoise:
    """Noise of the vessel and its environment. All 1σ or spectral densities, SI.

    `acceleration`: densities of the unmodelled surge, sway and yaw acceleration, m²/s³ (rad²/s³). `force_std`,
    `force_time`: Gauss–Markov force in north, east, yaw (N, N, N·m; s). `wave_std`, `wave_frequency`, `wave_damping`:
    the displacement by waves in either direction, m, rad/s, relative. `position_std` m of one fix, `heading_std` rad of
    one reading; `start_std` of each of the first six states.
    """

    acceleration: tuple[float, float, float] = (1e-6, 1e-6, 1e-7)
    force_std: tuple[float, float, float] = (0.0, 0.0, 0.0)
    force_time: float = 50.0
    wave_std: float = 0.0
    wave_frequency: float = 0.8
    wave_damping: float = 0.1
    position_std: float = 0.1
    heading_std: float = math.radians(0.5)
    start_std: tuple[float, ...] = field(default=(0.01,) * 6)

    def __post_init__(self) -> None:
        for name in ("acceleration", "force_std", "start_std"):
            for value in getattr(self, name):
                not_negative(f"vessel_noise.{name}", value)
        if len(self.acceleration) != 3 or len(self.force_std) != 3 or len(self.start_std) != 6:
            raise InputError("vessel_noise needs 3 of acceleration, 3 of force_std and 6 of start_std")
        not_negative("vessel_noise.wave_std", self.wave_std)
        for name in ("force_time", "wave_frequency", "wave_damping", "position_std", "heading_std"):
            positive(f"vessel_noise.{name}", getattr(self, name))

    @property
    def states(self) -> int:
        """How many states a filter needs: 6, with a force 9, with waves 13."""
        return WITH_WAVES if self.wave_std else WITH_FORCE if any(self.force_std) else BODY

    def densities(self) -> Floats:
        """Spectral densities of all states: a process of standard deviation σ and time constant T has 2σ²/T."""
        force = [2.0 * std**2 / self.force_time for std in self.force_std]
        wave = 4.0 * self.wave_damping * self.wave_frequency * self.wave_std**2
        return np.array([0.0, 0.0, 0.0, *self.acceleration, *force, 0.0, 0.0, wave, wave])[: self.states]

    def start_variances(self) -> Floats:
        """The covariance's diagonal at the start: forces and waves have their stationary variance."""
        wave = self.wave_std**2
        still = wave / self.wave_frequency**2
        return np.array([*np.square(self.start_std), *np.square(self.force_std), still, still, wave, wave])[
            : self.states
        ]


@kernel
def predict(x: Floats, p: Floats, force: Floats, noise: Floats, model: Floats, dt: float, work: Floats) -> None:
    """State and covariance predictor over dt, in place: P2 (26)–(27) as the errata have them. work: (3, n, n)."""
    n = len(x)
    middle = np.empty(n)
    advance_mean(x, force, model, dt, middle)
    x[HEADING] = wrap(x[HEADING])
    transition(middle, model, dt, work[0], work[1], work[2])
    spread(p, work[0], noise, dt, work[1])


@lean_kernel
def waves_in(x: Floats) -> int:
    """First of the states that waves add to a fix, 0 without them."""
    return WAVE if len(x) == WITH_WAVES else 0


@kernel
def take_fix(x: Floats, p: Floats, work: Floats, fix: Fix, gate: float) -> tuple[bool, float]:
    """Correct by a fix, P2 (23)–(25) with H = C. Returns (accepted, NIS)."""
    nis = normalised_square(innovation(x, p, fix, waves_in(x)))
    if nis > gate:
        return False, nis
    correct(x, p, work, fix, waves_in(x))
    x[HEADING] = wrap(x[HEADING])
    return True, nis


@kernel
def take_heading(x: Floats, p: Floats, work: Floats, heading: float, variance: float) -> None:
    """Correct by a compass reading unless the gate refuses it; the paper measures no heading, P2 (13)."""
    correct_scalar(x, p, work, HEADING, 0, 0.0, wrap(heading - x[HEADING]), variance)
    x[HEADING] = wrap(x[HEADING])


@kernel
def retake(x: Floats, p: Floats, fix: Fix) -> None:
    """Reset the position to a fix after unbroken rejections, and keep the motion."""
    wave = waves_in(x)
    x[0] = fix.north - x[wave] if wave else fix.north
    x[1] = fix.east - x[wave + 1] if wave else fix.east
    place_by_fix(p, fix, wave)


class VesselFilter:
    """The Kalman filter of this module, with the interface `Observer`.

    Args:
        inertia, damping: (3, 3) M and D of the vessel, kg, kg·m, kg·m² for M and the same per second for D.
        noise: of the vessel and its environment.
        gate: on the NIS of a fix; inf takes every fix.
        fix_noise: a `FixNoise` in place of `noise.position_std`.
        scheduled: densities of the acceleration from the estimated (surge, sway), see `changing_noise`.

    Raises InputError for matrices that are not (3, 3).
    """

    def __init__(
        self,
        inertia: ArrayLike,
        damping: ArrayLike,
        noise: VesselNoise,
        gate: float = FIX_GATE,
        fix_noise: FixNoise | None = None,
        scheduled: Callable[[float, float], tuple[float, float, float]] | None = None,
    ) -> None:
        inertia, damping = array_of("inertia", inertia, (3, 3)), array_of("damping", damping, (3, 3))
        self.noise = noise
        self.model = pack(inertia, damping, noise.force_time, noise.wave_frequency, noise.wave_damping)
        self.densities = noise.densities()
        self._fix_noise: FixNoise | None = fix_noise
        self._scheduled = scheduled
        self._gate = gate
        n = noise.states
        self._work = np.zeros((3, n, n))
        self.state, self.covariance_upper = np.zeros(n), np.zeros((n, n))
        self.start(0.0, 0.0, 0.0)

    def start(self, north: float, east: float, heading: float) -> None:
        self.state[:] = 0.0
        self.state[:3] = north, east, wrap(heading)
        self.covariance_upper[:] = np.diag(self.noise.start_variances())
        self._variances = (self.noise.position_std**2,) * 2
        if self._fix_noise is not None:
            self._fix_noise.start(self._variances)
        self._rejected = 0
        self.retaken = False

    def predict(self, force: Floats, dt: float) -> None:
        if self._scheduled is not None:
            self.densities[3:6] = self._scheduled(self.state[3], self.state[4])
        force = array_of("force", force, (3,))
        dt = not_negative("dt", dt)
        predict(self.state, self.covariance_upper, force, self.densities, self.model, dt, self._work)

    def update(self, north: float, east: float) -> float:
        """Take a fix (m). Returns its NIS: above the gate it was rejected; NaN for an unknown one, which is skipped."""
        if not (math.isfinite(north) and math.isfinite(east)):
            self.retaken = False
            return math.nan
        x, p = self.state, self.covariance_upper
        if self._fix_noise is not None:
            self._variances = self._noise_of(self._fix_noise, north, east)
        fix = Fix(north, east, *self._variances)
        accepted, nis = take_fix(x, p, self._work[0], fix, self._gate)
        self._rejected = 0 if accepted else self._rejected + 1
        self.retaken = self._rejected >= PATIENCE
        if self.retaken:
            retake(x, p, fix)
            self._rejected = 0
        return nis

    def _noise_of(self, fix_noise: FixNoise, north: float, east: float) -> tuple[float, float]:
        """Variances learned from a fix. An outlier counts as a fix at the gate, so that one alone changes little."""
        x, p = self.state, self.covariance_upper
        seen = innovation(x, p, Fix(north, east, *fix_noise.expected(x)), waves_in(x))
        nis = normalised_square(seen)
        share = 1.0 - math.sqrt(self._gate / nis) if nis > self._gate else 0.0
        return fix_noise.learned(x, p, north - share * seen.north, east - share * seen.east)

    def update_heading(self, heading: float) -> None:
        """Take a compass reading (rad); an unknown one is skipped."""
        if math.isfinite(heading):
            take_heading(self.state, self.covariance_upper, self._work[0], heading, self.noise.heading_std**2)

    @property
    def covariance(self) -> Floats:
        """(n, n) covariance of `state`."""
        return symmetric(self.covariance_upper)

    @property
    def motion(self) -> VesselMotion:
        x = self.state.tolist()
        force = (x[6], x[7], x[8]) if len(x) > BODY else (0.0, 0.0, 0.0)
        return VesselMotion(x[0], x[1], x[2], (x[3], x[4], x[5]), force)
