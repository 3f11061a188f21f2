"""P2 as printed: the earth-fixed form (4)–(12), its linearisation (14)–(18), the saturation (20) and the control law
(30). For studies and tests; elsewhere use `steerway.control.PositionPID` and `steerway.estimation.positioning`.
"""

import numpy as np


def saturation(speed):
    """(20): min(max(x, 0.5), 0.25), which is 0.25 for every x."""
    return min(max(speed, 0.5), 0.25)


class PrintedPositionPID:
    """(30): τ = K_p x̃ + K_d dx̃/dt + K_i ∫x̃ dt with x̃ = x − x_d, positive gains and no rotation into body axes."""

    def __init__(self, gains):
        self._gains = gains
        self._integral = np.zeros(3)

    def step(self, desired, north, east, heading, velocity, dt) -> np.ndarray:
        """Force (3,) within the limits. `velocity`: rates of north, east and heading; x_d is assumed constant."""
        gains = self._gains
        error = np.array([north, east, heading]) - desired
        self._integral += dt * error
        wanted = gains.proportional @ error + gains.derivative @ velocity + gains.integral @ self._integral
        return np.clip(wanted, -np.array(gains.limit), gains.limit)


def earth_fixed(heading, yaw_rate, inertia, damping):
    """J(η), C(η, η̇) and F(η) of (4)–(7), (3, 3) each: (1)–(2) with ν = Rᵀη̇ inserted, rotated into north and east."""
    turn = _rotation(heading)
    turning = yaw_rate * turn @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    return turn @ inertia @ turn.T, turn @ inertia @ turning.T, turn @ damping @ turn.T


def earth_fixed_force(heading, force, environment=(0.0, 0.0, 0.0), printed=True):
    """τ* of (8), (3,): as printed, without the environment's force (north, east, yaw)."""
    turned = _rotation(heading) @ np.asarray(force, float)
    return turned if printed else turned + environment


def state_matrices(x, inertia, damping, printed=True):
    """A(x) (6, 6) and B(x) (6, 3) of (9)–(12) for x = [η; η̇]; the printed B has the wrong sign."""
    mass, coriolis, drag = earth_fixed(x[2], x[5], inertia, damping)
    inverse = np.linalg.inv(mass)
    a, b = np.zeros((6, 6)), np.zeros((6, 3))
    a[:3, 3:], a[3:, 3:] = np.eye(3), -inverse @ (coriolis + drag)
    b[3:] = -inverse if printed else inverse
    return a, b


def advance(x, force, inertia, damping, step, printed=True):
    """The state a step later. As printed, (15), (17) and (26): A x + B u with the continuous A and B, for any step.
    Corrected: Heun's rule for ẋ = A x + B u.
    """

    def rates(state):
        a, b = state_matrices(state, inertia, damping, printed)
        return a @ state + b @ earth_fixed_force(state[2], force)

    if printed:
        return rates(x)
    first = rates(x)
    return x + 0.5 * step * (first + rates(x + step * first))


def linearised(x, force, inertia, damping):
    """∂f/∂x (6, 6) of (14), by central differences of the corrected f."""
    out, small = np.empty((6, 6)), 1e-6
    for k in range(6):
        ends = []
        for sign in (1.0, -1.0):
            moved = np.array(x, float)
            moved[k] += sign * small
            a, b = state_matrices(moved, inertia, damping, printed=False)
            ends.append(a @ moved + b @ earth_fixed_force(moved[2], force))
        out[:, k] = (ends[0] - ends[1]) / (2.0 * small)
    return out


def observed(compass=False):
    """C of (10), (16) and (18): of the position, (2, 6), as in (13); with a `compass` (3, 6)."""
    return np.eye(6)[: 3 if compass else 2]


def _rotation(heading):
    c, s = np.cos(heading), np.sin(heading)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
