"""The passive nonlinear observer with wave filter and force bias, with which P2 compares its filter.

T. I. Fossen and J. P. Strand (1999), Passive nonlinear observer design for ships using Lyapunov methods, Automatica
35(1), with the wave filter's gains as in Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed.
(2021), chapter 13:

    ξ̇ = ŵ + K11 ỹ,  ŵ̇ = K12 ỹ − ω₀² ξ − 2λω₀ ŵ,  η̂̇ = R(ψ_y) ν̂ + ω_c ỹ,  b̂̇ = K3 ỹ − b̂/T_b,
    M ν̂̇ = Rᵀ(ψ_y) (K4 ỹ + b̂) + τ − D ν̂,  ỹ = y − η̂ − ŵ,  K11 = −2(1 − λ) ω_c/ω₀,  K12 = 2ω₀ (1 − λ).

It is designed for continuous measurements. Fixes a second apart can be used in three ways: "held" keeps the last
measurement and compares it with the estimate of every step (with a measurement each step it is the continuous
observer); "held innovation" keeps the innovation; "impulsive" applies the whole correction of the interval at the fix.
"""

import math
import warnings
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.checks import array_of, not_negative, one_of, positive
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.estimation.positioning.low_speed import HEADING, WAVE_DRAG, WAVE_STIFFNESS, WITH_FORCE, pack, rates
from steerway.estimation.positioning.vessel_filter import VesselMotion

CORRECTIONS = ("held", "held innovation", "impulsive")
WAVE_INTEGRAL, WAVE, PLACE, FORCE, VELOCITY = 0, 3, 6, 9, 12
STATES = 15


@dataclass(frozen=True)
class ObserverGains:
    """Gains in north, east and yaw, kept diagonal.

    `cutoff` ω_c 1/s; `force` K3 in N/(m·s), `velocity` K4 in N/m (N·m/rad in yaw); `force_time` T_b s.
    `wave_frequency` ω₀ rad/s, 0 for no wave filter, `wave_damping` λ.
    """

    cutoff: tuple[float, float, float]
    force: tuple[float, float, float]
    velocity: tuple[float, float, float]
    force_time: float = 100.0
    wave_frequency: float = 0.0
    wave_damping: float = 0.1

    def __post_init__(self) -> None:
        for name in ("cutoff", "force", "velocity"):
            if len(getattr(self, name)) != 3:
                raise InputError(f"observer.{name} is {getattr(self, name)}, expected three numbers")
            for value in getattr(self, name):
                not_negative(f"observer.{name}", value)
        positive("observer.force_time", self.force_time)
        not_negative("observer.wave_frequency", self.wave_frequency)
        positive("observer.wave_damping", self.wave_damping)

    @classmethod
    def of_inertia(cls, inertia: ArrayLike) -> Self:
        """Gains for fixes about a second apart and a compass at 10 Hz, without a wave filter.

        They are proportional to the diagonal of M (3, 3). The factors minimise the error of CyberShip II in a varying
        force.
        """
        surge, sway, yaw = array_of("inertia", inertia, (3, 3)).diagonal().tolist()
        return cls(
            cutoff=(0.333, 0.333, 1.0),
            force=(0.013 * surge, 0.013 * sway, 0.03 * yaw),
            velocity=(0.082 * surge, 0.082 * sway, 0.3 * yaw),
        )

    def out_of_order(self) -> str:
        """The violation of 1/T_b ≪ K3/K4 < ω₀ < ω_c, the condition of a passive observer, in words; empty if it holds.

        ≪ means a fifth or less.
        """
        for axis, cutoff, force, velocity in zip(
            ("north", "east", "yaw"), self.cutoff, self.force, self.velocity, strict=True
        ):
            ratio = force / velocity if velocity else math.inf
            if not 5.0 / self.force_time <= ratio:
                return f"{axis}: K3/K4 = {ratio:g} 1/s, expected well above 1/T_b = {1.0 / self.force_time:g}"
            upper = self.wave_frequency or cutoff
            if not ratio < upper:
                return f"{axis}: K3/K4 = {ratio:g} 1/s, expected below {upper:g}"
            if self.wave_frequency and not self.wave_frequency < cutoff:
                return f"{axis}: ω_c = {cutoff:g} 1/s, expected above ω₀ = {self.wave_frequency:g}"
        return ""

    def table(self) -> Floats:
        """(5, 3): K11, K12, ω_c, K3, K4."""
        cutoff = np.array(self.cutoff)
        frequency, left = self.wave_frequency, 2.0 * (1.0 - self.wave_damping)
        integral = -left * cutoff / frequency if frequency else np.zeros(3)
        return np.array([integral, np.full(3, left * frequency), cutoff, self.force, self.velocity])


