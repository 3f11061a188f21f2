"""Motion of a boat whose orders are known: through the water along its bow, carried by a current.

States [x^n y^n V_N V_E U_r ψ r g b w^n w^e δ τ k e^n e^e v s γ c]: position (m), current (m/s), speed through the water
along the bow (m/s), heading of the bow (rad), its rate (rad/s), gain of the response to orders (1: as declared), bias
of the rate and what the wind adds to it (rad/s), what the linear damping is beyond the declared one, time constant over
the declared one; gain of the speed; slow error of the receiver (m); sway (m/s) and its time constant (s); bias of the
gyro (rad/s) and deviation of the compass (rad). The rate answers an ordered rate u by
τ T ṙ + (d + δ) r + n r|r| = g u + b + w^e cos ψ − w^n sin ψ: Nomoto's first-order model with Norrbin's damping
(Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd edition, sections 7.2 and 7.3);
d = d_0 − m U_r², since the Munk moment of a slender hull grows with the square of the speed. The moment of the wind,
and of the leeway that it makes, keeps its direction in the earth, so that what one leg shows of it holds on the next.
A vehicle's own yaw-rate loop may have an integral i, which makes up what the rate lacks: ḃ = i (u − r), so that what a
turn has left in it turns the boat beyond the turn's end; the bias is as uncertain as the integral.
So the uncertainty of the rate grows in an ordered turn as far as the response is uncertain, and not between turns. The
speed tends to k times an ordered one. A hull that turns keeps its motion until the water turns it, v̇ = −v/s − U_r r:
in a turn the boat slips outwards by s U_r r. The position is that of the pivot point, which moves along the bow but for
that sway, as the receiver gives it: it wanders with what of the receiver's error is slower than the slow error. The
deviation of the compass changes with the heading. A covariance is kept whole.
"""

import math
from typing import NamedTuple

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel, lean_kernel

STATES = 20
(
    NORTH,
    EAST,
    CURRENT_N,
    CURRENT_E,
    WATER_SPEED,
    HEADING,
    YAW_RATE,
    GAIN,
    BIAS,
    WIND_N,
    WIND_E,
    DAMPING,
    TIME,
    SPEED_GAIN,
    ERROR_N,
    ERROR_E,
    SWAY,
    SLIP,
    GYRO,
    DEVIATION,
) = range(STATES)
_LONGEST_STEP = 0.25
"""s of one step, and share of the response's time constant that it may have in addition. Chosen: at 15°/s a
boat turns by 4° in a step."""


class Response(NamedTuple):
    """What a boat makes of its orders, and how well that is known; SI, rad. Deviations are 1σ.

    time T (s), linear d_0, munk m (s²/m²) and quadratic n (s/rad) of the yaw rate; rate: the largest that is ordered;
    speed: usual through the water, top_speed the largest; speed_time: its time constant, s; wander: of the yaw rate
    beside the response, as a share of `rate`; wind_std: of what the wind adds to the bias, north and east, as a share
    of `rate`; current: of its components at the start, in shares of the speed, and current_noise, spectral density of
    its changes, m²/s³; speed_noise: 1σ of the speed through the water beside its
    response, and speed_gain_std of that, in shares; slip: lost share of the speed in a turn at `rate`; manual: yaw
    rate of an unknown helmsman, as a share of `rate`; over_ground: whether an ordered speed is one over ground along
    the bow, as of vehicles with a speed loop of their own, else one through the water; pivot: m that the point which
    moves along the bow, in a turn too, lies ahead of the one whose position is measured; time_std: of T, and of
    what an ordered speed is beyond the largest, as a share; integral i (1/s): of the vehicle's own yaw-rate loop;
    slip_time and slip_std: of the sway, s.
    """

    time: float
    rate: float
    speed: float
    top_speed: float
    linear: float = 1.0
    munk: float = 0.0
    quadratic: float = 0.0
    speed_time: float = 2.0
    wander: float = 0.02
    gain_std: float = 0.15
    damping_std: float = 0.3
    bias_std: float = 0.12
    wind_std: float = 0.25
    current: float = 0.5
    current_noise: float = 1e-4
    speed_noise: float = 0.05
    speed_gain_std: float = 0.1
    slip: float = 0.05
    manual: float = 0.5
    over_ground: bool = False
    pivot: float = 0.0
    time_std: float = 0.0
    integral: float = 0.0
    slip_time: float = 0.0
    slip_std: float = 0.0

    def packed(self) -> "list[float]":
        """The parameters of the kernels."""
        return [float(each) for each in self]


