"""The first hypotheses: what current and which heading the first fixes may mean."""

import math
from collections.abc import Sequence

import numpy as np

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.estimation.steering.motion import (
    BIAS,
    CURRENT_E,
    CURRENT_N,
    DAMPING,
    DEVIATION,
    EAST,
    GAIN,
    GYRO,
    HEADING,
    MADE_UP,
    NORTH,
    SLIP,
    SPEED_GAIN,
    STATES,
    SWAY,
    TIME,
    WATER_SPEED,
    WIND_E,
    WIND_N,
    YAW_RATE,
)
from steerway.estimation.steering.prediction import DEVIATION_STD
from steerway.estimation.steering.response import Response

_DIRECTIONS = 8
_SHARES = 0.45, 0.9
"""Directions of currents that are tried, or headings at rest, and sizes in shares of the usual speed. Chosen: a heading
has half of the distance between two directions for its 1σ."""
_MOVING, _SLOW = 4.0, 0.15
"""Standard deviations, and share of the usual speed, from which on a velocity may be one through the water.
Chosen: the deviations are as of `course.steerageway.COURSE_GAINED`."""
_REST_STD, _CURRENT_STD = 0.05, 0.1
"""1σ of the speed through the water of a boat at rest, and of the current beside its drift, in shares of the usual
speed. Chosen: where 0, 0.1 or 0.2 m/s of a drift of 1 m/s was wind, a boat of 2 m/s finds the current to 0.12, 0.12 and
0.13 m/s RMS 5 s after it departs, all within 2σ; with half of it to 0.10, 0.11 and 0.14, 92 %.
"""
_GYRO_STD = math.radians(0.3)
"""rad/s of the bias of a gyro. Chosen: vehicles calibrate theirs at the start."""
_MADE_UP_STD = 0.5
"""1σ of the share of the current that a vehicle's own speed loop makes up. Chosen: some hold their throttle."""
_DRIFTS, _STANDS = 1.0, 3.0
"""Costs (−log probability) of a boat that moves with the current alone, and of one that stands still over ground by
stemming it. Chosen: weights of 0.37 and 0.05."""


def straight_line(
    time: Floats, north: Floats, east: Floats, std: float
) -> tuple[tuple[float, float], tuple[float, float], float, float]:
    """(position, velocity, position's 1σ, velocity's 1σ) at the last of the fixes (n,), n ≥ 2, by least squares."""
    t = np.asarray(time) - time[-1]
    mean = t.mean()
    spread = float(np.sum((t - mean) ** 2))
    velocity = [float(np.sum((t - mean) * axis) / spread) for axis in (np.asarray(north), np.asarray(east))]
    place = [float(np.mean(axis) - v * mean) for axis, v in zip((north, east), velocity, strict=True)]
    place_std = std * math.sqrt(1.0 / len(t) + float(mean) ** 2 / spread)
    return (place[0], place[1]), (velocity[0], velocity[1]), place_std, std / math.sqrt(spread)