DEMO_GAINS = ObserverGains((1.04,) * 3, (0.1, 0.1, 0.01), (0.1, 0.1, 0.01), 100.0, 0.8, 0.1)
"""Gains of the public simulator of CyberShip II; they violate the order: K3/K4 = 1 > ω₀."""


class Seen(NamedTuple):
    """The measurement of a step, and the innovation of the observer."""

    measured: Floats  # (3,) position and heading
    error: Floats  # (3,) innovation that corrects
    is_held: bool  # whether `error` is computed again from the measurement and the present state


@kernel
def _correction(error: Floats, heading: float, gains: Floats, model: Floats, out: Floats) -> None:
    """out ← what the innovation `error` adds to the rates of all 15 states."""
    c, s = math.cos(heading), math.sin(heading)
    for i in range(3):
        out[WAVE_INTEGRAL + i] = gains[0, i] * error[i]
        out[WAVE + i] = gains[1, i] * error[i]
        out[PLACE + i] = gains[2, i] * error[i]
        out[FORCE + i] = gains[3, i] * error[i]
    north, east, yaw = gains[4, 0] * error[0], gains[4, 1] * error[1], gains[4, 2] * error[2]
    ahead, abeam = c * north + s * east, c * east - s * north
    for i in range(3):
        out[VELOCITY + i] = model[3 * i] * ahead + model[3 * i + 1] * abeam + model[3 * i + 2] * yaw


@kernel
def _rates(x: Floats, seen: Seen, force: Floats, gains: Floats, model: Floats, out: Floats) -> None:
    """Right-hand side of the observer: rates of the vessel's model at the measured heading, of the waves, and the
    correction."""
    if seen.is_held:
        for i in range(3):
            seen.error[i] = seen.measured[i] - x[PLACE + i] - x[WAVE + i]
        seen.error[2] = wrap(seen.error[2])
    _correction(seen.error, seen.measured[2], gains, model, out)
    vessel, moved = np.empty(WITH_FORCE), np.empty(WITH_FORCE)
    for i in range(3):
        vessel[i], vessel[3 + i], vessel[6 + i] = x[PLACE + i], x[VELOCITY + i], x[FORCE + i]
    vessel[HEADING] = seen.measured[2]
    rates(vessel, force, model, moved)
    for i in range(3):
        out[PLACE + i] += moved[i]
        out[VELOCITY + i] += moved[3 + i]
        out[FORCE + i] += moved[6 + i]
        out[WAVE_INTEGRAL + i] += x[WAVE + i]
        out[WAVE + i] -= model[WAVE_STIFFNESS] * x[WAVE_INTEGRAL + i] + model[WAVE_DRAG] * x[WAVE + i]


@kernel
def predict(x: Floats, seen: Seen, force: Floats, gains: Floats, model: Floats, dt: float) -> None:
    """x after dt by Runge and Kutta's fourth-order method, in place. No angle is wrapped."""
    k1, k2, k3, k4 = np.empty(STATES), np.empty(STATES), np.empty(STATES), np.empty(STATES)
    _rates(x, seen, force, gains, model, k1)
    _rates(x + 0.5 * dt * k1, seen, force, gains, model, k2)
    _rates(x + 0.5 * dt * k2, seen, force, gains, model, k3)
    _rates(x + dt * k3, seen, force, gains, model, k4)
    for i in range(STATES):
        x[i] += dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])


@kernel
def strike(x: Floats, error: Floats, heading: float, gains: Floats, model: Floats, interval: float) -> None:
    """x += `interval` times the correction by an innovation, at once."""
    out = np.empty(STATES)
    _correction(error, heading, gains, model, out)
    for i in range(STATES):
        x[i] += interval * out[i]
    x[PLACE + 2] = wrap(x[PLACE + 2])


