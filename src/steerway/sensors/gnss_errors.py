"""The errors of a GNSS receiver, a row an epoch: as many random numbers whatever happens in it."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.noise import Seed, markov_decay, markov_step
from steerway.sensors.faults import happen, table

if TYPE_CHECKING:
    from steerway.sensors.gnss import Gnss


class Errors:
    """The error sequence of a `Gnss`, continued from block to block."""

    def __init__(self, gnss: "Gnss", seed: Seed) -> None:
        self._gaussian, self._chance = np.random.default_rng(seed).spawn(2)
        step = 1.0 / gnss.rate
        decays = [markov_decay(time_constant, step) for _, time_constant in gnss.markov]
        self._std = np.array([gnss.white, gnss.velocity_std or 0.0])
        self._markov = np.array([decays, [std for std, _ in gnss.markov]]).T.reshape(-1, 2).copy()
        self._wander = self._gaussian.standard_normal((len(decays), 2)) * self._markov[:, 1:] * gnss.settled
        self._faults = table(gnss.faults, gnss.rate)
        self._troubles = np.zeros((len(gnss.faults), 3))
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
