"""Likelihood of a record of an angle, or of positions, for a Nomoto vessel with a known rudder.

T ω̇ + ω = K δ + c + white noise, χ̇ = ω: P1 (26)–(27), with c = K b for a rudder bias b. This is the course rate of the
five-state model with the rudder as an additional known input; 1/T is α2 of P0 (15).
"""

import math

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel, lean_kernel
from steerway.core.linear_algebra import fill_lower
from steerway.estimation.filter.bank import advance
from steerway.estimation.filter.discrete import decaying
from steerway.estimation.filter.five_state import correct, innovate
from steerway.estimation.filter.model import COURSE, RATE, Bank, Model
from steerway.estimation.filter.vectors import Vec2

_OUTLIER_COST = 24.0
_NODE = math.sqrt(0.15)
"""Outer node of the Gauss–Legendre rule with three nodes, from the middle of an interval of length 1."""


@lean_kernel
def rate_noise(decay: float, t: float) -> tuple[float, float, float]:
    """Covariance that unit noise on a decaying rate adds within t s: (rate variance, covariance with the angle, angle
    variance). decay in 1/s. By quadrature, or in closed form if decay · t > 0.5."""
    left, turn, _ = decaying(decay, t)
    if decay * t > 0.5:
        rate = 0.5 * (1.0 - left * left) / decay
        return rate, 0.5 * turn * turn, (t - 2.0 * turn + rate) / decay**2
    rate = both = angle = 0.0
    for k in range(-1, 2):
        left, turn, _ = decaying(decay, t * (0.5 + k * _NODE))
        weight = t * (4.0 / 9.0 if k == 0 else 5.0 / 18.0)
        rate += weight * left * left
        both += weight * left * turn
        angle += weight * turn * turn
    return rate, both, angle


@kernel
def angle_innovations(
    time: Floats, angle: Floats, rudder: Floats, time_constant: float, ratio: float, out: Floats
) -> None:
    """Innovations of an angle without a rudder, their responses to K and to c, and their variance: out (n, 4).

    time, angle, rudder: (n,), s, unwrapped rad and the rudder from its row to the next. `ratio`: noise density of the
    rate divided by the variance of an angle, 1/s³; variances are in units of that variance. NaN where no angle was
    measured.
    """
    states = np.zeros((3, 2))  # (angle, rate): the estimate, and its response to K and to c
    p_aa, p_ar, p_rr = 1e6, 0.0, 1e6 * max(ratio, 1e-6)
    begun = False
    for k in range(len(time)):
        if k > 0:
            dt = time[k] - time[k - 1]
            left, turn, _ = decaying(1.0 / time_constant, dt)
            q_rr, q_ar, q_aa = rate_noise(1.0 / time_constant, dt)
            p_aa += turn * (2.0 * p_ar + turn * p_rr) + ratio * q_aa
            p_ar = left * (p_ar + turn * p_rr) + ratio * q_ar
            p_rr = left * left * p_rr + ratio * q_rr
            for i in range(3):
                push = rudder[k - 1] if i == 1 else 1.0 if i == 2 else 0.0
                states[i, 0] += turn * states[i, 1] + push * (dt - turn)
                states[i, 1] = left * states[i, 1] + push * (1.0 - left)
        out[k, :] = math.nan
        if math.isnan(angle[k]):
            continue
        if not begun:
            states[0, 0] = angle[k]
            begun = True
        s = p_aa + 1.0
        gain_a, gain_r = p_aa / s, p_ar / s
        for i in range(3):
            seen = angle[k] - states[i, 0] if i == 0 else -states[i, 0]
            states[i, 0] += gain_a * seen
            states[i, 1] += gain_r * seen
            out[k, i] = seen if i == 0 else -seen
        out[k, 3] = s
        p_rr -= gain_r * p_ar
        p_ar -= gain_a * p_ar
        p_aa -= gain_a * p_aa


@kernel
def positions_cost(
    time: Floats,
    rudder: Floats,
    north: Floats,
    east: Floats,
    gain: float,
    push: float,
    model: Model,
    bank: Bank,
) -> float:
    """−log likelihood of the fixes of a record under the five-state filter with the rudder as input.

    time, rudder, north, east: (n,), NaN in rows without a fix. `push` is c. The only mode of `model` has α2 = 1/T.
    `bank` is a filter started before the first row: a filter that chooses its own start would make the likelihood
    discontinuous. Every fix is used: the choice of outliers must not depend on the parameters.
    """
    x, p, decay, variance = bank.x[0], bank.p[0], model.modes[0].rate_decay, model.receiver[0].fix_variance
    cost = 0.0
    for k in range(len(time)):
        dt = time[k] - time[k - 1] if k > 0 else 0.0
        if dt > 0.0:
            left, turn, area = decaying(decay, dt)
            wanted = gain * rudder[k - 1] + push
            # The rudder's mean turn within the step changes the path; the rest changes only the course at its end.
            mean = wanted * (0.5 * dt - area / dt)
            x[COURSE] += mean
            advance(bank, model, dt)
            x[COURSE] += wanted * (dt - turn) - mean
            x[RATE] += wanted * (1.0 - left)
        if math.isfinite(north[k]) and math.isfinite(east[k]):
            seen = innovate(x, p, Vec2(north[k], east[k]), variance, 0.0, 0.0)
            correct(x, p, seen.off, seen.s, 1.0, bank.rows[2])
            fill_lower(p)
            density = 2.0 * math.pi * seen.good
            cost += min(-math.log(density), _OUTLIER_COST) if density > 0.0 else _OUTLIER_COST
    return cost
