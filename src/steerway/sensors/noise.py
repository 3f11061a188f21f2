"""Noise that every instrument shares: first-order Gauss–Markov sequences, exact at any step."""

import math

from steerway.compiled import kernel


def markov_decay(time_constant: float, step: float) -> float:
    """What is left of a Gauss–Markov value after `step` s: e^(−h/T), the factor of P1 (42)–(43)."""
    return math.exp(-step / time_constant)


def markov_std(driving_std: float, time_constant: float, step: float) -> float:
    """The stationary 1σ of a Gauss–Markov sequence driven by white noise of `driving_std` every `step` s.

    P1 (42)–(43): 0.21 m with T = 1100 s is 4.9 m at steps of 1 s but 15.6 m at the printed 0.1 s; 4.7 m at 0.1 s takes
    0.0634 m.
    """
    return driving_std / math.sqrt(-math.expm1(-2.0 * step / time_constant))


@kernel
def markov_step(value, decay, std, normal):
    """The next value of a sequence with stationary 1σ `std`; `normal` is a standard normal draw."""
    return decay * value + math.sqrt(1.0 - decay * decay) * std * normal
