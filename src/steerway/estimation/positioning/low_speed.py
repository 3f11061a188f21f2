"""Equations of motion of filters for dynamic positioning: M ν̇ + D ν = τ + Rᵀ(ψ) b at low speed.

P2 (1)–(3), kept as state [N E ψ u v r] and a nonlinear f, where the paper changes to [η η̇] and back. With 9 states a
force b on the vessel in north, east and yaw (N, N, N·m) is added, first-order Gauss–Markov. With 13, [ξ_N ξ_E w_N w_E]
are added too: waves shift a fix by w (m), an oscillator of frequency ω₀ and relative damping λ; Fossen, Handbook of
Marine Craft Hydrodynamics and Motion Control, 2nd ed. (2021), section 10.2.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.arrays import Floats
from steerway.core.checks import array_of
from steerway.core.compiled import kernel
from steerway.core.linear_algebra import multiply

HEADING = 2
FORCE = 6
WAVE_INTEGRAL, WAVE = 9, 11
BODY, WITH_FORCE, WITH_WAVES = 6, 9, 13
"""Numbers of states: of the vessel alone, with the force, and with force and waves."""

DAMPING, FORCE_DECAY, WAVE_STIFFNESS, WAVE_DRAG = 9, 18, 19, 20
"""Indices in the model vector. M⁻¹ comes first, row by row; then D, row by row, 1/T_b, ω₀² and 2λω₀."""


def pack(
    inertia: ArrayLike,
    damping: ArrayLike,
    force_time: float = math.inf,
    wave_frequency: float = 0.0,
    wave_damping: float = 0.0,
) -> Floats:
    """The model vector of inertia M and damping D (3, 3), force time constant (s), wave frequency and damping."""
    inverse = np.linalg.inv(array_of("inertia", inertia, (3, 3)))
    rows = array_of("damping", damping, (3, 3)).ravel()
    drag = 2.0 * wave_damping * wave_frequency
    return np.array([*inverse.ravel(), *rows, 1.0 / force_time, wave_frequency**2, drag])


@kernel
def rates(x: Floats, force: Floats, model: Floats, out: Floats) -> None:
    """out ← f(x): the time derivative of the (6, 9 or 13) states under a force τ (3,) in the body."""
    n = len(x)
    c, s = math.cos(x[HEADING]), math.sin(x[HEADING])
    u, v, r = x[3], x[4], x[5]
    push_x, push_y, push_n = force[0], force[1], force[2]
    if n > BODY:
        push_x += c * x[6] + s * x[7]
        push_y += c * x[7] - s * x[6]
        push_n += x[8]
    d = model[DAMPING:]
    push_x -= d[0] * u + d[1] * v + d[2] * r
    push_y -= d[3] * u + d[4] * v + d[5] * r
    push_n -= d[6] * u + d[7] * v + d[8] * r
    out[0] = c * u - s * v
    out[1] = s * u + c * v
    out[2] = r
    for i in range(3):
        out[3 + i] = model[3 * i] * push_x + model[3 * i + 1] * push_y + model[3 * i + 2] * push_n
    for i in range(FORCE, min(n, WITH_FORCE)):
        out[i] = -model[FORCE_DECAY] * x[i]
    for i in range(WAVE_INTEGRAL, min(n, WAVE)):
        out[i] = x[i + 2]
        out[i + 2] = -model[WAVE_STIFFNESS] * x[i] - model[WAVE_DRAG] * x[i + 2]


@kernel
def jacobian(x: Floats, model: Floats, out: Floats) -> None:
    """out ← ∂f/∂x at x, (n, n)."""
    n = len(x)
    out[:] = 0.0
    c, s = math.cos(x[HEADING]), math.sin(x[HEADING])
    u, v = x[3], x[4]
    out[0, 2], out[0, 3], out[0, 4] = -s * u - c * v, c, -s
    out[1, 2], out[1, 3], out[1, 4] = c * u - s * v, s, c
    out[2, 5] = 1.0
    for i in range(3):
        for j in range(3):
            for k in range(3):
                out[3 + i, 3 + j] -= model[3 * i + k] * model[DAMPING + 3 * k + j]
    if n > BODY:
        b_x, b_y = c * x[6] + s * x[7], c * x[7] - s * x[6]
        for i in range(3):
            out[3 + i, 2] = model[3 * i] * b_y - model[3 * i + 1] * b_x
            out[3 + i, 6] = model[3 * i] * c - model[3 * i + 1] * s
            out[3 + i, 7] = model[3 * i] * s + model[3 * i + 1] * c
            out[3 + i, 8] = model[3 * i + 2]
            out[FORCE + i, FORCE + i] = -model[FORCE_DECAY]
    for i in range(WAVE_INTEGRAL, min(n, WAVE)):
        out[i, i + 2] = 1.0
        out[i + 2, i] = -model[WAVE_STIFFNESS]
        out[i + 2, i + 2] = -model[WAVE_DRAG]


@kernel
def advance_mean(x: Floats, force: Floats, model: Floats, dt: float, middle: Floats) -> None:
    """x ← x after dt by Runge and Kutta's fourth-order method; middle ← x after dt/2. No angle is wrapped.

    The mean is integrated by f itself. The printed x ← A x + B u (26) with a continuous A is not a step in time.
    """
    n = len(x)
    k1, k2, k3, k4 = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    rates(x, force, model, k1)
    rates(x + 0.5 * dt * k1, force, model, k2)
    middle[:] = x + 0.5 * dt * k2
    rates(middle, force, model, k3)
    rates(x + dt * k3, force, model, k4)
    for i in range(n):
        x[i] += dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])


@kernel
def transition(middle: Floats, model: Floats, dt: float, phi: Floats, f: Floats, product: Floats) -> None:
    """phi ← Φ = I + hF (I + hF/2 (I + hF/3 (I + hF/4))), the exponential of h times the Jacobian F halfway."""
    n = len(middle)
    jacobian(middle, model, f)
    phi[:] = 0.0
    for i in range(n):
        phi[i, i] = 1.0
    for order in range(4, 0, -1):
        multiply(f, phi, product)
        for i in range(n):
            for j in range(n):
                phi[i, j] = dt / order * product[i, j]
            phi[i, i] += 1.0


@kernel
def spread(p: Floats, phi: Floats, noise: Floats, dt: float, product: Floats) -> None:
    """P ← Φ P Φᵀ + Q_d in place, upper triangle; `noise` (n,) holds spectral densities.

    Q_d = h/2 (Φ Q Φᵀ + Q), so that the rate of a filter does not change its estimates; (27) adds a 3 × 3
    matrix without a unit or a step to a 6 × 6 one.
    """
    n = len(noise)
    for i in range(n):
        p[i, i] += 0.5 * dt * noise[i]
        for j in range(i):
            p[i, j] = p[j, i]
    multiply(phi, p, product)
    for i in range(n):
        for j in range(i, n):
            total = 0.0
            for k in range(n):
                total += product[i, k] * phi[j, k]
            p[i, j] = total
        p[i, i] += 0.5 * dt * noise[i]