class PassiveObserver:
    """The observer of this module, with the interface `Observer` (see `vessel_filter`).

    Args:
        inertia, damping: (3, 3) M and D of the vessel.
        gains: see `ObserverGains`; a warning names a violation of the order that makes the observer passive.
        correction: "held", "held innovation" or "impulsive", see the module.
        fix_interval, heading_interval: s from fix to fix and from compass reading to reading; None for no compass.
        check: whether to refuse gains with which the observer diverges.

    Raises InputError for another correction, for intervals that are not positive, and if the observer would diverge
    with these gains and intervals.
    """

    def __init__(
        self,
        inertia: ArrayLike,
        damping: ArrayLike,
        gains: ObserverGains,
        correction: str = "impulsive",
        fix_interval: float = 1.0,
        heading_interval: float | None = 0.1,
        check: bool = True,
    ) -> None:
        self._form = one_of("observer.correction", correction, CORRECTIONS)
        self._fix_interval = positive("observer.fix_interval", fix_interval)
        self._heading_interval = heading_interval
        if heading_interval is not None:
            positive("observer.heading_interval", heading_interval)
        self.gains = gains
        self._gains = gains.table()
        self._model = pack(inertia, damping, gains.force_time, gains.wave_frequency, gains.wave_damping)
        self.state = np.zeros(STATES)
        disorder = gains.out_of_order()
        if disorder:
            warnings.warn(f"observer gains are out of order, {disorder}", UserWarning, stacklevel=2)
        self.spectral_radius = self._growth()
        """Factor by which errors grow from fix to fix, heading north: below 1 the observer is stable."""
        if check and self.spectral_radius >= 1.0:
            raise InputError(
                f"observer.gains diverge with {correction} corrections every {fix_interval:g} s: "
                f"errors grow by {self.spectral_radius:.3g} from fix to fix, expected less than 1"
            )
        self.start(0.0, 0.0, 0.0)

    def start(self, north: float, east: float, heading: float) -> None:
        self.state[:] = 0.0
        self.state[PLACE : PLACE + 3] = north, east, wrap(heading)
        self._measured = self.state[PLACE : PLACE + 3].copy()
        self._error = np.zeros(3)
        self._known = np.zeros(3)  # 1 where there is a measurement to compare with

    def predict(self, force: ArrayLike, dt: float) -> None:
        x = self.state
        if not self._known[2]:
            self._measured[2] = x[PLACE + 2]
        force, dt = array_of("force", force, (3,)), not_negative("dt", dt)
        seen = Seen(self._measured, self._error, self._form == "held")
        predict(x, seen, force, self._gains * self._known, self._model, dt)
        x[PLACE + 2] = wrap(x[PLACE + 2])

    def update(self, north: float, east: float) -> float:
        """Take a fix (m); an unknown one is skipped. Returns NaN: an observer has no NIS."""
        if not (math.isfinite(north) and math.isfinite(east)):
            return math.nan
        self._measured[:2], self._known[:2] = (north, east), 1.0
        self._take(slice(0, 2), self._fix_interval)
        return math.nan

    def update_heading(self, heading: float) -> None:
        """Take a compass reading (rad); an unknown one is skipped."""
        if not math.isfinite(heading):
            return
        self._measured[2], self._known[2] = heading, 1.0
        self._take(slice(2, 3), self._heading_interval or self._fix_interval)

    def _take(self, axes: slice, interval: float) -> None:
        """Correct these axes by their new measurement, at once or over the time until the next one."""
        error = np.zeros(3)
        error[axes] = (self._measured - self.state[PLACE : PLACE + 3] - self.state[WAVE : WAVE + 3])[axes]
        error[2] = wrap(error[2])
        if self._form == "impulsive":
            strike(self.state, error, self._measured[2], self._gains, self._model, interval)
        else:
            self._error[axes] = error[axes]

    @property
    def motion(self) -> VesselMotion:
        x = self.state.tolist()
        north, east, heading, *force_and_velocity = x[PLACE:]
        force_north, force_east, force_yaw, surge, sway, yaw_rate = force_and_velocity
        return VesselMotion(north, east, heading, (surge, sway, yaw_rate), (force_north, force_east, force_yaw))

    def _growth(self) -> float:
        small = 1e-3  # the observer is linear but for the wrapped heading
        transition = np.empty((STATES, STATES))
        for i in range(STATES):
            self.start(0.0, 0.0, 0.0)
            self.state[i] = small
            self._one_interval()
            transition[:, i] = self.state / small
        own = [i for i in range(STATES) if (self.gains.wave_frequency or i >= PLACE)]
        if not self._heading_interval:
            own = [i for i in own if i % 3 != 2]
        return float(np.abs(np.linalg.eigvals(transition[np.ix_(own, own)])).max())

    def _one_interval(self) -> None:
        """From just before a fix to just before the next, with measurements of 0."""
        still = np.zeros(3)
        step = self._heading_interval or min(self._fix_interval, 0.1)
        self.update(0.0, 0.0)
        for _ in range(max(round(self._fix_interval / step), 1)):
            if self._heading_interval:
                self.update_heading(0.0)
            self.predict(still, step)