(
    _TIME,
    _RATE,
    _SPEED,
    _TOP,
    _LINEAR,
    _MUNK,
    _QUADRATIC,
    _SPEED_TIME,
    _WANDER,
    _GAIN_STD,
    _DAMPING_STD,
    _BIAS_STD,
    _WIND_STD,
    _CURRENT,
    _CURRENT_NOISE,
    _SPEED_NOISE,
    _SPEED_GAIN_STD,
    _SLIP,
    _MANUAL,
    _OVER_GROUND,
    PIVOT,
    _TIME_STD,
    _INTEGRAL,
    _SLIP_TIME,
    _SLIP_STD,
) = range(len(Response._fields))

_HELM_TIME = 2.0
"""s, time constant of the yaw rate under unknown orders, a first-order Gauss-Markov process. Chosen: a
helmsman's turn lasts some seconds."""
_IDENTIFIED, _TIMES = 300.0, 100.0
"""s, and time constants of the yaw rate, in which the response may drift by their first deviations; the bias in
ten times that. Chosen."""
_BEHIND = 1.0
"""s for which a vehicle's yaw rate is behind its order at a time: the integral of her own loop, which may be none or
twice as declared, adds that much more or less. Chosen: four times as long gains nothing.
"""
ERROR_TIME = 5.0
"""s, time constant of the receiver's slow error: two receivers of one boat drift apart by 0.05 m in 1 s
and 0.25 m in 10 s. Chosen between the two."""


DEVIATION_STD = math.radians(10.0)
"""rad of a compass, 1σ. Chosen: as the crab angle of an aid (`course.update.aids.TABLE`)."""
_DEVIATES = 1.0
"""rad of heading by which a deviation is another, a factor of e. Chosen: cards have terms of one circle and of two."""
_GYRO_WALK = math.radians(0.01)
"""rad/s in a root of seconds by which the bias of a gyro drifts. Chosen."""
_UNLIKE = 0.2
"""Share of the sway that is not as modelled. Chosen."""
_LEAST_SLIP = 1e-3
"""s, time constant of the sway below which there is none."""


@lean_kernel
def yaw_bias(x: Floats) -> float:
    """The yaw rate (rad/s) that a boat settles at without an order: her own and the wind's, at unit damping."""
    return x[BIAS] + x[WIND_E] * math.cos(x[HEADING]) - x[WIND_N] * math.sin(x[HEADING])


@lean_kernel
def _response(x, order, parameters, dt):
    """What becomes in dt of a unit of the rate, as (rate, angle), and of a unit of order; the order with all that adds
    to it; and what a unit of the relative time constant changes, as (rate, angle).
    """
    if not math.isfinite(order):
        left = math.exp(-dt / _HELM_TIME)
        return left, _HELM_TIME * (1.0 - left), 0.0, 0.0, 0.0, 0.0, 0.0
    time, u = x[TIME] * parameters[_TIME], x[WATER_SPEED]
    quadratic = parameters[_QUADRATIC] * abs(x[YAW_RATE])
    damping = parameters[_LINEAR] - parameters[_MUNK] * u * u + x[DAMPING] + 2.0 * quadratic
    a = min(20.0, max(-1.0, damping * dt / time))
    if abs(a) < 0.02:
        first, second, third = 1.0 - 0.5 * a + a * a / 6.0, 0.5 - a / 6.0 + a * a / 24.0, 0.5 - a / 3.0 + a * a / 8.0
    else:
        first = -math.expm1(-a) / a
        second = (1.0 - first) / a
        third = first - second
    left, share = 1.0 - a * first, dt / time
    steady = x[GAIN] * order + yaw_bias(x) + quadratic * x[YAW_RATE]
    slower = -share * (steady - damping * x[YAW_RATE]) / x[TIME]
    return left, dt * first, share * first, dt * share * second, steady, left * slower, dt * third * slower


