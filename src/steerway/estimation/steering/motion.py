"""Motion of a boat whose orders are known: through the water along its bow, carried by a current.

States [x^n y^n V_N V_E U_r ψ r g b w^n w^e δ τ k e^n e^e v s γ c ρ]: position (m); current (m/s); speed through the
water along the bow (m/s); heading of the bow (rad); yaw rate (rad/s); gain of its response to orders (1: as declared);
bias of the yaw rate, and what the wind adds to it (rad/s); linear damping less the declared one; time constant relative
to the declared one; gain of the speed; slow error of the receiver (m); sway (m/s) and its time constant (s); bias of
the gyro (rad/s); deviation of the compass (rad); share of the current that the vehicle's own speed loop compensates.

The yaw rate answers an ordered rate u by Nomoto's first-order model with Norrbin's damping (Fossen, Handbook of Marine
Craft Hydrodynamics and Motion Control, 2nd edition, sections 7.2 and 7.3), with d = d_0 − m U_r²:
τ T ṙ + (d + δ) r + n r|r| = g u + b + w^e cos ψ − w^n sin ψ.
The Munk moment of a slender hull grows with the square of the speed, hence m. The moment of wind and leeway keeps its
direction in the earth: its estimate from one leg holds on the next. A vehicle's own yaw-rate loop may have an integral
i, which compensates errors of the rate: ḃ = i (u − r). After a turn, the integral turns the boat further. The bias is
as uncertain as the integral. The rate becomes more uncertain in ordered turns only, because the response is uncertain.

The speed tends to k times an ordered one, minus ρ times the current along the bow. For a loop that holds the speed over
ground ρ is 1, for one that holds the throttle 0. In a turn, a hull keeps its motion until the water turns it,
v̇ = −v/s − U_r r: the boat slips outwards by s U_r r. The position is that of the pivot point, whose only motion across
the bow is this sway. The position includes errors of the receiver that are slower than the slow error. The deviation of
the compass changes with the heading. Covariances are full matrices, not upper triangles.
"""

import math

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel, lean_kernel
from steerway.estimation.steering.response import Response

STATES = 21
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
    MADE_UP,
) = range(STATES)
_LONGEST_STEP = 0.25
"""Longest step of a prediction, s. A vessel with a time constant above 5 s gets longer steps, see `steps_of`. Chosen:
at 15 °/s a boat turns by 4° in a step."""
HELM_TIME = 2.0
"""Time constant, s, of the yaw rate under unknown orders, a first-order Gauss–Markov process. Chosen: a helmsman's turn
lasts some seconds."""
ERROR_TIME = 5.0
"""Time constant, s, of the receiver's slow error. Chosen between 1 and 10 s: two receivers of one boat drift apart by
0.05 m in 1 s and by 0.25 m in 10 s."""
LEAST_SLIP = 1e-3
"""Time constant of the sway, s, below which the boat has no sway."""


@lean_kernel
def yaw_bias(x: Floats) -> float:
    """The steady yaw rate (rad/s) without an order, at unit damping: the bias plus the part that the wind adds."""
    return x[BIAS] + x[WIND_E] * math.cos(x[HEADING]) - x[WIND_N] * math.sin(x[HEADING])


