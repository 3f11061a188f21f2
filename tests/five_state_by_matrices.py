"""The five-state filter in dense matrices, for tests and benchmarks: x ← f(x), P ← F P Fᵀ + Q.

Written from the model alone (constant turn rate over a step, e^{−α t} in closed form), not from the kernels.
"""

import math

import numpy as np

from steerway import Profile

MEASURED = np.eye(5)[:2]
PROFILE = Profile(speed_noise=2e-2, course_rate_noise=3e-3, course_rate_decay=0.3, position_std=0.2)


class ExactTurn:
    """Motion model of [x^n y^n U χ ω] over a step of fixed length, with spectral densities S_U and S_ω."""

    def __init__(self, dt, speed_noise, rate_noise, speed_decay, rate_decay):
        self.speed_left, self.way, _ = responses(speed_decay, dt)
        self.rate_left, self.turn, area = responses(rate_decay, dt)
        self.lean = area / dt
        self.rate_covariance = rate_noise * covariance_of_noise(rate_decay, dt)  # of (ω, χ, ∫χ)
        self.speed_covariance = speed_noise * covariance_of_noise(speed_decay, dt)[1::-1, 1::-1]  # of (way, U)

    def step(self, x):
        """f(x), F and Q at x."""
        u, w = x[2], x[4]
        mean_course, half_turn = x[3] + self.lean * w, 0.5 * self.turn * w
        c, s = math.cos(mean_course), math.sin(mean_course)
        ratio, slope = 1.0 - half_turn**2 / 6.0, -half_turn / 3.0 * (1.0 - half_turn**2 / 10.0)
        if abs(half_turn) > 1e-3:
            ratio = math.sin(half_turn) / half_turn
            slope = (math.cos(half_turn) - ratio) / half_turn
        length = u * self.way * ratio
        along, across = 0.5 * self.turn * slope * u * self.way, self.lean * length
        north, east = length * c, length * s
        moved = np.array([x[0] + north, x[1] + east, u * self.speed_left, x[3] + self.turn * w, w * self.rate_left])
        f = np.array(
            [
                [1.0, 0.0, self.way * ratio * c, -east, along * c - across * s],
                [0.0, 1.0, self.way * ratio * s, north, along * s + across * c],
                [0.0, 0.0, self.speed_left, 0.0, 0.0],
                [0.0, 0.0, 0.0, 1.0, self.turn],
                [0.0, 0.0, 0.0, 0.0, self.rate_left],
            ]
        )
        return moved, f, self._noise(u, c, s)

    def _noise(self, u, c, s):
        """S_U enters the way along (c, s) and the speed, S_ω the rate, the course and, times U, the way across."""
        by_speed = np.array([[c, 0.0], [s, 0.0], [0.0, 1.0], [0.0, 0.0], [0.0, 0.0]])
        by_rate = np.array([[0.0, 0.0, -u * s], [0.0, 0.0, u * c], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
        return by_speed @ self.speed_covariance @ by_speed.T + by_rate @ self.rate_covariance @ by_rate.T


def covariance_of_noise(rate, dt):
    """Covariance of a decaying state and its two integrals after dt of unit white noise (3, 3)."""
    long = rate * dt > 0.1  # where the kernel takes the integral itself
    nodes, weights = np.polynomial.legendre.leggauss(40 if long else 3)
    spent = [responses(rate, 0.5 * dt * (1.0 + node)) for node in nodes]
    return 0.5 * dt * sum(weight * np.outer(each, each) for weight, each in zip(weights, spent, strict=True))


def responses(rate, t):
    """After a unit of a decaying state: it, its integral and the integral of that."""
    a = rate * t
    if a < 1e-2:
        area = t * t * sum((-a) ** k / math.factorial(k + 2) for k in range(8))
    else:
        area = (t + math.expm1(-a) / rate) / rate
    turn = t - rate * area
    return 1.0 - rate * turn, turn, area


def dense(profile, dt):
    """The motion model of a profile."""
    return ExactTurn(dt, profile.speed_noise, profile.course_rate_noise, profile.speed_decay, profile.course_rate_decay)


def winding(n=1500, dt=0.2, seed=1):
    """Fixes (n,) north and east of a boat that winds its way, and their times."""
    rng = np.random.default_rng(seed)
    time = dt * np.arange(n)
    course = np.cumsum(0.25 * np.sin(time / 15.0)) * dt
    speed = 2.5 + np.sin(time / 40.0)
    noise = np.clip(0.2 * rng.standard_normal((2, n)), -0.5, 0.5)
    return time, np.cumsum(speed * np.cos(course)) * dt + noise[0], np.cumsum(speed * np.sin(course)) * dt + noise[1]
