"""The contestant: a plain five-state EKF with one motion model and white noise; its four numbers are fitted to the log.

State [north, east, U, χ, ω]: U is a random walk, ω an Ornstein–Uhlenbeck process; there is no gate. A careful engineer
writes such a filter in an afternoon. (P0 §3 with spectral densities; maximum likelihood of the innovations.)
"""

import math

import numpy as np
from scipy.optimize import minimize

from steerway.core import kernel

_LONGEST_STEP = 1.0
_START_SPAN = 5.0  # s of the straight line from which the filter starts
_MOST_FITTED = 2500
_EVALUATIONS = 250
_FIRST_STEP = 1.5  # of the simplex, in logarithms
_DECAY_RANGE = 1e-3, 3.0
_DECAY_PRIOR = 0.2, 1.5  # median, σ of the logarithm
_LOG_RANGE = -25.0, 6.0
_MOTIONS = (1e-3, 1e-3, 0.2), (1e-2, 1e-1, 0.2), (1e-4, 1e-6, 0.05), (1e-1, 1e-3, 0.2), (1.0, 1.0, 0.5)
_VARIANCES = 1e-4, 0.01, 0.25, 4.0


@kernel
def _predict(x, p, f, q, dt, speed_noise, rate_noise, decay):
    """One step: the course turns by the mean rate; Q integrates the two white noises along and across the track."""
    left = math.exp(-decay * dt)
    turn = (1.0 - left) / decay
    c, s = math.cos(x[3] + 0.5 * turn * x[4]), math.sin(x[3] + 0.5 * turn * x[4])
    way = x[2] * dt
    f[0, 2], f[0, 3], f[0, 4] = dt * c, -way * s, -0.5 * turn * way * s
    f[1, 2], f[1, 3], f[1, 4] = dt * s, way * c, 0.5 * turn * way * c
    f[3, 4], f[4, 4] = turn, left
    x[0] += way * c
    x[1] += way * s
    x[3] += turn * x[4]
    x[4] *= left
    along, across = speed_noise * dt**3 / 3.0, rate_noise * x[2] ** 2 * dt**5 / 20.0
    q[0, 0], q[1, 1], q[0, 1] = along * c * c + across * s * s, along * s * s + across * c * c, (along - across) * s * c
    q[2, 2], q[3, 3], q[4, 4], q[3, 4] = (
        speed_noise * dt,
        rate_noise * dt**3 / 3.0,
        rate_noise * dt,
        rate_noise * dt**2 / 2,
    )
    for i, direction in ((0, c), (1, s)):
        q[i, 2] = speed_noise * dt**2 / 2.0 * direction
    for i, direction in ((0, -s), (1, c)):
        q[i, 3] = rate_noise * x[2] * dt**4 / 8.0 * direction
        q[i, 4] = rate_noise * x[2] * dt**3 / 6.0 * direction
    p[:] = f @ p @ f.T
    for i in range(5):
        p[i, i] += q[i, i]
        for j in range(i + 1, 5):
            p[i, j] += q[i, j]
            p[j, i] = p[i, j]


@kernel
def _correct(x, p, north, east, variance):
    """Correct by a position; returns its −log likelihood, without the constant."""
    v0, v1 = north - x[0], east - x[1]
    s00, s01, s11 = p[0, 0] + variance, p[0, 1], p[1, 1] + variance
    determinant = s00 * s11 - s01 * s01
    nis = (s11 * v0 * v0 - 2.0 * s01 * v0 * v1 + s00 * v1 * v1) / determinant
    gain = np.empty((5, 2))
    for i in range(5):
        gain[i, 0] = (p[i, 0] * s11 - p[i, 1] * s01) / determinant
        gain[i, 1] = (p[i, 1] * s00 - p[i, 0] * s01) / determinant
    measured = p[:2, :].copy()
    for i in range(5):
        x[i] += gain[i, 0] * v0 + gain[i, 1] * v1
        for j in range(i, 5):
            p[i, j] -= gain[i, 0] * measured[0, j] + gain[i, 1] * measured[1, j]
            p[j, i] = p[i, j]
    if x[2] < 0.0:  # a negative speed is a positive one on the opposite course
        x[2] = -x[2]
        x[3] += math.pi
        p[2, :] = -p[2, :]
        p[:, 2] = -p[:, 2]
    return 0.5 * (nis + math.log(determinant))


@kernel
def run(time, places, speed_noise, rate_noise, decay, variance, said):
    """Filter a record; returns the −log likelihood of its innovations.

    Args:
        time: (n,) s. places: (n, 2) north, east, m.
        speed_noise: S_U, m²/s³. rate_noise: S_ω, rad²/s³. decay: of ω, 1/s. variance: of a fix, m².
        said: (n, 6), filled with U, χ, ω and their standard deviations; NaN until the filter has started.
    """
    first = 1
    while first < len(time) - 1 and time[first] - time[0] < _START_SPAN:
        first += 1
    said[: first + 1] = np.nan
    span = time[first] - time[0]
    north, east = places[first, 0] - places[0, 0], places[first, 1] - places[0, 1]
    x = np.array([places[first, 0], places[first, 1], math.hypot(north, east) / span, math.atan2(east, north), 0.0])
    p = np.diag(np.array([variance, variance, 0.25 + 2.0 * variance / span**2, 1.0, 0.1]))
    f, q = np.eye(5), np.zeros((5, 5))
    cost = 0.0
    for k in range(first + 1, len(time)):
        whole = time[k] - time[k - 1]
        steps = math.ceil(whole / _LONGEST_STEP - 1e-6)
        for _ in range(steps):
            _predict(x, p, f, q, whole / steps, speed_noise, rate_noise, decay)
        cost += _correct(x, p, places[k, 0], places[k, 1], variance)
        for i in range(3):
            said[k, i] = x[2 + i]
            said[k, 3 + i] = math.sqrt(max(p[2 + i, 2 + i], 0.0))
    return cost


def fitted(time, places) -> np.ndarray:
    """(n, 6) U, χ (not wrapped), ω and their standard deviations, with the four numbers of greatest likelihood.

    Fitted to at most 2,500 rows in the middle. time: (n,) s, not decreasing; places: (n, 2) north and east, m.
    """
    places = np.ascontiguousarray(places)
    start = max((len(time) - _MOST_FITTED) // 2, 0)
    rows = slice(start, start + _MOST_FITTED)
    scratch = np.empty((len(time[rows]), 6))
    median, deviation = _DECAY_PRIOR

    def cost(logarithms):
        numbers = _numbers(logarithms)
        value = (
            run(time[rows], places[rows], *numbers, scratch) + 0.5 * (math.log(numbers[2] / median) / deviation) ** 2
        )
        return value if math.isfinite(value) else 1e12

    start = min((np.log([*motion, r]) for motion in _MOTIONS for r in _VARIANCES), key=cost)
    simplex = np.vstack([start, start + _FIRST_STEP * np.eye(4)])
    found = minimize(cost, start, method="Nelder-Mead", options={"maxfev": _EVALUATIONS, "initial_simplex": simplex})
    said = np.empty((len(time), 6))
    run(time, places, *_numbers(found.x), said)
    return said


def _numbers(logarithms):
    """The four numbers from their logarithms, within plausible ranges."""
    speed_noise, rate_noise, decay, variance = np.exp(np.clip(logarithms, *_LOG_RANGE)).tolist()
    return speed_noise, rate_noise, min(max(decay, _DECAY_RANGE[0]), _DECAY_RANGE[1]), variance
