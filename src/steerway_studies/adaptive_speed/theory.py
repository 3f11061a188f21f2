"""The paper's two arguments put to the test: Lyapunov's function for (17)–(21), and a boat that goes straight."""

import math
from dataclasses import dataclass

import numpy as np

from steerway.vessels import CALM, Caldas, runge_kutta
from steerway.vessels import propeller_thrust as thrust
from steerway_studies.adaptive_speed import sailing
from steerway_studies.papers.speed_mrac import PRINTED_GUESS

RATE, GAMMA = 0.1, 0.5
_STEP = 0.005


@dataclass(frozen=True)
class Descent:
    """V of (19) along a run and its derivative, beside the −d_m z² of (21); arrays (n,)."""

    time: np.ndarray
    value: np.ndarray
    derivative: np.ndarray
    claimed: np.ndarray


def descent(setpoint: float, constant: bool, duration: float = 60.0) -> Descent:
    """The closed loop (13)–(18) in continuous time, with g constant or as the propeller has it."""
    d, b = sailing.NOMINAL.linear_drag, sailing.NOMINAL.quadratic_drag
    curve = sailing.NOMINAL.curve()
    d0, b0, g0 = PRINTED_GUESS

    def square(x):
        u = x[0]
        return max(0.0, x[2] * setpoint + x[3] * u + x[4] * u * abs(u))

    def thrust_gain(x):
        if constant:
            return g0
        shaft = math.sqrt(square(x))
        return thrust(x[0], shaft, curve) / square(x) if shaft > 0.0 else g0

    def rates(x):
        u, model = x[0], x[1]
        z = u - model
        drive = thrust_gain(x) * square(x)
        return np.array(
            [
                -d * u - b * u * abs(u) + drive,
                RATE * (setpoint - model),
                -GAMMA * z * setpoint,
                -GAMMA * z * u,
                -GAMMA * z * u * abs(u),
            ]
        )

    def lyapunov(x):
        g = thrust_gain(x)
        ideal = np.array([RATE, d - RATE, b]) / g
        wrong = x[2:] - ideal
        return 0.5 * (x[0] - x[1]) ** 2 + 0.5 * g / GAMMA * float(wrong @ wrong)

    n = round(duration / _STEP)
    x = np.array([0.0, 0.0, RATE / g0, (d0 - RATE) / g0, b0 / g0])
    values, claimed = np.empty(n), np.empty(n)
    for k in range(n):
        values[k], claimed[k] = lyapunov(x), -RATE * (x[0] - x[1]) ** 2
        x = runge_kutta(rates, x, _STEP)
    return Descent(_STEP * np.arange(n), values, np.gradient(values, _STEP), claimed)


def straight_run(speed: float):
    """(boat, state) of the three-degree-of-freedom boat going straight at a speed."""
    from scipy.optimize import brentq

    boat = sailing.plant("T")
    state = Caldas().start(speed=speed)
    state[6] = brentq(lambda shaft: boat.acceleration(speed, shaft), 1.0, 30.0)
    return Caldas(), state


def lateral_matrix(speed: float, stiffness: float = 0.0) -> np.ndarray:
    """(3, 3) of heading, sway and yaw rate about a straight run, with a yaw moment −stiffness · heading (N·m/rad)."""
    boat, state = straight_run(speed)
    places, h = (2, 4, 5), 1e-6
    columns = []
    for place in places:
        sides = []
        for sign in (1.0, -1.0):
            moved = state.copy()
            moved[place] += sign * h
            sides.append(boat.rates(moved, -stiffness * moved[2], CALM)[list(places)])
        columns.append((sides[0] - sides[1]) / (2.0 * h))
    return np.stack(columns, axis=1)


def growth(speed: float, stiffness: float = 0.0) -> float:
    """The largest real part (1/s) of the lateral eigenvalues."""
    return float(np.linalg.eigvals(lateral_matrix(speed, stiffness)).real.max())


def least_stiffness(speed: float) -> float:
    """The heading gain (N·m/rad) above which nothing grows, by bisection."""
    low, high = 0.0, 50e3 * speed**2
    while high - low > 1e-4 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if growth(speed, middle) > 1e-3 * speed else (low, middle)
    return high
