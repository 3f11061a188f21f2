"""Reference filters for course and heading: low-pass, tracking filter and third-order reference model.

A guidance command jumps at every waypoint; a controller needs an angle with its own rate and acceleration. All three
filters take the shorter way round and return angles in [−π, π).
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Annotated, Literal, NamedTuple

from steerway.core.angles import wrap
from steerway.core.checks import positive, positive_or_unlimited
from steerway.core.compiled import kernel
from steerway.core.settings import Positive, Table


class Reference(NamedTuple):
    """A desired angle (course or heading) with its rate and acceleration; rad, rad/s, rad/s²."""

    angle: float
    rate: float
    acceleration: float


@kernel
def low_pass(
    angle: float, rate: float, command: float, command_rate: float, time_constant: float, dt: float
) -> tuple[float, float]:
    """Angle and rate after a first-order low-pass of both, P1 (44), exact for a command held over dt."""
    share = 1.0 - math.exp(-dt / time_constant)
    return wrap(angle + share * wrap(command - angle)), rate + share * (command_rate - rate)


@kernel
def tracked(
    angle: float, rate: float, command: float, command_rate: float, bandwidth: float, damping: float, dt: float
) -> tuple[float, float, float]:
    """(angle, rate, acceleration) after dt of χ̈ = ω² (command − χ) + 2ζω (command rate − χ̇)."""
    steps = _substeps(bandwidth, dt)
    h = dt / steps
    acceleration = 0.0
    for _ in range(steps):
        error = wrap(command - angle)
        acceleration = bandwidth * bandwidth * error + 2.0 * damping * bandwidth * (command_rate - rate)
        rate += h * acceleration
        angle = wrap(angle + h * rate)
    return angle, rate, acceleration


@kernel
def third_order(
    angle: float,
    rate: float,
    acceleration: float,
    command: float,
    bandwidth: float,
    damping: float,
    max_rate: float,
    max_acceleration: float,
    dt: float,
) -> tuple[float, float, float]:
    """(angle, rate, acceleration) after dt, within limits, of the model with the poles (s + ω)(s² + 2ζωs + ω²) = 0.

    The rate is the derivative of the angle, and the acceleration that of the rate, also at a limit.
    """
    steps = _substeps(bandwidth, dt)
    h = dt / steps
    spread = 2.0 * damping + 1.0
    for _ in range(steps):
        pull = bandwidth * wrap(command - angle) - spread * rate
        jerk = bandwidth * (bandwidth * pull - spread * acceleration)
        wanted = min(max_acceleration, max(-max_acceleration, acceleration + h * jerk))
        following = min(max_rate, max(-max_rate, rate + h * wanted))
        acceleration = (following - rate) / h
        rate = following
        angle = wrap(angle + h * rate)
    return angle, rate, acceleration


@kernel
def _substeps(bandwidth: float, dt: float) -> int:
    """Number of Euler steps within dt, each at most 0.05/ω, so that the integration is stable in a slow loop."""
    return max(1, math.ceil(bandwidth * dt / 0.05))


class _Shaper(ABC):
    """Base of the reference filters. `reference` is None until `start` or the first command."""

    def __init__(self) -> None:
        self.reference: Reference | None = None

    def start(self, angle: float, rate: float = 0.0, acceleration: float = 0.0) -> Reference:
        """Start at a boat's own angle and rate, so that the controller sees no jump. Returns the new reference."""
        self.reference = Reference(wrap(angle), rate, acceleration)
        return self.reference

    @property
    @abstractmethod
    def lag(self) -> float:
        """Lag (s) of the angle behind a ramp command whose rate is not given."""

    def step(self, command: tuple[float, float, float], dt: float) -> Reference:
        """The reference after dt. The first step begins at the command; an unknown (NaN) one holds the last angle."""
        if not math.isfinite(command[0]):
            return Reference(*command) if self.reference is None else self.start(self.reference.angle)
        self.reference = self._following(self.reference or self.start(command[0]), command, dt)
        return self.reference

    @abstractmethod
    def _following(self, before: Reference, command: tuple[float, float, float], dt: float) -> Reference:
        """The reference dt (s) after `before`."""


