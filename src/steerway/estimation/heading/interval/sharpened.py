"""The sharpened interval Kalman filter, P4 §3.2. Each number is used once in a sum; where this is impossible, the
results of several arrangements are intersected. The coordinates are such that a reading contracts the bounds.

The compass follows the heading, and a filter corrects the heading by the compass. Intervals carry no correlation of the
two. In plain coordinates the correction is therefore one more uncertainty, and the bounds grow. The states here are
    y = [h1, h2, e1, e2],  h = o v (so that ψ = h1 + h2),  c = γ ψ + R e
with plain numbers γ, the corrected compass's response to a constant ψ, and R, the eigenvectors of the compass's own
dynamics, for the middle of the box. This change of variables is exact; after it the correction of ψ contracts, and e1,
e2 are nearly decoupled. Angles in degrees. y is (4, 2).

The covariances P (4, 4, 2), symmetric, are kept in the combination that contracts: of h with h, of h with e, of c with
c. Properties of every covariance are used too: variances are positive and do not grow by a reading, a covariance is at
most the geometric mean of its two variances.
"""

import math

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.estimation.heading.composite import AT
from steerway.estimation.heading.interval.arithmetic import (
    Pair,
    add,
    at,
    divide,
    entry,
    intersect,
    multiply,
    point,
    put,
    put_entry,
    reciprocal,
    root,
    scale,
    square,
    subtract,
)

Moves = tuple[tuple[Pair, Pair], tuple[Pair, Pair], tuple[Pair, Pair], tuple[Pair, Pair]]
H1, H2, FIRST, SECOND = range(4)
"""The heading's two parts, the compass's two states."""
GAMMA_1, GAMMA_2, SLOW, FAST = range(4)
"""Indices of γ1, γ2, r and q in the coordinates: c1 = γ1 ψ + r e1 + q e2 and c2 = γ2 ψ + e1 + e2."""
SETTLING = 400
"""Ticks after which the compass's covariance is steady: the TCM2's changes by a part in 10⁸ from tick 300 to 400."""


@kernel
def coordinates(box: Floats) -> Floats:
    """(4,) coordinates for a box, by the Kalman filter of its middle. Any coordinates are valid; these keep the bounds
    close."""
    a1, a2, shift, b, k = box[AT.a1].mean(), box[AT.a2].mean(), box[AT.shift].mean(), box[AT.b].mean(), box[AT.k].mean()
    noise, extra = box[AT.compass_noise].mean(), box[AT.reading_noise].mean() / k**2
    p_11, p_12, p_22 = noise, 0.0, noise
    kept, second = 1.0, 0.0
    for _ in range(SETTLING):
        before, cross = p_11, a1 * p_11 + a2 * p_12
        p_11 = a1 * cross + a2 * (a1 * p_12 + a2 * p_22) + noise
        kept, second = extra / (p_11 + extra), shift * cross / (p_11 + extra)
        p_22 = shift * shift * before + noise - second * shift * cross
        p_11, p_12 = kept * p_11, kept * shift * cross
    n_11, n_12, n_21, n_22 = kept * a1, kept * a2, shift - second * a1, -second * a2
    half, product = 0.5 * (n_11 + n_22), n_11 * n_22 - n_12 * n_21
    apart = math.sqrt(max(half * half - product, 1e-6))
    determinant = (1.0 - n_11) * (1.0 - n_22) - n_12 * n_21
    determinant = max(determinant, 1e-4)
    gamma_1 = b * (kept * (1.0 - n_22) - n_12 * second) / determinant
    gamma_2 = b * (n_21 * kept - (1.0 - n_11) * second) / determinant
    if abs(n_21) < 1e-6:  # a compass without memory has no eigenvectors to separate
        return np.array([gamma_1, gamma_2, 1.0, -1.0])
    return np.array([gamma_1, gamma_2, (half + apart - n_22) / n_21, (half - apart - n_22) / n_21])


@kernel
def to_eigen(first: Pair, second: Pair, frame: Floats) -> tuple[Pair, Pair]:
    """e of d = R e."""
    apart = subtract(point(frame[SLOW]), point(frame[FAST]))
    slow = divide(subtract(first, scale(frame[FAST], second)), apart)
    return slow, divide(subtract(scale(frame[SLOW], second), first), apart)


@kernel
def start(p: Floats, box: Floats, frame: Floats, vehicle_variance: float, compass_variance: float) -> None:
    """P at rest, from the variances of v1, v2 and of c1, c2."""
    p[:] = 0.0
    for i in (FIRST, SECOND):
        put(p, i, i, point(compass_variance))
    add_vehicle_noise(p, box, frame, point(vehicle_variance))


