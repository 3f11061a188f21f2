"""Uncertainty of the motion: the covariance of the states of `motion` from one time to another."""

import math

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel, lean_kernel
from steerway.estimation.steering.motion import (
    BIAS,
    CURRENT_E,
    CURRENT_N,
    DAMPING,
    DEVIATION,
    EAST,
    ERROR_E,
    ERROR_N,
    ERROR_TIME,
    GAIN,
    GYRO,
    HEADING,
    HELM_TIME,
    LEAST_SLIP,
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
    along,
    fastest_of,
    in_force,
    kept_in_turn,
    move,
    responding,
    steps_of,
)
from steerway.estimation.steering.response import Response

_IDENTIFIED, _TIMES = 300.0, 100.0
"""Time in which gain, damping and time constant may drift by their 1σ at the start: the longer of this many s and this
many time constants of the yaw rate. The bias takes ten times as long. The values are chosen."""
_IN_TURN = 0.2
"""1σ of the yaw rate about its response in a turn, as a share of the rate times `time_std`. For a boat without a
yaw-rate loop of its own this is 0. Chosen: in corners of 120° to 150° a boat whose motor had little thrust turned by 3
to 7 °/s less than estimated, and left the corner by 0.2 m more."""
_BEHIND = 1.0
"""Time, s, by which a vehicle's yaw rate lags its order. The effect of the integral of its own yaw-rate loop in this
time is uncertain: the integral may be absent or twice the declared one. Chosen: 4 s gains nothing."""
DEVIATION_STD = math.radians(10.0)
"""1σ of the deviation of a compass, rad. Chosen: equal to that of the crab angle in `estimation.vessel.aids.TABLE`."""
_DEVIATES = 1.0
"""Change of heading, rad, over which the correlation of a deviation falls by a factor of e. Chosen: deviation cards
have terms in ψ and in 2ψ."""
_GYRO_WALK = math.radians(0.01)
"""Random walk of the bias of a gyro, rad/s per √s. The value is chosen."""
_UNLIKE = 0.2
"""1σ of the error of the modelled sway, as a share of this sway. The value is chosen."""


@lean_kernel
def predict(
    x: Floats,
    p: Floats,
    order: float,
    speed: float,
    response: Response,
    wander: float,
    dt: float,
    f: Floats,
    work: Floats,
) -> None:
    """Predict by a short dt, in place. wander: variance of the slow error, m². f and work: workspace (21, 21)."""
    known = math.isfinite(order)
    left, angle_left, to_rate, to_angle, steady, slower_rate, slower_angle = responding(x, order, response, dt)
    rate, water, sway = x[YAW_RATE], x[WATER_SPEED], x[SWAY]
    abeam_n, abeam_e = -math.sin(x[HEADING]), math.cos(x[HEADING])
    weathercock = x[WIND_E] * abeam_n - x[WIND_N] * abeam_e  # change of the wind's part with heading
    turned = rate * angle_left + steady * to_angle
    mean = x[HEADING] + 0.5 * turned
    c, s = math.cos(mean), math.sin(mean)
    over_ground = response.over_ground > 0.0
    asked = x[SPEED_GAIN] * speed - (x[MADE_UP] * along(x) if over_ground else 0.0)
    fastest = fastest_of(x, response)
    beyond = max(0.0, asked - fastest) if math.isfinite(speed) else 0.0
    move(x, order, speed, response, dt)

    for i in range(STATES):
        for j in range(STATES):
            f[i, j] = 1.0 if i == j else 0.0
    f[ERROR_N, ERROR_N] = f[ERROR_E, ERROR_E] = math.exp(-dt / ERROR_TIME)
    f[NORTH, CURRENT_N] = f[EAST, CURRENT_E] = dt
    f[HEADING, YAW_RATE], f[YAW_RATE, YAW_RATE] = angle_left, left
    if known:
        f[HEADING, GAIN], f[YAW_RATE, GAIN] = to_angle * order, to_rate * order
        f[HEADING, BIAS], f[YAW_RATE, BIAS] = to_angle, to_rate
        f[HEADING, WIND_N], f[YAW_RATE, WIND_N] = to_angle * abeam_n, to_rate * abeam_n
        f[HEADING, WIND_E], f[YAW_RATE, WIND_E] = to_angle * abeam_e, to_rate * abeam_e
        f[HEADING, HEADING] += to_angle * weathercock
        f[YAW_RATE, HEADING] = to_rate * weathercock
        f[HEADING, DAMPING], f[YAW_RATE, DAMPING] = -to_angle * rate, -to_rate * rate
        f[HEADING, TIME], f[YAW_RATE, TIME] = slower_angle, slower_rate
        for k in range(HEADING, SPEED_GAIN):
            f[BIAS, k] -= response.integral * (f[HEADING, k] - (k == HEADING))
    _slide(x, f, water, sway, turned, c, s, dt)
    if math.isfinite(speed):
        kept = math.exp(-dt / response.speed_time)
        limited = over_ground and not 0.0 < asked < fastest
        f[WATER_SPEED, WATER_SPEED] = 1.0 if limited and asked > water > response.top_speed else kept
        f[WATER_SPEED, SPEED_GAIN] = 0.0 if limited else (1.0 - kept) * speed * kept_in_turn(x, response)
        if over_ground and not limited:
            share = (1.0 - kept) * x[MADE_UP]
            f[WATER_SPEED, CURRENT_N], f[WATER_SPEED, CURRENT_E] = -share * c, -share * s
            f[WATER_SPEED, HEADING] = share * (x[CURRENT_N] * s - x[CURRENT_E] * c)
            f[WATER_SPEED, MADE_UP] = -(1.0 - kept) * along(x)

    _transform(f, p, work)
    _add_noise(x, p, order, math.isfinite(speed), beyond, response, wander, dt)
    _add_slip_and_instruments(x, p, turned, response, dt)


