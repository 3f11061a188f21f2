"""Kalman's update by a scalar and by a position, for every filter of this package but those with several modes.

Filters that take positions have north and east as their first two states. A fix may have errors besides white noise,
of the receiver or by waves: pairs of states (north, east) from state g on. The kernels read and write the upper
triangle of a covariance.
"""

from steerway.core.arrays import Floats
from steerway.core.compiled import lean_kernel
from steerway.core.statistics import AID_GATE


@lean_kernel
def innovation(
    x: Floats, p: Floats, north: float, east: float, north_variance: float, east_variance: float, g: int, pairs: int = 1
) -> tuple[float, float, float, float, float]:
    """Innovation of a fix and its covariance: (ν_N, ν_E, S_NN, S_NE, S_EE).

    A fix is the position, plus the pairs of states from g on unless g is 0, plus white noise of the two variances (m²).
    """
    nu_n, nu_e = north - x[0], east - x[1]
    s_nn, s_ne, s_ee = p[0, 0] + north_variance, p[0, 1], p[1, 1] + east_variance
    if g:
        for n in range(g, g + 2 * pairs, 2):
            e = n + 1
            nu_n -= x[n]
            nu_e -= x[e]
            s_nn += 2.0 * p[0, n] + p[n, n]
            s_ne += p[0, e] + p[1, n] + p[n, e]
            s_ee += 2.0 * p[1, e] + p[e, e]
            for m in range(g, n, 2):
                s_nn += 2.0 * p[m, n]
                s_ne += p[m, e] + p[m + 1, n]
                s_ee += 2.0 * p[m + 1, e]
    return nu_n, nu_e, s_nn, s_ne, s_ee


@lean_kernel
def normalised_square(nu_n: float, nu_e: float, s_nn: float, s_ne: float, s_ee: float) -> float:
    """NIS of a fix, νᵀ S⁻¹ ν."""
    return (nu_n * nu_n * s_ee - 2.0 * nu_n * nu_e * s_ne + nu_e * nu_e * s_nn) / (s_nn * s_ee - s_ne * s_ne)


@lean_kernel
def correct(
    x: Floats,
    p: Floats,
    work: Floats,
    nu_n: float,
    nu_e: float,
    s_nn: float,
    s_ne: float,
    s_ee: float,
    g: int,
    pairs: int = 1,
) -> None:
    """Gain, state and covariance corrector of Table 1 (S. Fossen and T. I. Fossen, Sensors 21, 2021, 7910) in place.

    Joseph's form: P − K(CP) − (CP)ᵀKᵀ + K S Kᵀ.
    """
    n = len(x)
    determinant = s_nn * s_ee - s_ne * s_ne
    i_nn, i_ne, i_ee = s_ee / determinant, -s_ne / determinant, s_nn / determinant
    pc_n, pc_e, k_n, k_e = work[0], work[1], work[2], work[3]
    for i in range(n):
        pc_n[i] = p[0, i]
        pc_e[i] = p[min(1, i), max(1, i)]
        if g:
            for n_state in range(g, g + 2 * pairs, 2):
                pc_n[i] += p[min(n_state, i), max(n_state, i)]
                pc_e[i] += p[min(n_state + 1, i), max(n_state + 1, i)]
        k_n[i] = pc_n[i] * i_nn + pc_e[i] * i_ne
        k_e[i] = pc_n[i] * i_ne + pc_e[i] * i_ee
        x[i] += k_n[i] * nu_n + k_e[i] * nu_e
    for i in range(n):
        left_n = k_n[i] * s_nn + k_e[i] * s_ne - pc_n[i]
        left_e = k_n[i] * s_ne + k_e[i] * s_ee - pc_e[i]
        for j in range(i, n):
            p[i, j] += left_n * k_n[j] + left_e * k_e[j] - k_n[i] * pc_n[j] - k_e[i] * pc_e[j]


@lean_kernel
def place_by_fix(p: Floats, north_variance: float, east_variance: float, g: int, pairs: int = 1) -> None:
    """Covariance of a position that is set to a fix less the error states (from g on, unless g is 0).

    Its error is that of the fix less that of the error states, so that its covariance with every other state is minus
    theirs; else P would not be positive semidefinite.
    """
    n = p.shape[1]
    for k in range(2):
        for i in range(k):
            p[i, k] = 0.0
        for j in range(k + 1, n):
            p[k, j] = 0.0
        p[k, k] = north_variance if k == 0 else east_variance
    if g:
        for k in range(2):
            for j in range(2, n):
                for i in range(g + k, g + 2 * pairs, 2):
                    p[k, j] -= p[min(i, j), max(i, j)]
        for i in range(g, g + 2 * pairs, 2):
            for j in range(g, g + 2 * pairs, 2):
                p[0, 0] += p[min(i, j), max(i, j)]
                p[0, 1] += p[min(i, j + 1), max(i, j + 1)]
                p[1, 1] += p[min(i, j) + 1, max(i, j) + 1]


@lean_kernel
def scalar_innovation(p: Floats, work: Floats, i: int, companion: int, sign: float, variance: float) -> float:
    """Variance of the innovation of a measurement of x[i] + sign · x[companion] (companion 0: none).

    Leaves in work[0] (n,) the covariance of the state with what is measured.
    """
    pc = work[0]
    for j in range(len(pc)):
        pc[j] = p[min(i, j), max(i, j)]
        if companion:
            pc[j] += sign * p[min(companion, j), max(companion, j)]
    return pc[i] + variance + sign * pc[companion] if companion else pc[i] + variance


@lean_kernel
def correct_scalar(
    x: Floats,
    p: Floats,
    work: Floats,
    i: int,
    companion: int,
    sign: float,
    innovation: float,
    variance: float,
    gate: float = AID_GATE,
) -> float:
    """Correct by a measurement of x[i] + sign · x[companion] (companion 0: none) unless the gate refuses it.

    Joseph's form for a scalar. Returns the NIS: above the gate the measurement was not used.
    """
    pc, k = work[0], work[1]
    s = scalar_innovation(p, work, i, companion, sign, variance)
    return take_scalar(x, p, pc, k, s, innovation, gate)


@lean_kernel
def take_scalar(
    x: Floats, p: Floats, pc: Floats, k: Floats, s: float, innovation: float, gate: float = AID_GATE
) -> float:
    """Correct by a scalar with covariances pc = P hᵀ (n,) and variance s, unless the gate refuses it; k is workspace.

    Reads and writes the upper triangle of P. Returns the NIS: above the gate the measurement was not used.
    """
    n = len(x)
    nis = innovation * innovation / s
    if nis > gate:
        return nis
    for j in range(n):
        k[j] = pc[j] / s
        x[j] += k[j] * innovation
    for a in range(n):
        for b in range(a, n):
            p[a, b] += k[a] * k[b] * s - k[a] * pc[b] - pc[a] * k[b]
    return nis
