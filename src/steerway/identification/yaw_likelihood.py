"""Likelihood of a record of an angle, or of positions, for a Nomoto vessel with a known rudder.

T ω̇ + ω = K δ + c + white noise, χ̇ = ω: P1 (26)–(27), with c = K b for a rudder bias b. Against the five-state model,
whose course rate decays and is driven by noise, it has the rudder as a known input: 1/T is α2 of P0 (15).
"""

import math

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.estimation.course.motion.five_state import turn_noise, turn_response
from steerway.estimation.course.motion.layout import COURSE, PHASE, RATE, UNDER_WAY
from steerway.estimation.course.tracking import advance, settle, take_fix
from steerway.estimation.course.update.outliers import LOG_2PI

_OUTLIER_COST = 24.0


@kernel
def angle_innovations(
    time: Floats, angle: Floats, rudder: Floats, time_constant: float, ratio: float, out: Floats
) -> None:
    """Innovations of an angle without a rudder, their derivatives to K and c, their variance: out (n, 4).

    time, angle, rudder: (n,), s, unwrapped rad and the rudder that holds from its row to the next. `ratio` is the
    noise density of the rate over the variance of an angle, 1/s³; the variances are in units of the latter. NaN where
    no angle was measured.
    """
    states = np.zeros((3, 2))  # (angle, rate): the estimate, and its response to K and to c
    p_aa, p_ar, p_rr = 1e6, 0.0, 1e6 * max(ratio, 1e-6)
    begun = False
    for k in range(len(time)):
        if k > 0:
            dt = time[k] - time[k - 1]
            left, turn, _ = turn_response(1.0 / time_constant, dt)
            q_rr, q_ar, q_aa, _, _, _ = turn_noise(1.0 / time_constant, dt)
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
    time_constant: float,
    parameters: Floats,
    bank: Floats,
) -> float:
    """−log likelihood of the fixes of a record under the five-state filter with the rudder as input.

    time, rudder, north, east: (n,), NaN where a row is no fix. `push` is c. `parameters` have 1/T for α2. `bank` is
    a filter under way before the first row: a start at the filter's own decision would make the likelihood
    discontinuous.
    """
    n = bank.shape[2]
    x, flags = bank[0, n], bank[0, n + 1]
    cost = 0.0
    for k in range(len(time)):
        if k > 0:
            dt = time[k] - time[k - 1]
            steered = flags[PHASE] == UNDER_WAY
            left, turn, area = turn_response(1.0 / time_constant, dt)
            wanted = gain * rudder[k - 1] + push
            # The mean of the rudder's turn bends the step over ground, the rest changes the course at its end.
            mean = wanted * (0.5 * dt - area / dt) if steered and dt > 0.0 else 0.0
            x[COURSE] += mean
            advance(bank, dt, parameters, bank[:0])
            if steered and flags[PHASE] == UNDER_WAY:
                x[COURSE] += wanted * (dt - turn) - mean
                x[RATE] += wanted * (1.0 - left)
        if not (math.isfinite(north[k]) and math.isfinite(east[k])):
            continue
        _, _, nll = take_fix(bank, north[k], east[k], 1.0, parameters)
        settle(bank, parameters)
        cost += min(nll - LOG_2PI, _OUTLIER_COST)
    return cost