@lean_kernel
def move(x: Floats, order: float, speed: float, parameters: Floats, dt: float) -> None:
    """The state after a short dt under an ordered yaw rate and speed; NaN for one that is not known."""
    left, angle_left, to_rate, to_angle, steady, _, _ = _response(x, order, parameters, dt)
    turned = x[YAW_RATE] * angle_left + steady * to_angle
    mean = x[HEADING] + 0.5 * turned
    c, s = math.cos(mean), math.sin(mean)
    slips = max(x[SLIP], _LEAST_SLIP)
    kept = math.exp(-dt / slips)
    sway = x[SWAY] * kept - slips * (1.0 - kept) * x[WATER_SPEED] * turned / dt
    abeam = 0.5 * (x[SWAY] + sway)
    x[NORTH] += dt * (x[WATER_SPEED] * c - abeam * s + x[CURRENT_N])
    x[EAST] += dt * (x[WATER_SPEED] * s + abeam * c + x[CURRENT_E])
    x[SWAY] = sway
    x[HEADING] += turned
    if math.isfinite(order):
        x[BIAS] += parameters[_INTEGRAL] * (dt * order - turned)
    x[ERROR_N] *= math.exp(-dt / ERROR_TIME)
    x[ERROR_E] *= math.exp(-dt / ERROR_TIME)
    x[YAW_RATE] = x[YAW_RATE] * left + steady * to_rate
    if math.isfinite(speed):
        share = -math.expm1(-dt / parameters[_SPEED_TIME])
        if parameters[_OVER_GROUND] > 0.0:
            asked = min(_fastest(x, parameters), max(0.0, x[SPEED_GAIN] * speed - _along(x)))
        else:
            asked = x[SPEED_GAIN] * speed
        x[WATER_SPEED] += share * (asked - x[WATER_SPEED])


@lean_kernel
def _along(x):
    """The current along the bow."""
    return x[CURRENT_N] * math.cos(x[HEADING]) + x[CURRENT_E] * math.sin(x[HEADING])


@lean_kernel
def _fastest(x, parameters):
    """The speed through the water that an order over ground leads to at the most: the declared top speed, or the
    boat's where that is higher; a vehicle with a speed loop of its own may have power to spare.
    """
    return max(parameters[_TOP], x[WATER_SPEED])


@lean_kernel
def predict(
    x: Floats,
    p: Floats,
    order: float,
    speed: float,
    parameters: Floats,
    wander: float,
    dt: float,
    f: Floats,
    work: Floats,
) -> None:
    """State and covariance after a short dt, in place; wander: variance of the slow error, m²; f and work are (20,
    20) of scratch.
    """
    known = math.isfinite(order)
    left, angle_left, to_rate, to_angle, steady, slower_rate, slower_angle = _response(x, order, parameters, dt)
    rate, water, sway = x[YAW_RATE], x[WATER_SPEED], x[SWAY]
    abeam_n, abeam_e = -math.sin(x[HEADING]), math.cos(x[HEADING])
    weathercock = x[WIND_E] * abeam_n - x[WIND_N] * abeam_e  # change of the wind's part with heading
    turned = rate * angle_left + steady * to_angle
    mean = x[HEADING] + 0.5 * turned
    c, s = math.cos(mean), math.sin(mean)
    asked = x[SPEED_GAIN] * speed - _along(x)
    fastest = _fastest(x, parameters)
    beyond = max(0.0, asked - fastest) if math.isfinite(speed) else 0.0
    move(x, order, speed, parameters, dt)

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
            f[BIAS, k] -= parameters[_INTEGRAL] * (f[HEADING, k] - (k == HEADING))
    _slide(x, f, water, sway, turned, c, s, dt)
    if math.isfinite(speed):
        kept = math.exp(-dt / parameters[_SPEED_TIME])
        over_ground = parameters[_OVER_GROUND] > 0.0
        limited = over_ground and not 0.0 < asked < fastest
        f[WATER_SPEED, WATER_SPEED] = 1.0 if limited and asked > water > parameters[_TOP] else kept
        f[WATER_SPEED, SPEED_GAIN] = 0.0 if limited else (1.0 - kept) * speed
        if over_ground and not limited:
            f[WATER_SPEED, CURRENT_N], f[WATER_SPEED, CURRENT_E] = -(1.0 - kept) * c, -(1.0 - kept) * s
            f[WATER_SPEED, HEADING] = (1.0 - kept) * (x[CURRENT_N] * s - x[CURRENT_E] * c)

    _transform(f, p, work)
    _add_noise(x, p, order, math.isfinite(speed), beyond, parameters, wander, dt)
    _add_slip_and_instruments(x, p, turned, parameters, dt)