class LowPass(_Shaper):
    """First-order low-pass of a course command and of its feedforward rate; P1 (44). `time_constant` T_lp in s.

    The output rate is the filtered feedforward rate of guidance, as in P1, not the rate of the filtered angle. P1 sets
    1/T_lp five to ten times below the autopilot's bandwidth: little rudder action, wide turns.
    """

    def __init__(self, time_constant: float):
        super().__init__()
        self.time_constant = positive("low_pass.time_constant", time_constant)

    @property
    def lag(self) -> float:
        """See `_Shaper`."""
        return self.time_constant

    def _following(self, before: Reference, command: tuple[float, float, float], dt: float) -> Reference:
        return Reference(*low_pass(before.angle, before.rate, *command[:2], self.time_constant, dt), 0.0)


class TrackingFilter(_Shaper):
    """A second-order filter whose rate is the derivative of its angle. `bandwidth` rad/s.

    With the command's rate, the angle follows a ramp without lag; with rate 0 it lags by 2ζ/ω times the ramp's rate.
    There are no limits: for step commands use `ReferenceModel`.
    """

    def __init__(self, bandwidth: float, damping: float = 1.0):
        super().__init__()
        self.bandwidth = positive("tracking_filter.bandwidth", bandwidth)
        self.damping = positive("tracking_filter.damping", damping)

    @property
    def lag(self) -> float:
        """See `_Shaper`."""
        return 2.0 * self.damping / self.bandwidth

    def _following(self, before: Reference, command: tuple[float, float, float], dt: float) -> Reference:
        return Reference(*tracked(before.angle, before.rate, *command[:2], self.bandwidth, self.damping, dt))


class ReferenceModel(_Shaper):
    """Third-order reference model with limits of rate and acceleration, within which an autopilot does not saturate.

    bandwidth ω in rad/s, damping ζ, max_rate in rad/s, max_acceleration in rad/s²; Fossen, Handbook of Marine Craft
    Hydrodynamics and Motion Control, 2nd edition, section 12.1. Stopping a turn needs a max_acceleration of at
    least 0.28 ω max_rate. There is then no overshoot for ζ ≥ 1.
    """

    def __init__(
        self,
        bandwidth: float,
        damping: float = 1.0,
        max_rate: float = math.inf,
        max_acceleration: float = math.inf,
    ):
        super().__init__()
        self.bandwidth = positive("reference_model.bandwidth", bandwidth)
        self.damping = positive("reference_model.damping", damping)
        self.max_rate = positive_or_unlimited("reference_model.max_rate", max_rate)
        self.max_acceleration = positive_or_unlimited("reference_model.max_acceleration", max_acceleration)

    @property
    def lag(self) -> float:
        """See `_Shaper`."""
        return (2.0 * self.damping + 1.0) / self.bandwidth

    def _following(self, before: Reference, command: tuple[float, float, float], dt: float) -> Reference:
        limits = self.max_rate, self.max_acceleration
        return Reference(*third_order(*before, command[0], self.bandwidth, self.damping, *limits, dt))


Filter = LowPass | TrackingFilter | ReferenceModel
SHAPERS: dict[str, Callable[["ReferenceTable", float], Filter]] = {
    "tracking": lambda keys, loop: TrackingFilter(keys.bandwidth or 1.0, keys.damping),
    "model": lambda keys, loop: ReferenceModel(keys.bandwidth or 0.5, keys.damping, math.radians(keys.max_rate_deg)),
    "low-pass": lambda keys, loop: LowPass(keys.time_constant or 2.0 / loop),
}
"""Constructors of the filters, from the table [reference] and the autopilot's bandwidth ω_n (rad/s)."""


class ReferenceTable(Table):
    """The filter between guidance and autopilot."""

    kind: Literal[*SHAPERS] | None = None  # type: ignore[valid-type]
    """Low-pass, tracking filter or third-order reference model; by default that of the vessel."""
    bandwidth: Annotated[Positive | None, "rad/s"] = None
    """Natural frequency of the tracking filter (default 1.0) or of the reference model (default 0.5)."""
    damping: Annotated[Positive, "1"] = 1.0
    """Damping ratio of the tracking filter or of the reference model."""
    time_constant: Annotated[Positive | None, "s"] = None
    """Time constant of the low-pass; by default 2/ω_n with the autopilot's bandwidth ω_n: 40 s for the ship of P1."""
    max_rate_deg: Annotated[Positive, "°/s"] = 15.0
    """Largest rate of the angle that the reference model allows."""