def hypotheses(
    place: Sequence[float],
    velocity: Sequence[float],
    place_std: float,
    velocity_std: float,
    response: Response,
    way: float = math.inf,
    is_driven: bool = False,
    changes: float = 0.0,
) -> tuple[Floats, Floats, Floats]:
    """(states (m, 21), covariances (m, 21, 21), log weights (m,)) for a first position (m) and velocity (m/s).

    A moving boat: for currents of all directions the motion through the water that is left. A boat at rest in the
    water: any heading. `way`: 1σ of the speed through the water (m/s) of a boat whose motor idles, which is then known
    to be at rest in the water: its drift is the current. See `drifting`. is_driven: whether the motor drives the boat,
    which is then hardly at rest. changes: 1σ of the change of the velocity since the fixes that gave it, m/s.
    """
    directions = [math.tau * k / _DIRECTIONS for k in range(_DIRECTIONS)]
    moving = math.hypot(*velocity) > max(_MOVING * velocity_std, _SLOW * response.speed)
    velocity_std = math.hypot(velocity_std, changes)
    # At rest in the water: the current is what is seen.
    rests = _STANDS if is_driven else _DRIFTS if moving else 0.0
    found = [((velocity[0], velocity[1]), 0.0, a, rests) for a in directions]
    stands = 0.0 if moving or is_driven else _STANDS
    currents = [(0.0, 0.0)]
    currents += [(k * response.speed, a) for k in _SHARES for a in directions]
    for size, towards in currents if math.isinf(way) else ():
        current = size * math.cos(towards), size * math.sin(towards)
        water = velocity[0] - current[0], velocity[1] - current[1]
        speed = math.hypot(*water)
        if 0.25 * response.speed < speed < 1.1 * response.top_speed:
            unusual = (speed - response.speed) / (0.4 * response.speed)
            cost = 0.5 * ((size / (response.current * response.speed)) ** 2 + unusual**2)
            found.append((current, speed, math.atan2(water[1], water[0]), cost + stands))
    states = np.zeros((len(found), STATES))
    covariances = np.zeros((len(found), STATES, STATES))
    for x, p, (current, speed, course, _) in zip(states, covariances, found, strict=True):
        x[[NORTH, EAST, CURRENT_N, CURRENT_E, WATER_SPEED, HEADING]] = *place, *current, speed, wrap(course)
        x[NORTH] += response.pivot * math.cos(course)
        x[EAST] += response.pivot * math.sin(course)
        x[GAIN] = x[TIME] = x[SPEED_GAIN] = 1.0
        x[SLIP], x[MADE_UP] = response.slip_time, float(response.over_ground)
        _spread(x, p, place_std, velocity_std, response, way)
    weights = -np.array([cost for *_, cost in found])
    return states, covariances, weights - np.log(np.sum(np.exp(weights)))


def drifting(states: Floats, covariances: Floats, way: float) -> None:
    """States (m, 21) and covariances (m, 21, 21), in place, of a boat whose motor idles: what is left of its speed
    through the water is 0 but for a 1σ of `way` (m/s), and its velocity over ground the current.
    """
    for k in (WATER_SPEED, SWAY):
        states[:, k] = covariances[:, k] = covariances[..., k] = 0.0
    covariances[:, WATER_SPEED, WATER_SPEED] = way**2


def departing(covariances: Floats, response: Response) -> None:
    """Covariances (m, 21, 21), in place, of a boat that no longer drifts: how far its drift was wind is uncertain."""
    for k in (CURRENT_N, CURRENT_E):
        covariances[:, k, k] += (_CURRENT_STD * response.speed) ** 2
    covariances[:, WATER_SPEED, WATER_SPEED] += (_REST_STD * response.speed) ** 2


def forget_speed_gain(states: Floats, covariances: Floats, response: Response) -> None:
    """Reset the speed gain of states (m, 21) and covariances (m, 21, 21) to its prior, in place.

    The gain between throttle and speed is not the gain between ordered and actual speed.
    """
    states[:, SPEED_GAIN] = 1.0
    covariances[:, SPEED_GAIN] = covariances[..., SPEED_GAIN] = 0.0
    covariances[:, SPEED_GAIN, SPEED_GAIN] = response.speed_gain_std**2