@lean_kernel
def _slide(x, f, water, sway, turned, c, s, dt):
    """Rows of F of the sway and the position, those of the heading being complete; x after the step of dt, speeds
    before it; c and s of the mean heading.
    """
    slips = max(x[SLIP], _LEAST_SLIP)
    kept = math.exp(-dt / slips)
    outwards = slips * (1.0 - kept) * water / dt  # for a unit of turn
    f[SWAY, SWAY], f[SWAY, WATER_SPEED] = kept, -outwards * turned / max(water, 1e-6)
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
def _transform(f, p, work):
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
def _is_own(f, i):
    """Whether a row is that of the identity."""
    for k in range(STATES):
        if f[i, k] != (1.0 if k == i else 0.0):
            return False
    return True


@lean_kernel
def rate_density(known: bool, parameters: Floats) -> float:
    """Spectral density of what moves the yaw rate beside a known order, or without one, rad²/s³."""
    aside = (parameters[_WANDER] if known else parameters[_MANUAL]) * parameters[_RATE]
    return 2.0 * aside * aside / (max(parameters[_TIME], 0.3) if known else _HELM_TIME)


@lean_kernel
def _identified(parameters):
    """s in which gain, damping and time constant may drift by their first deviations."""
    return max(_IDENTIFIED, _TIMES * parameters[_TIME])


@lean_kernel
def bias_density(parameters: Floats) -> float:
    """Spectral density of the drift of the rate's bias and of the wind's part of it, rad²/s³."""
    return (parameters[_BIAS_STD] * parameters[_RATE]) ** 2 / (10.0 * _identified(parameters))


@lean_kernel
def _add_noise(x, p, order, has_speed, beyond, parameters, wander, dt):
    known = math.isfinite(order)
    rate, time = parameters[_RATE], parameters[_TIME]
    q = rate_density(known, parameters)
    p[YAW_RATE, YAW_RATE] += q * dt
    p[HEADING, YAW_RATE] += 0.5 * q * dt * dt
    p[YAW_RATE, HEADING] = p[HEADING, YAW_RATE]
    # In a turn the boat loses speed and slips sideways, which neither lasts.
    turning, speed_time = min(1.0, abs(x[YAW_RATE]) / rate), parameters[_SPEED_TIME]
    unsteady = parameters[_SPEED_NOISE] * parameters[_SPEED] * (1.0 if has_speed else 2.0)
    slip = parameters[_SLIP] * x[WATER_SPEED] * turning
    power = parameters[_TIME_STD] * beyond  # the top speed is not as declared
    p[HEADING, HEADING] += dt * ((0.02 * turning) ** 2 / max(time, 1.0) + q * dt * dt / 3.0)
    p[WATER_SPEED, WATER_SPEED] += dt * 2.0 / speed_time * (unsteady * unsteady + slip * slip + power * power)
    for k in (CURRENT_N, CURRENT_E):
        p[k, k] += dt * parameters[_CURRENT_NOISE]
    identified = _identified(parameters)
    p[SPEED_GAIN, SPEED_GAIN] += dt * parameters[_SPEED_GAIN_STD] ** 2 / identified
    p[GAIN, GAIN] += dt * parameters[_GAIN_STD] ** 2 / identified
    p[DAMPING, DAMPING] += dt * parameters[_DAMPING_STD] ** 2 / identified
    p[TIME, TIME] += dt * parameters[_TIME_STD] ** 2 / identified
    if known:
        added = parameters[_INTEGRAL] * (order - x[YAW_RATE])
        p[BIAS, BIAS] += dt * _BEHIND * added * added
    for k in (BIAS, WIND_N, WIND_E):
        p[k, k] += dt * bias_density(parameters)
    # A receiver that wanders in seconds wanders in minutes too: by the same density.
    for k in (NORTH, EAST):
        p[k, k] += wander * 2.0 * dt / ERROR_TIME
    for k in (ERROR_N, ERROR_E):
        p[k, k] += wander * -math.expm1(-2.0 * dt / ERROR_TIME)