@lean_kernel
def _slide(x: Floats, f: Floats, water: float, sway: float, turned: float, c: float, s: float, dt: float) -> None:
    """Fill the rows of F for sway and position; the row of the heading is complete. x is the state after the step of
    dt, the speeds are those before it, and c and s are cosine and sine of the mean heading.
    """
    slips = max(x[SLIP], LEAST_SLIP)
    kept = math.exp(-dt / slips)
    drift = slips * (1.0 - kept) / dt
    outwards = drift * water  # for a unit of turn
    f[SWAY, SWAY], f[SWAY, WATER_SPEED] = kept, -drift * turned
    abeam = 0.5 * (sway + x[SWAY])
    f[NORTH, WATER_SPEED], f[EAST, WATER_SPEED] = dt * c, dt * s
    f[NORTH, HEADING], f[EAST, HEADING] = -dt * (water * s + abeam * c), dt * (water * c - abeam * s)
    half = 0.5 * dt * (1.0 + kept)
    f[NORTH, SWAY], f[EAST, SWAY] = -half * s, half * c
    for k in range(YAW_RATE, SPEED_GAIN):
        half = 0.5 * f[HEADING, k] * dt * water
        f[NORTH, k], f[EAST, k] = -half * s, half * c
        f[SWAY, k] = -outwards * f[HEADING, k]
    share = kept * dt / slips
    f[SWAY, SLIP] = share * (sway / slips + water * turned / dt) - water * turned / dt * (1.0 - kept)


@lean_kernel
def _transform(f: Floats, p: Floats, work: Floats) -> None:
    """P ← F P Fᵀ, by the rows of F that differ from those of the identity."""
    for i in range(STATES):
        own = _is_own(f, i)
        for j in range(STATES):
            total = p[i, j]
            if not own:
                total = 0.0
                for k in range(STATES):
                    total += f[i, k] * p[k, j]
            work[i, j] = total
    for j in range(STATES):
        own = _is_own(f, j)
        for i in range(j + 1):
            total = work[i, j]
            if not own:
                total = 0.0
                for k in range(STATES):
                    total += work[i, k] * f[j, k]
            p[i, j] = total
            p[j, i] = total


@lean_kernel
def _is_own(f: Floats, i: int) -> bool:
    """Whether a row is that of the identity."""
    for k in range(STATES):
        if f[i, k] != (1.0 if k == i else 0.0):
            return False
    return True


@lean_kernel
def rate_density(known: bool, response: Response) -> float:
    """Spectral density (rad²/s³) of the noise of the yaw rate, under a known order or without one."""
    aside = (response.wander if known else response.manual) * response.rate
    return 2.0 * aside * aside / (max(response.time, 0.3) if known else HELM_TIME)


@lean_kernel
def _identified(response: Response) -> float:
    """Time (s) in which gain, damping and time constant may drift by their 1σ at the start."""
    return max(_IDENTIFIED, _TIMES * response.time)


