"""Weighted hypotheses of the current: estimate, deviations and pruning."""

import math
from typing import NamedTuple

import numpy as np

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.estimate import Estimate
from steerway.core.kinematics import turning_rate
from steerway.estimation.steering.correction import velocity_of
from steerway.estimation.steering.motion import (
    CURRENT_E,
    CURRENT_N,
    DAMPING,
    EAST,
    GAIN,
    HEADING,
    MADE_UP,
    NORTH,
    SLIP,
    SPEED_GAIN,
    TIME,
    WATER_SPEED,
    YAW_RATE,
    yaw_bias,
)

_IMPROBABLE = -9.0
"""Log weight, relative to the most probable hypothesis, below which a hypothesis is dropped: a ratio of 1.2·10⁻⁴.
Chosen: dropping it moves the mean by less than this share of the distance to it."""
_RATE_SHARE = 0.15
"""1σ of the course rate that the hull's changing slip adds at the beginning and end of a turn, as a share of the course
rate. Chosen on ten seeds of `otter-mission`: in turns of 5 °/s and more the error was 1.1 °/s RMS, but σ 0.3."""


class Mixture(NamedTuple):
    """Hypotheses: states (m, 21) of `motion`, their covariances (m, 21, 21) and logarithms of their weights (m,)."""

    states: Floats
    covariances: Floats
    weights: Floats

    @property
    def best(self) -> int:
        """Index of the most probable hypothesis."""
        return int(np.argmax(self.weights))

    def pruned(self, near: float) -> "Mixture":
        """The mixture without improbable hypotheses and without those near a more probable one: within `near` (m/s) of
        its current and 0.05 rad of its heading.
        """
        top = self.weights.max()
        kept: list[int] = []
        for k in np.argsort(-self.weights):
            is_near = any(_alike(self.states[k], self.states[j], near) for j in kept)
            if self.weights[k] > top + _IMPROBABLE and not is_near:
                kept.append(int(k))
        weights = self.weights[kept]
        weights = weights - (weights.max() + np.log(np.sum(np.exp(weights - weights.max()))))
        return Mixture(self.states[kept], self.covariances[kept], weights)

    def heading_std(self) -> float:
        """1σ (rad) of the heading of all hypotheses about the heading of the best one."""
        share = np.exp(self.weights)
        apart = np.array([wrap(each - self.states[self.best, HEADING]) for each in self.states[:, HEADING]])
        return math.sqrt(float(np.sum(share * (self.covariances[:, HEADING, HEADING] + apart**2))))

    def current_std(self) -> float:
        """1σ (m/s) of the current of all hypotheses about that of the best one, in its least certain direction."""
        share = np.exp(self.weights)
        apart = self.states[:, CURRENT_N : CURRENT_E + 1] - self.states[self.best, CURRENT_N : CURRENT_E + 1]
        within = self.covariances[:, CURRENT_N : CURRENT_E + 1, CURRENT_N : CURRENT_E + 1]
        (nn, ne), (_, ee) = np.einsum("m,mij->ij", share, within + apart[:, :, None] * apart[:, None, :])
        return math.sqrt(0.5 * (nn + ee) + math.hypot(0.5 * (nn - ee), ne))


def _alike(one: Floats, other: Floats, near: float) -> bool:
    current = math.hypot(one[CURRENT_N] - other[CURRENT_N], one[CURRENT_E] - other[CURRENT_E])
    return current < near and abs(wrap(one[HEADING] - other[HEADING])) < 0.05


def over_ground(x: Floats) -> tuple[float, float]:
    """Velocity over ground, north and east."""
    c, s, u = math.cos(x[HEADING]), math.sin(x[HEADING]), x[WATER_SPEED]
    return float(x[CURRENT_N] + u * c), float(x[CURRENT_E] + u * s)


def estimate_of(x: Floats, p: Floats, heading_std: float, current_std: float, age: float, pivot: float) -> Estimate:
    """The estimate of a state and its covariance, `age` s after the fix; pivot: see `Response`."""
    c, s = math.cos(x[HEADING]), math.sin(x[HEADING])
    u, rate = x[WATER_SPEED], x[YAW_RATE]
    north, east, along, across = velocity_of(x, p, pivot)
    acceleration = rate * (pivot * rate * c - u * s), rate * (pivot * rate * s + u * c)
    sog, cog = math.hypot(north, east), math.atan2(east, north)
    course_rate = turning_rate(north, east, *acceleration) if sog > 0.0 else 0.0
    turned = u * (north * c + east * s) / max(sog * sog, 1e-6)  # course rate of a unit of yaw rate
    rate_std = math.hypot(turned * math.sqrt(max(p[YAW_RATE, YAW_RATE], 0.0)), _RATE_SHARE * course_rate)
    position_std = math.sqrt(max(0.5 * (p[NORTH, NORTH] + p[EAST, EAST]), 0.0))
    position_std += math.hypot(along, across) * max(age, 0.0)
    return Estimate(
        float(x[NORTH]) - pivot * c,
        float(x[EAST]) - pivot * s,
        sog,
        cog,
        course_rate,
        along,
        min(math.pi, across / max(sog, 1e-6)),
        rate_std,
        position_std,
        wrap(float(x[HEADING])),
        float(rate),
        heading_std,
        float(u),
        float(x[CURRENT_N]),
        float(x[CURRENT_E]),
        yaw_bias(x),
        float(x[SPEED_GAIN]),
        float(x[GAIN]),
        float(x[DAMPING]),
        float(x[TIME]),
        current_std,
        position_std,
        float(x[SLIP]),
        min(1.0, max(0.0, float(x[MADE_UP]))),
    )