@kernel
def add_vehicle_noise(p: Floats, box: Floats, frame: Floats, variance: Pair) -> None:
    """Add a variance of v1 and v2 in these coordinates."""
    for i in (H1, H2):
        own = multiply(variance, square(entry(box, AT.output + i)))
        put(p, i, i, add(at(p, i, i), own))
        add_turn(p, i, own, frame)


@kernel
def add_turn(p: Floats, i: int, turned: Pair, frame: Floats) -> None:
    """Reduce cov(h_i, d) by γ times the growth `turned` of cov(h_i, ψ), while c does not change."""
    slow, fast = to_eigen(scale(frame[GAMMA_1], turned), scale(frame[GAMMA_2], turned), frame)
    put_both(p, i, FIRST, subtract(at(p, i, FIRST), slow))
    put_both(p, i, SECOND, subtract(at(p, i, SECOND), fast))


@kernel
def put_both(p: Floats, i: int, j: int, a: Pair) -> None:
    put(p, i, j, a)
    put(p, j, i, a)


@kernel
def three(a: Pair, x: Pair, b: Pair, y: Pair, c: Pair, z: Pair) -> Pair:
    """a x + b y + c z."""
    return add(multiply(a, x), add(multiply(b, y), multiply(c, z)))


@kernel
def within(covariance: Pair, p: Floats, i: int, j: int) -> Pair:
    """A covariance within the limits that the variances of its states set: |P_ij| ≤ √(P_ii P_jj)."""
    most = root(multiply((0.0, max(p[i, i, 1], 0.0)), (0.0, max(p[j, j, 1], 0.0))))[1]
    return intersect(covariance, (-most, most))


@kernel
def with_heading(p: Floats, i: int) -> Pair:
    """cov(h_i, ψ)."""
    return add(at(p, i, H1), at(p, i, H2))


@kernel
def heading(y: Floats) -> Pair:
    return add(entry(y, H1), entry(y, H2))


@kernel
def with_first(p: Floats, i: int, frame: Floats) -> Pair:
    """cov(h_i, c1)."""
    of_e = add(scale(frame[SLOW], at(p, i, FIRST)), scale(frame[FAST], at(p, i, SECOND)))
    return within(add(of_e, scale(frame[GAMMA_1], with_heading(p, i))), p, i, FIRST)


@kernel
def with_second(p: Floats, i: int, frame: Floats) -> Pair:
    """cov(h_i, c2)."""
    of_e = add(at(p, i, FIRST), at(p, i, SECOND))
    return within(add(of_e, scale(frame[GAMMA_2], with_heading(p, i))), p, i, SECOND)


@kernel
def tick(y: Floats, p: Floats, box: Floats, frame: Floats, reading_deg: float, number: float) -> None:
    """One tick, with the mean of `number` readings, 0 for none.

    Prediction and correction are one step, so that a number in both of them is used once.

    With c1⁻ = b ψ + a1 c1 + a2 c2, α = cov(·, c1⁻), D = var(c1⁻) + R/k² and, for d = R e, shares σ = cov(d, c1⁻)/D:
        h ← h + α/D (z/k − c1⁻)
        d1 ← (1 − σ1) c1⁻ + σ1 z/k − γ1 ψ
        d2 ← s c1 − γ2 ψ + σ2 (z/k − c1⁻).
    Without a reading α/D and σ are 0.
    """
    a1, a2, shift, k = entry(box, AT.a1), entry(box, AT.a2), entry(box, AT.shift), entry(box, AT.k)
    g = add(entry(box, AT.b), add(scale(frame[GAMMA_1], a1), scale(frame[GAMMA_2], a2)))
    by_slow, by_fast = add(scale(frame[SLOW], a1), a2), add(scale(frame[FAST], a1), a2)
    alpha = (with_next(p, H1, by_slow, by_fast, g), with_next(p, H2, by_slow, by_fast, g))
    predict_compass(p, box, frame, add(alpha[0], alpha[1]))
    alpha = (within(alpha[0], p, H1, FIRST), within(alpha[1], p, H2, FIRST))
    if not number > 0.0:
        follow(y, p, by_slow, by_fast, g, shift, frame)
        return
    variance, extra = at(p, FIRST, FIRST), divide(mean_noise(box, number), square(k))
    d = add(variance, extra)
    # 1 − var/D holds each uncertain number once as 1/(1 + var k²/R).
    kept = reciprocal(add(point(1.0), divide(variance, extra)))
    gain_psi = divide(add(alpha[0], alpha[1]), d)
    first = add(kept, scale(frame[GAMMA_1], gain_psi))
    second = subtract(divide(at(p, FIRST, SECOND), d), scale(frame[GAMMA_2], gain_psi))
    moves = moves_of(first, second, by_slow, by_fast, g, shift, frame)
    correct_state(y, moves, by_slow, by_fast, g, alpha, d, divide(point(reading_deg), k))
    correct_covariance(p, moves, extra, d, kept, alpha)