@lean_kernel
def bias_density(response: Response) -> float:
    """Spectral density (rad²/s³) of the drift of the yaw rate's bias, and of the part that the wind adds to it."""
    return (response.bias_std * response.rate) ** 2 / (10.0 * _identified(response))


@lean_kernel
def _add_noise(
    x: Floats, p: Floats, order: float, has_speed: bool, beyond: float, response: Response, wander: float, dt: float
) -> None:
    known = math.isfinite(order)
    rate, time = response.rate, response.time
    q = rate_density(known, response)
    if known:
        q += 2.0 * (_IN_TURN * response.time_std * x[YAW_RATE]) ** 2 / max(time, 0.3)
    p[YAW_RATE, YAW_RATE] += q * dt
    p[HEADING, YAW_RATE] += 0.5 * q * dt * dt
    p[YAW_RATE, HEADING] = p[HEADING, YAW_RATE]
    # In a turn the boat loses speed and slips sideways; neither lasts.
    turning, speed_time = min(1.0, abs(x[YAW_RATE]) / rate), response.speed_time
    unsteady = response.speed_noise * response.speed * (1.0 if has_speed else 2.0)
    slip = response.slip * x[WATER_SPEED] * turning
    power = response.time_std * beyond  # the top speed is not as declared
    p[HEADING, HEADING] += dt * ((0.02 * turning) ** 2 / max(time, 1.0) + q * dt * dt / 3.0)
    p[WATER_SPEED, WATER_SPEED] += dt * 2.0 / speed_time * (unsteady * unsteady + slip * slip + power * power)
    for k in (CURRENT_N, CURRENT_E):
        p[k, k] += dt * response.current_noise
    identified = _identified(response)
    p[SPEED_GAIN, SPEED_GAIN] += dt * response.speed_gain_std**2 / identified
    p[GAIN, GAIN] += dt * response.gain_std**2 / identified
    p[DAMPING, DAMPING] += dt * response.damping_std**2 / identified
    p[TIME, TIME] += dt * response.time_std**2 / identified
    if known:
        added = response.integral * (order - x[YAW_RATE])
        p[BIAS, BIAS] += dt * _BEHIND * added * added
    for k in (BIAS, WIND_N, WIND_E):
        p[k, k] += dt * bias_density(response)
    # A receiver's error that wanders within seconds also wanders within minutes, with the same density.
    for k in (NORTH, EAST):
        p[k, k] += wander * 2.0 * dt / ERROR_TIME
    for k in (ERROR_N, ERROR_E):
        p[k, k] += wander * -math.expm1(-2.0 * dt / ERROR_TIME)


@lean_kernel
def _add_slip_and_instruments(x: Floats, p: Floats, turned: float, response: Response, dt: float) -> None:
    """Add the noise of the sway, its time constant and the gyro's bias, and of the deviation after this turn (rad)."""
    slips = x[SLIP]
    if slips > LEAST_SLIP:
        unlike = _UNLIKE * slips * x[WATER_SPEED] * turned / dt
        p[SWAY, SWAY] += unlike * unlike * -math.expm1(-2.0 * dt / slips)
    p[SLIP, SLIP] += dt * response.slip_std**2 / _identified(response)
    p[GYRO, GYRO] += dt * _GYRO_WALK**2
    left = math.exp(-abs(turned) / _DEVIATES)
    x[DEVIATION] *= left
    for k in range(STATES):
        p[DEVIATION, k] *= left
        p[k, DEVIATION] *= left
    p[DEVIATION, DEVIATION] += DEVIATION_STD**2 * (1.0 - left * left)


@kernel
def predict_bank(
    states: Floats,
    covariances: Floats,
    orders: Floats,
    response: Response,
    wander: float,
    start: float,
    stop: float,
) -> None:
    """All states (m, 21) and covariances (m, 21, 21) from time start to stop, in place.

    orders: (k, 3), rows of time, and the yaw rate and speed in force from then on. The first row also holds before.
    """
    f, work = np.zeros((STATES, STATES)), np.zeros((STATES, STATES))
    k = 0
    now = start
    while now < stop:
        k, until = in_force(orders, k, now, stop)
        n = steps_of(response, until - now)
        for _ in range(n):
            for m in range(len(states)):
                predict(
                    states[m],
                    covariances[m],
                    orders[k, 1],
                    orders[k, 2],
                    response,
                    wander,
                    (until - now) / n,
                    f,
                    work,
                )
        now = until