@lean_kernel
def responding(
    x: Floats, order: float, response: Response, dt: float
) -> tuple[float, float, float, float, float, float, float]:
    """Seven numbers of a step of dt: (rate, angle) after it for a unit of rate; (rate, angle) for a unit of order; the
    order plus all that adds to it; and the change of (rate, angle) for a unit of the relative time constant.
    """
    if not math.isfinite(order):
        left = math.exp(-dt / HELM_TIME)
        return left, HELM_TIME * (1.0 - left), 0.0, 0.0, 0.0, 0.0, 0.0
    time, u = x[TIME] * response.time, x[WATER_SPEED]
    quadratic = response.quadratic * abs(x[YAW_RATE])
    damping = response.linear - response.munk * u * u + x[DAMPING] + 2.0 * quadratic
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
def move(x: Floats, order: float, speed: float, response: Response, dt: float) -> None:
    """Advance the state by a short dt, in place, under an ordered yaw rate and speed; NaN for an unknown order."""
    left, angle_left, to_rate, to_angle, steady, _, _ = responding(x, order, response, dt)
    turned = x[YAW_RATE] * angle_left + steady * to_angle
    mean = x[HEADING] + 0.5 * turned
    c, s = math.cos(mean), math.sin(mean)
    slips = max(x[SLIP], LEAST_SLIP)
    kept = math.exp(-dt / slips)
    sway = x[SWAY] * kept - slips * (1.0 - kept) * x[WATER_SPEED] * turned / dt
    abeam = 0.5 * (x[SWAY] + sway)
    x[NORTH] += dt * (x[WATER_SPEED] * c - abeam * s + x[CURRENT_N])
    x[EAST] += dt * (x[WATER_SPEED] * s + abeam * c + x[CURRENT_E])
    x[SWAY] = sway
    x[HEADING] += turned
    if math.isfinite(order):
        x[BIAS] += response.integral * (dt * order - turned)
    x[ERROR_N] *= math.exp(-dt / ERROR_TIME)
    x[ERROR_E] *= math.exp(-dt / ERROR_TIME)
    x[YAW_RATE] = x[YAW_RATE] * left + steady * to_rate
    if math.isfinite(speed):
        share = -math.expm1(-dt / response.speed_time)
        if response.over_ground > 0.0:
            asked = min(fastest_of(x, response), max(0.0, x[SPEED_GAIN] * speed - x[MADE_UP] * along(x)))
        else:
            asked = x[SPEED_GAIN] * speed * kept_in_turn(x, response)
        x[WATER_SPEED] += share * (asked - x[WATER_SPEED])


@lean_kernel
def kept_in_turn(x: Floats, response: Response) -> float:
    """The share of its speed that a boat without a speed loop keeps in a turn; see `loss` of `Response`."""
    return 1.0 - response.loss * min(2.0, (x[YAW_RATE] / response.rate) ** 2)


@lean_kernel
def along(x: Floats) -> float:
    """The component of the current along the bow, m/s."""
    return x[CURRENT_N] * math.cos(x[HEADING]) + x[CURRENT_E] * math.sin(x[HEADING])


@lean_kernel
def fastest_of(x: Floats, response: Response) -> float:
    """The highest speed through the water that may follow from an order over ground, m/s. It is the declared top speed,
    or the present speed if higher: a vehicle with a speed loop of its own may have power to spare.
    """
    return max(response.top_speed, x[WATER_SPEED])


@lean_kernel
def steps_of(response: Response, dt: float) -> int:
    """Number of steps for dt: each at most `_LONGEST_STEP`, or a twentieth of the time constant if that is longer."""
    longest = _LONGEST_STEP * max(1.0, 0.2 * response.time)
    return max(1, math.ceil(dt / longest - 1e-9))


@lean_kernel
def in_force(orders: Floats, k: int, now: float, stop: float) -> tuple[int, float]:
    """(index of the order in force at `now`, k or later, and until when it holds); orders: see `predict_bank`."""
    while k + 1 < len(orders) and orders[k + 1, 0] <= now:
        k += 1
    return k, min(stop, orders[k + 1, 0]) if k + 1 < len(orders) else stop


@kernel
def moved_by_orders(x: Floats, orders: Floats, response: Response, start: float, stop: float) -> Floats:
    """One state (21,) predicted from time start to stop under these orders, see `predict_bank`."""
    after = x.copy()
    k = 0
    now = start
    while now < stop:
        k, until = in_force(orders, k, now, stop)
        n = steps_of(response, until - now)
        for _ in range(n):
            move(after, orders[k, 1], orders[k, 2], response, (until - now) / n)
        now = until
    return after