@kernel
def mean_noise(box: Floats, number: float) -> Pair:
    """Variance of the mean of `number` readings."""
    noise = entry(box, AT.reading_noise)
    return noise if number == 1.0 else divide(noise, point(number))


@kernel
def moves_of(first: Pair, second: Pair, by_slow: Pair, by_fast: Pair, g: Pair, shift: Pair, frame: Floats) -> Moves:
    """(slow, fast) parts of e after a tick for a unit of e1, of e2, of ψ and of z/k; `first` is 1 − σ1 and `second` σ2
    of `tick`."""
    return (
        to_eigen(multiply(first, by_slow), subtract(scale(frame[SLOW], shift), multiply(second, by_slow)), frame),
        to_eigen(multiply(first, by_fast), subtract(scale(frame[FAST], shift), multiply(second, by_fast)), frame),
        to_eigen(
            subtract(multiply(first, g), point(frame[GAMMA_1])),
            subtract(subtract(scale(frame[GAMMA_1], shift), point(frame[GAMMA_2])), multiply(second, g)),
            frame,
        ),
        to_eigen(subtract(point(1.0), first), second, frame),
    )


@kernel
def follow(y: Floats, p: Floats, by_slow: Pair, by_fast: Pair, g: Pair, shift: Pair, frame: Floats) -> None:
    """A tick without a reading: h is held, e and its covariance with h follow the model; var(c) is predicted before."""
    moves = moves_of(point(1.0), point(0.0), by_slow, by_fast, g, shift, frame)
    slow, fast, psi = entry(y, FIRST), entry(y, SECOND), heading(y)
    for i in (0, 1):
        put_entry(y, FIRST + i, three(moves[0][i], slow, moves[1][i], fast, moves[2][i], psi))
    move_with_heading(p, moves)


@kernel
def move_with_heading(p: Floats, moves: Moves) -> None:
    """cov(h, e) after a tick."""
    for i in (H1, H2):
        slow, fast, psi = at(p, i, FIRST), at(p, i, SECOND), with_heading(p, i)
        put_both(p, i, FIRST, three(moves[0][0], slow, moves[1][0], fast, moves[2][0], psi))
        put_both(p, i, SECOND, three(moves[0][1], slow, moves[1][1], fast, moves[2][1], psi))


@kernel
def with_next(p: Floats, i: int, by_slow: Pair, by_fast: Pair, g: Pair) -> Pair:
    """cov(h_i, c1⁻)."""
    return three(g, with_heading(p, i), by_slow, at(p, i, FIRST), by_fast, at(p, i, SECOND))


@kernel
def predict_compass(p: Floats, box: Floats, frame: Floats, next_psi: Pair) -> None:
    """The block of c: var(c1⁻) = b cov(ψ, c1⁻) + a1 cov(c1, c1⁻) + a2 cov(c2, c1⁻) + noise."""
    a1, a2, b, shift = entry(box, AT.a1), entry(box, AT.a2), entry(box, AT.b), entry(box, AT.shift)
    noise = entry(box, AT.compass_noise)
    psi_1 = add(with_first(p, H1, frame), with_first(p, H2, frame))
    psi_2 = add(with_second(p, H1, frame), with_second(p, H2, frame))
    p_11, p_12, p_22 = at(p, FIRST, FIRST), at(p, FIRST, SECOND), at(p, SECOND, SECOND)
    p_psi = add(with_heading(p, H1), with_heading(p, H2))
    next_1 = three(b, psi_1, a1, p_11, a2, p_12)
    next_2 = three(b, psi_2, a1, p_12, a2, p_22)
    by_rows = three(b, next_psi, a1, next_1, a2, next_2)
    squares = three(square(b), p_psi, square(a1), p_11, square(a2), p_22)
    crossed = add(multiply(multiply(a1, a2), p_12), multiply(b, add(multiply(a1, psi_1), multiply(a2, psi_2))))
    variance = add(intersect(by_rows, add(squares, scale(2.0, crossed))), noise)
    put(p, FIRST, FIRST, intersect(variance, (noise[0], math.inf)))
    put(p, SECOND, SECOND, add(multiply(square(shift), p_11), noise))
    put_both(p, FIRST, SECOND, within(multiply(shift, next_1), p, FIRST, SECOND))


