"""The errors of a GNSS receiver: white noise, Gauss–Markov errors and faults, one row per epoch.

Faults are dropouts, jumps, bursts, steps and frozen positions, at a set time or at random. Every epoch draws the same
number of random numbers, so that the errors do not depend on the length of the blocks.
"""

import math
from collections.abc import Sequence
from typing import Annotated, Literal, Self, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.noise import Seed, markov_decay, markov_step
from steerway.core.settings import NotNegative, Number, Table

DROPOUT, JUMP, BURST, STEP, FROZEN = range(5)
Kind = Literal["dropout", "jump", "burst", "step", "frozen"]
KINDS: tuple[Kind, ...] = get_args(Kind)

GOOD, LOST, HELD = range(3)
"""Outcome of an epoch: a fix, no fix, or the previous fix again."""

_FOREVER = 1 << 60


class Fault(Table):
    """One kind of fault of a receiver, at a set time or at random; it never overlaps itself.

    `kind`: "dropout" no fix; "jump" a transient displacement; "burst" additional white noise; "step" a displacement
    that stays; "frozen" the last position repeated with new times. Raises InputError unless exactly one of `start` and
    `per_hour` is given, and for numbers out of range.
    """

    kind: Kind
    """Kind of the fault: no fix, a displaced fix, more noise, a displacement that stays, or a repeated position."""
    start: Annotated[NotNegative | None, "s"] = None
    """Time from the first epoch to the fault."""
    per_hour: Annotated[NotNegative | None, "1/h"] = None
    """Mean number of faults per hour, at random times."""
    duration: Annotated[NotNegative | None, "s"] = None
    """Duration; by default one fix, or to the end for a step."""
    size: Annotated[NotNegative, "m"] = 0.0
    """Displacement, or 1σ of the noise of a burst."""
    direction_deg: Number | None = None
    """Direction of the displacement, from true north; by default random."""

    @model_validator(mode="after")
    def _begins(self) -> Self:
        if (self.start is None) == (self.per_hour is None):
            raise ValueError(f"kind {self.kind} has both or neither of start and per_hour, expected one of them")
        return self

    def row(self, rate: float) -> tuple[float, ...]:
        """The fault as a row of `table`, with times in epochs of a receiver with `rate` Hz."""
        start = -1.0 if self.start is None else math.ceil(self.start * rate - 1e-9)
        probability = 0.0 if self.per_hour is None else self.per_hour / (3600.0 * rate)
        forever = math.inf if self.kind == "step" else 0.0
        duration = forever if self.duration is None else self.duration
        epochs = float(_FOREVER) if math.isinf(duration) else max(1.0, round(duration * rate))
        direction = math.nan if self.direction_deg is None else math.radians(self.direction_deg)
        return KINDS.index(self.kind), start, probability, epochs, self.size, direction


def table(faults: Sequence[Fault], rate: float) -> np.ndarray:
    """The faults as an array (n, 6) for `happen`."""
    return np.array([fault.row(rate) for fault in faults], dtype=np.float64).reshape(len(faults), 6)


@kernel
def happen(faults: Floats, state: Floats, epoch: int, uniforms: Floats, normals: Floats, error: Floats) -> int:
    """Apply the faults of one epoch: add displacements to `error` (2,) and return GOOD, LOST or HELD.

    `faults` (n, 6) from `table`; `state` (n, 3) is changed: epochs left, displacement north and east. `uniforms` (2n,)
    and `normals` (2n,) are this epoch's draws.
    """
    outcome = GOOD
    for i in range(len(faults)):
        kind, size = faults[i, 0], faults[i, 4]
        starts = epoch == faults[i, 1] or uniforms[2 * i] < faults[i, 2]
        if state[i, 0] == 0.0 and starts:
            direction = faults[i, 5]
            if math.isnan(direction):
                direction = 2.0 * math.pi * uniforms[2 * i + 1]
            state[i, 0] = faults[i, 3]
            state[i, 1] = size * math.cos(direction)
            state[i, 2] = size * math.sin(direction)
        if state[i, 0] == 0.0:
            continue
        state[i, 0] -= 1.0
        if kind == DROPOUT:
            outcome = LOST
        elif kind == FROZEN:
            outcome = LOST if outcome == LOST else HELD
        elif kind == BURST:
            error[0] += size * normals[2 * i]
            error[1] += size * normals[2 * i + 1]
        else:
            error[0] += state[i, 1]
            error[1] += state[i, 2]
    return outcome


class Errors:
    """The errors of a receiver, continued from block to block; the arguments are fields of `sensors.Gnss`."""

    def __init__(
        self,
        rate: float,
        white: float,
        velocity_std: float,
        markov: Sequence[tuple[float, float]],
        settled: bool,
        faults: Sequence[Fault],
        seed: Seed,
    ) -> None:
        self._gaussian, self._chance = np.random.default_rng(seed).spawn(2)
        decays = [markov_decay(time_constant, 1.0 / rate) for _, time_constant in markov]
        self._std = np.array([white, velocity_std])
        self._markov = np.array([decays, [std for std, _ in markov]]).T.reshape(-1, 2).copy()
        self._wander = self._gaussian.standard_normal((len(decays), 2)) * self._markov[:, 1:] * settled
        self._faults = table(faults, rate)
        self._troubles = np.zeros((len(faults), 3))
        self._epoch = 0

    def draw(self, n: int) -> tuple[np.ndarray, np.ndarray]:
        """The next n epochs: errors (n, 4) of north, east (m) and their velocities (m/s), and outcomes (n,)."""
        normals = self._gaussian.standard_normal((n, 4 + 2 * len(self._markov) + 2 * len(self._faults)))
        uniforms = self._chance.random((n, 2 * len(self._faults)))
        errors, outcome = np.empty((n, 4)), np.empty(n, dtype=np.uint8)
        _draw(
            normals,
            uniforms,
            self._std,
            self._markov,
            self._wander,
            self._faults,
            self._troubles,
            self._epoch,
            errors,
            outcome,
        )
        self._epoch += n
        return errors, outcome


@kernel
def _draw(
    normals: Floats,
    uniforms: Floats,
    std: Floats,
    markov: Floats,
    wander: Floats,
    faults: Floats,
    troubles: Floats,
    first_epoch: int,
    errors: Floats,
    outcome: NDArray[np.uint8],
) -> None:
    m = len(markov)
    for k in range(len(normals)):
        draws, error = normals[k], errors[k]
        for axis in range(2):
            error[axis] = std[0] * draws[axis]
            error[2 + axis] = std[1] * draws[2 + axis]
            for j in range(m):
                error[axis] += wander[j, axis]
                wander[j, axis] = markov_step(wander[j, axis], markov[j, 0], markov[j, 1], draws[4 + 2 * j + axis])
        outcome[k] = happen(faults, troubles, first_epoch + k, uniforms[k], draws[4 + 2 * m :], error)
