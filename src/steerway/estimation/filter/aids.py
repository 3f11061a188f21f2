"""Correct the modes by other instruments, one scalar measurement at a time.

heading = χ − crab angle, speed through water = U − current along the course, yaw rate = course rate + gyro bias. The
crab angle, the current and the bias may be states, each called the companion of its aid. The receiver's SOG and COG
have slow errors as companions, since receivers filter velocity. SOG and COG together are a vector, also defined at
rest.
"""

import math

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, inlined_kernel
from steerway.estimation.filter.fuse import rate_weights
from steerway.estimation.filter.model import COURSE, RATE, SPEED, Bank, Model
from steerway.estimation.filter.relative import corrected, is_steady
from steerway.estimation.filter.weigh import DECADES, LEAST_OUTLIER
from steerway.estimation.vessel.aids import COG, IS_ANGLE, SIGN_OF, SOG, STATE_OF

_OUTLIER_RATE = 1e-3
"""Share of the measurements of an aid that are outliers. It equals the prior median of the share for fixes."""
_LEAST_SPEED = 0.1
"""Least speed, m/s, at which a heading is used: its Jacobian is 1/U."""


@inlined_kernel
def take_aids(bank: Bank, model: Model, aids: Floats) -> float:
    """Correct by all aids (n,) that are not NaN. Returns their log density."""
    log_density = 0.0
    for which in range(len(aids)):
        if math.isfinite(aids[which]) and math.isfinite(model.aids[which].variance):
            log_density += take_aid(bank, model, aids, which)
    return log_density


@called_kernel
def take_aid(bank: Bank, model: Model, aids: Floats, which: int) -> float:
    """Correct every mode by one of the aids (n,), which may be an outlier. Returns its log density."""
    probability, density, variance = bank.probability, bank.shares[0], model.aids[which].variance
    h, row, error = bank.rows[0], bank.rows[1], bank.rows[2]
    n, total = bank.x.shape[1], 0.0
    for k in range(len(probability)):
        x, p = bank.x[k], bank.p[k]
        innovation = measured(x, p, model, aids, which, h)
        s = variance
        for i in range(n):
            value = 0.0
            for j in range(SPEED, n):
                value += h[j] * p[i, j]
            row[i] = value
        for j in range(SPEED, n):
            s += h[j] * row[j]
        # an outlier may have any size, equally probable in every decade, as for fixes; the predicted spread
        # keeps the density finite for an instrument without noise
        widest = math.sqrt(innovation * innovation + s + LEAST_OUTLIER**2 * variance)
        outlier = _OUTLIER_RATE / (2.0 * DECADES * widest)
        usual = (1.0 - _OUTLIER_RATE) * math.exp(-0.5 * innovation * innovation / s) / math.sqrt(2.0 * math.pi * s)
        density[k] = probability[k] * (usual + outlier)
        total += density[k]
        good = usual / (usual + outlier)
        shift = innovation / s
        spread = good * (1.0 / s - (1.0 - good) * shift * shift)
        for i in range(n):
            error[i] = good * shift * row[i]
            for j in range(n):
                p[i, j] -= spread * row[i] * row[j]
        corrected(x, p, error, len(probability) == 1)
    for k in range(len(probability)):
        probability[k] = density[k] / total
    return math.log(total)


@called_kernel
def measured(x: Floats, p: Floats, model: Model, aids: Floats, which: int, h: Floats) -> float:
    """Innovation of an aid for a mode; h (n,) receives the aid's Jacobian."""
    for j in range(len(x)):
        h[j] = 0.0
    speed, companion = x[SPEED], model.aids[which].companion
    if which == SOG or which == COG:
        whole = math.isfinite(aids[SOG]) and math.isfinite(aids[COG])
        steady = is_steady(speed, p[2, 2], p[3, 3])
        bend = wrap(aids[COG] - x[COURSE]) if math.isfinite(aids[COG]) else 0.0
        error = 0.0
        if companion:
            h[companion] = 1.0
            error = x[companion]
        if which == SOG:
            h[SPEED] = 1.0
            return (aids[SOG] if steady or not whole else aids[SOG] * math.cos(bend)) - speed - error
        h[COURSE] = 1.0
        return (speed * bend if steady or not whole else aids[SOG] * math.sin(bend)) - error
    state, sign = STATE_OF[which], SIGN_OF[which]
    if state == COURSE and speed < _LEAST_SPEED:
        return 0.0
    expected = 0.0
    if state == RATE:
        rate_weights(model.processes, h)
        for j in range(RATE, len(x)):
            expected += h[j] * x[j]
    else:
        h[state] = 1.0 / speed if state == COURSE else 1.0
        expected = x[state]
    if companion:
        h[companion] = sign
        expected += sign * x[companion]
    return wrap(aids[which] - expected) if IS_ANGLE[which] else aids[which] - expected