def any_heading(x: Floats, p: Floats, response: Response, way: float = math.inf) -> tuple[Floats, Floats, Floats]:
    """(states, covariances, log weights) as of `hypotheses`, for a state (21,) and covariance (20, 21) at rest.

    Its velocity over ground becomes the current, in a drift it is that; what is known of its response is kept.
    """
    drifts = math.isfinite(way)
    c, s, u = math.cos(x[HEADING]), math.sin(x[HEADING]), 0.0 if drifts else x[WATER_SPEED]
    f = np.eye(STATES)
    if not drifts:
        f[CURRENT_N, [WATER_SPEED, HEADING]] = c, -u * s
        f[CURRENT_E, [WATER_SPEED, HEADING]] = s, u * c
    f[[WATER_SPEED, SWAY, HEADING, YAW_RATE]] = 0.0
    state = f @ x
    state[[CURRENT_N, CURRENT_E]] = x[CURRENT_N] + u * c, x[CURRENT_E] + u * s
    covariance = f @ p @ f.T
    beside, rest = _at_rest(response, way)
    for k in (CURRENT_N, CURRENT_E):
        covariance[k, k] += beside**2
    covariance[WATER_SPEED, WATER_SPEED] = rest**2
    covariance[HEADING, HEADING] = (math.pi / _DIRECTIONS) ** 2
    covariance[YAW_RATE, YAW_RATE] = (response.manual * response.rate) ** 2
    states = np.tile(state, (_DIRECTIONS, 1))
    states[:, HEADING] = [wrap(math.tau * k / _DIRECTIONS) for k in range(_DIRECTIONS)]
    states[:, NORTH] += response.pivot * (np.cos(states[:, HEADING]) - c)
    states[:, EAST] += response.pivot * (np.sin(states[:, HEADING]) - s)
    return states, np.tile(covariance, (_DIRECTIONS, 1, 1)), np.full(_DIRECTIONS, -math.log(_DIRECTIONS))


def _at_rest(response: Response, way: float) -> tuple[float, float]:
    """1σ of the current beside the velocity over ground, and of the speed through the water, m/s."""
    return (0.0, way) if math.isfinite(way) else (_CURRENT_STD * response.speed, _REST_STD * response.speed)


def _spread(x: Floats, p: Floats, place_std: float, velocity_std: float, response: Response, way: float) -> None:
    """Current and motion through the water are uncertain, less so their sum."""
    speed, c, s = x[WATER_SPEED], math.cos(x[HEADING]), math.sin(x[HEADING])
    for k in (NORTH, EAST):
        p[k, k] = place_std**2
        p[k, k + 2] = p[k + 2, k] = 0.5 * place_std * velocity_std
    p[YAW_RATE, YAW_RATE] = (response.manual * response.rate) ** 2
    p[GAIN, GAIN] = response.gain_std**2
    p[SPEED_GAIN, SPEED_GAIN] = response.speed_gain_std**2
    p[BIAS, BIAS] = (response.bias_std * response.rate) ** 2
    for k in (WIND_N, WIND_E):
        p[k, k] = (response.wind_std * response.rate) ** 2
    p[DAMPING, DAMPING] = response.damping_std**2
    p[TIME, TIME] = response.time_std**2
    p[SLIP, SLIP] = response.slip_std**2
    p[SWAY, SWAY] = (response.slip_std * response.rate * speed) ** 2
    p[GYRO, GYRO], p[DEVIATION, DEVIATION] = _GYRO_STD**2, DEVIATION_STD**2
    p[MADE_UP, MADE_UP] = (_MADE_UP_STD * response.over_ground) ** 2
    if speed == 0.0:
        beside, rest = _at_rest(response, way)
        p[CURRENT_N, CURRENT_N] = p[CURRENT_E, CURRENT_E] = velocity_std**2 + beside**2
        p[WATER_SPEED, WATER_SPEED] = rest**2
        p[HEADING, HEADING] = (math.pi / _DIRECTIONS) ** 2
        return
    # (δU, U δψ) are the components, along and across the heading, of the error of velocity less that of the current.
    current = (0.25 * response.speed) ** 2
    whole = current + velocity_std**2
    for k in (CURRENT_N, CURRENT_E):
        p[k, k] = current
    p[WATER_SPEED, WATER_SPEED] = whole
    p[HEADING, HEADING] = whole / speed**2
    for k, (along, across) in ((CURRENT_N, (c, -s)), (CURRENT_E, (s, c))):
        p[k, WATER_SPEED] = p[WATER_SPEED, k] = -current * along
        p[k, HEADING] = p[HEADING, k] = -current * across / speed
