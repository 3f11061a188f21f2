"""Random processes for instruments and waves, exact for any time step: first-order Gauss–Markov and oscillator."""

import math
from collections.abc import Sequence

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel

Seed = int | Sequence[int] | np.random.Generator | None
"""Seed of a random generator; None for a different sequence each time."""


def markov_decay(time_constant: float, step: float) -> float:
    """Factor by which a Gauss–Markov value decays in `step` s: e^(−h/T), as in P1 (42)–(43)."""
    return math.exp(-step / time_constant)


def markov_std(driving_std: float, time_constant: float, step: float) -> float:
    """The stationary 1σ of a Gauss–Markov sequence driven by white noise of `driving_std` every `step` s.

    P1 (42)–(43) with T = 1100 s: driving noise of 0.21 m gives 4.9 m in steps of 1 s, but 15.6 m in the printed
    steps of 0.1 s. In steps of 0.1 s, 4.7 m needs driving noise of 0.0634 m.
    """
    return driving_std / math.sqrt(-math.expm1(-2.0 * step / time_constant))


@kernel
def markov_step(value: float, decay: float, std: float, normal: float) -> float:
    """The next value of a sequence with stationary 1σ `std`; `normal` is a standard normal draw."""
    return decay * value + math.sqrt(1.0 - decay * decay) * std * normal


def oscillator(frequency: float, damping: float, step: float) -> np.ndarray:
    """A damped oscillator driven by white noise, with 1σ of 1: the (7,) numbers that `oscillator_step` reads.

    The second-order wave response of Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed. (2021),
    section 10.2, with `frequency` ω₀ (rad/s) and damping ratio λ. Its stationary covariance is S = diag(1/ω₀², 1), so
    the noise of a step with transition Φ has the covariance S − Φ S Φᵀ.
    """
    decay = math.exp(-damping * frequency * step)
    own = math.sqrt(1.0 - damping * damping) * frequency
    c, s = math.cos(own * step), math.sin(own * step) / own
    lean = damping * frequency * s
    transition = decay * np.array([[c + lean, s], [-(frequency**2) * s, c - lean]])
    spread = np.diag([frequency**-2, 1.0])
    added = spread - transition @ spread @ transition.T
    first = math.sqrt(max(added[0, 0], 0.0))
    cross = added[0, 1] / first if first > 0.0 else 0.0
    second = math.sqrt(max(added[1, 1] - cross * cross, 0.0))
    return np.array([*transition.ravel(), first, cross, second])


@kernel
def oscillator_step(model: Floats, integral: float, value: float, normal: float, other: float) -> tuple[float, float]:
    """The next (integral, value) of an `oscillator` (7,); `normal` and `other` are standard normal draws."""
    if model.ndim != 1 or len(model) != 7:
        raise ValueError("model has the wrong shape, expected an array of 7 from `oscillator`")
    return (
        model[0] * integral + model[1] * value + model[4] * normal,
        model[2] * integral + model[3] * value + model[5] * normal + model[6] * other,
    )
