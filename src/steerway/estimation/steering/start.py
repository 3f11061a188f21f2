"""The first hypotheses: currents and headings that are consistent with the first fixes."""

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
"""Number of directions that are tried, for currents and for headings at rest; and sizes of the currents, as shares of
the usual speed. Chosen: the 1σ of a heading is half the spacing of the directions."""
_MOVING, _SLOW = 4.0, 0.15
"""A boat counts as moving if its velocity over ground exceeds both this many of its σ and this share of the usual
speed. Chosen: the number of σ is that of `course.steerageway.COURSE_GAINED`."""
_REST_STD, _CURRENT_STD = 0.05, 0.1
"""For a boat at rest: 1σ of its speed through the water, and 1σ of the difference between current and drift, as shares
of the usual speed. Chosen for a boat of 2 m/s that drifts at 1 m/s, of which 0, 0.1 or 0.2 m/s is due to wind. 5 s
after the boat departs, the error of the current is 0.12, 0.12 and 0.13 m/s RMS, always within 2σ. With half of both
values, it is 0.10, 0.11 and 0.14 m/s, 92 % within 2σ.
"""
_GYRO_STD = math.radians(0.3)
"""1σ of the bias of a gyro at the start, rad/s. Chosen: vehicles calibrate their gyros when they are switched on."""
_MADE_UP_STD = 0.5
"""1σ, at the start, of the share of the current that a vehicle's own speed loop compensates. Chosen: the share is 0 for
a vehicle that holds its throttle."""
_DRIFTS, _STANDS = 1.0, 3.0
"""Costs (−log probability) of a boat that moves with the current alone, and of one that stands still over ground by
stemming the current. Chosen: weights of 0.37 and 0.05."""


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

    For a moving boat there is one hypothesis for each current; the rest of the velocity is motion through the water.
    For a boat at rest in the water there is one for each heading. way: 1σ of the remaining speed through the water
    (m/s) if the motor idles, see `drifting`; the drift is then the current. is_driven: whether the motor drives the
    boat, which is then hardly at rest. changes: 1σ of the change of velocity since its fixes, m/s.
    """
    directions = [math.tau * k / _DIRECTIONS for k in range(_DIRECTIONS)]
    moving = math.hypot(*velocity) > max(_MOVING * velocity_std, _SLOW * response.speed)
    velocity_std = math.hypot(velocity_std, changes)
    # At rest in the water, the current is the velocity over ground.
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
    """Set the speed through the water of a boat whose motor idles to 0, with a 1σ of `way` (m/s). States (m, 21) and
    covariances (m, 21, 21) are changed in place.
    """
    for k in (WATER_SPEED, SWAY):
        states[:, k] = covariances[:, k] = covariances[..., k] = 0.0
    covariances[:, WATER_SPEED, WATER_SPEED] = way**2


def departing(covariances: Floats, response: Response) -> None:
    """Widen the covariances (m, 21, 21), in place, when a drift ends: an unknown part of the drift was due to wind."""
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
    """(states, covariances, log weights) as in `hypotheses`, for a state (21,) and covariance (20, 21) at rest.

    The velocity over ground becomes the current, unless the boat drifts already. The response stays as estimated.
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
    """For a boat at rest: 1σ of current minus velocity over ground, and of the speed through the water, m/s."""
    return (0.0, way) if math.isfinite(way) else (_CURRENT_STD * response.speed, _REST_STD * response.speed)


def _spread(x: Floats, p: Floats, place_std: float, velocity_std: float, response: Response, way: float) -> None:
    """Fill a first covariance: current and motion through the water are uncertain, their sum is less so."""
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