@lean_kernel
def _add_slip_and_instruments(x, p, turned, parameters, dt):
    """Noise of the sway and its time, of the bias of the gyro, and of the deviation in a turn of this angle."""
    slips = x[SLIP]
    if slips > _LEAST_SLIP:
        unlike = _UNLIKE * slips * x[WATER_SPEED] * turned / dt
        p[SWAY, SWAY] += unlike * unlike * -math.expm1(-2.0 * dt / slips)
    p[SLIP, SLIP] += dt * parameters[_SLIP_STD] ** 2 / _identified(parameters)
    p[GYRO, GYRO] += dt * _GYRO_WALK**2
    left = math.exp(-abs(turned) / _DEVIATES)
    x[DEVIATION] *= left
    for k in range(STATES):
        p[DEVIATION, k] *= left
        p[k, DEVIATION] *= left
    p[DEVIATION, DEVIATION] += DEVIATION_STD**2 * (1.0 - left * left)


@lean_kernel
def steps_of(parameters: Floats, dt: float) -> int:
    """As many steps as keep each short: in `_LONGEST_STEP`, of a slow vessel in a share of its time constant."""
    longest = _LONGEST_STEP * max(1.0, 0.2 * parameters[_TIME])
    return max(1, math.ceil(dt / longest - 1e-9))


@kernel
def predict_bank(
    states: Floats,
    covariances: Floats,
    orders: Floats,
    parameters: Floats,
    wander: float,
    start: float,
    stop: float,
) -> None:
    """All states (m, 20) and covariances (m, 20, 20) from time start to stop, in place.

    orders: (k, 3), rows of time, yaw rate and speed that are in force from that time on; the first also before it.
    """
    f, work = np.zeros((STATES, STATES)), np.zeros((STATES, STATES))
    k = 0
    now = start
    while now < stop:
        while k + 1 < len(orders) and orders[k + 1, 0] <= now:
            k += 1
        until = min(stop, orders[k + 1, 0]) if k + 1 < len(orders) else stop
        n = steps_of(parameters, until - now)
        for _ in range(n):
            for m in range(len(states)):
                predict(
                    states[m],
                    covariances[m],
                    orders[k, 1],
                    orders[k, 2],
                    parameters,
                    wander,
                    (until - now) / n,
                    f,
                    work,
                )
        now = until


@kernel
def moved_by_orders(x: Floats, orders: Floats, parameters: Floats, start: float, stop: float) -> Floats:
    """One state (20,) from time start to stop under orders as of `predict_bank`."""
    after = x.copy()
    k = 0
    now = start
    while now < stop:
        while k + 1 < len(orders) and orders[k + 1, 0] <= now:
            k += 1
        until = min(stop, orders[k + 1, 0]) if k + 1 < len(orders) else stop
        n = steps_of(parameters, until - now)
        for _ in range(n):
            move(after, orders[k, 1], orders[k, 2], parameters, (until - now) / n)
        now = until
    return after