@kernel
def correct_state(
    y: Floats, moves: Moves, by_slow: Pair, by_fast: Pair, g: Pair, alpha: tuple[Pair, Pair], d: Pair, z: Pair
) -> None:
    h1, h2, slow, fast = entry(y, H1), entry(y, H2), entry(y, FIRST), entry(y, SECOND)
    psi = add(h1, h2)
    rest = subtract(z, add(multiply(by_slow, slow), multiply(by_fast, fast)))
    put_entry(y, H1, pulled(h1, divide(alpha[0], d), g, subtract(rest, multiply(g, h2))))
    put_entry(y, H2, pulled(h2, divide(alpha[1], d), g, subtract(rest, multiply(g, h1))))
    for i in (0, 1):
        moved = three(moves[0][i], slow, moves[1][i], fast, moves[2][i], psi)
        put_entry(y, FIRST + i, add(moved, multiply(moves[3][i], z)))


@kernel
def pulled(x: Pair, gain: Pair, factor: Pair, rest: Pair) -> Pair:
    """x + gain (rest − factor x): the intersection with x used once and with x used twice."""
    once = add(multiply(subtract(point(1.0), multiply(factor, gain)), x), multiply(gain, rest))
    return intersect(once, add(x, multiply(gain, subtract(rest, multiply(factor, x)))))


@kernel
def correct_covariance(p: Floats, moves: Moves, extra: Pair, d: Pair, kept: Pair, alpha: tuple[Pair, Pair]) -> None:
    """P ← P − α αᵀ/D."""
    move_with_heading(p, moves)
    for i in (H1, H2):
        less = subtract(at(p, i, i), divide(square(alpha[i]), d))
        put(p, i, i, intersect(less, (0.0, p[i, i, 1])))
    between = subtract(at(p, H1, H2), divide(multiply(alpha[0], alpha[1]), d))
    put_both(p, H1, H2, within(between, p, H1, H2))
    other = at(p, FIRST, SECOND)
    less = subtract(at(p, SECOND, SECOND), divide(square(other), d))
    put(p, SECOND, SECOND, intersect(less, (0.0, p[SECOND, SECOND, 1])))
    put(p, FIRST, FIRST, reciprocal(add(reciprocal(at(p, FIRST, FIRST)), reciprocal(extra))))
    put_both(p, FIRST, SECOND, within(multiply(other, kept), p, FIRST, SECOND))


@kernel
def predict_vehicle(y: Floats, p: Floats, box: Floats, frame: Floats, difference: float) -> None:
    """One step of the vehicle, P4 (2): h_i ← p_i h_i + o_i B_i n_d; c is held, so d moves by −γ times the turn."""
    moved = point(0.0)
    for i in (H1, H2):
        pole, h = entry(box, AT.pole + i), entry(y, i)
        push = multiply(multiply(entry(box, AT.output + i), entry(box, AT.input + i)), point(difference))
        moved = add(moved, add(multiply(subtract(pole, point(1.0)), h), push))
        put_entry(y, i, add(multiply(pole, h), push))
    slow, fast = to_eigen(scale(frame[GAMMA_1], moved), scale(frame[GAMMA_2], moved), frame)
    put_entry(y, FIRST, subtract(entry(y, FIRST), slow))
    put_entry(y, SECOND, subtract(entry(y, SECOND), fast))
    gained = (subtract(entry(box, AT.pole), point(1.0)), subtract(entry(box, AT.pole + 1), point(1.0)))
    for i in (H1, H2):
        pole = entry(box, AT.pole + i)
        add_turn(p, i, add(multiply(gained[0], at(p, i, H1)), multiply(gained[1], at(p, i, H2))), frame)
        for j in (FIRST, SECOND):
            put_both(p, i, j, multiply(pole, at(p, i, j)))
    for i in (H1, H2):
        put(p, i, i, multiply(square(entry(box, AT.pole + i)), at(p, i, i)))
    put_both(p, H1, H2, multiply(multiply(entry(box, AT.pole), entry(box, AT.pole + 1)), at(p, H1, H2)))
    add_vehicle_noise(p, box, frame, entry(box, AT.vehicle_noise))
