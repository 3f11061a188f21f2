"""Interval arithmetic with guaranteed outward rounding, on pairs (low, high) of floats.

Every operation rounds to nearest and then widens by 2.3e-16 |x| + 1e-300. Half a unit in the last place is at most
1.11e-16 |x| (2⁻⁵³); the subtraction that widens errs by as much again; 1e-300 covers underflow. No rounding mode is
switched, so nothing else in the process is touched. NaN and infinite bounds mean that nothing is known.

The operations are those of Moore, Kearfott and Cloud, Introduction to Interval Analysis (2009), chapter 2.
"""

import math

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel

__all__ = [
    "add",
    "at",
    "divide",
    "entry",
    "matrix_multiply",
    "matrix_multiply_transposed",
    "multiply",
    "outward_radians",
    "point",
    "put",
    "put_entry",
    "scale",
    "sound",
    "subtract",
]
"""Public, for other filters on intervals."""

Pair = tuple[float, float]
"""Bounds (low, high)."""
GIVE = 2.3e-16
TINY = 1e-300
"""Relative and absolute part of the widening; derived above."""


@kernel
def outward(low: float, high: float) -> Pair:
    """An interval that contains all numbers between bounds that were rounded to these two."""
    return low - (GIVE * abs(low) + TINY), high + (GIVE * abs(high) + TINY)


@kernel
def add(a: Pair, b: Pair) -> Pair:
    """a + b."""
    return outward(a[0] + b[0], a[1] + b[1])


@kernel
def subtract(a: Pair, b: Pair) -> Pair:
    """a − b."""
    return outward(a[0] - b[1], a[1] - b[0])


@kernel
def multiply(a: Pair, b: Pair) -> Pair:
    """a b."""
    w, x, y, z = a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]
    return outward(min(w, x, y, z), max(w, x, y, z))


@kernel
def scale(factor: float, a: Pair) -> Pair:
    """A float times an interval."""
    w, x = factor * a[0], factor * a[1]
    return outward(min(w, x), max(w, x))


@kernel
def square(a: Pair) -> Pair:
    """a²; tighter than multiply(a, a) if a contains 0."""
    w, x = a[0] * a[0], a[1] * a[1]
    low = 0.0 if a[0] <= 0.0 <= a[1] else min(w, x)
    low, high = outward(low, max(w, x))
    return max(low, 0.0), high


@kernel
def reciprocal(a: Pair) -> Pair:
    """1/a; (−∞, ∞) if a contains 0."""
    if a[0] <= 0.0 <= a[1]:
        return -math.inf, math.inf
    return outward(1.0 / a[1], 1.0 / a[0])


@kernel
def divide(a: Pair, b: Pair) -> Pair:
    """a/b; (−∞, ∞) if b contains 0."""
    if b[0] <= 0.0 <= b[1]:
        return -math.inf, math.inf
    w, x, y, z = a[0] / b[0], a[0] / b[1], a[1] / b[0], a[1] / b[1]
    return outward(min(w, x, y, z), max(w, x, y, z))


@kernel
def root(a: Pair) -> Pair:
    """√a for the part of a that is not negative."""
    low, high = outward(math.sqrt(max(a[0], 0.0)), math.sqrt(max(a[1], 0.0)))
    return max(low, 0.0), high


@kernel
def intersect(a: Pair, b: Pair) -> Pair:
    """The intersection of two enclosures of one number. An empty one stays empty (low > high)."""
    return max(a[0], b[0]), min(a[1], b[1])


@kernel
def point(x: float) -> Pair:
    """The interval of one number."""
    return x, x


@kernel
def sound(a: Pair) -> bool:
    """Whether this is a bounded interval: numbers, finite, not empty."""
    return -math.inf < a[0] <= a[1] < math.inf


@kernel
def at(m: Floats, i: int, j: int) -> Pair:
    """Entry of an interval matrix (n, m, 2)."""
    return m[i, j, 0], m[i, j, 1]


@kernel
def put(m: Floats, i: int, j: int, a: Pair) -> None:
    """Write an entry of an interval matrix (n, m, 2)."""
    m[i, j, 0], m[i, j, 1] = a[0], a[1]


@kernel
def entry(x: Floats, i: int) -> Pair:
    """Entry of an interval vector (n, 2)."""
    return x[i, 0], x[i, 1]


@kernel
def put_entry(x: Floats, i: int, a: Pair) -> None:
    """Write an entry of an interval vector (n, 2)."""
    x[i, 0], x[i, 1] = a[0], a[1]


@kernel
def matrix_multiply(a: Floats, b: Floats, out: Floats) -> None:
    """out ← A B for interval matrices (n, m, 2), term by term."""
    for i in range(a.shape[0]):
        for j in range(b.shape[1]):
            total = (0.0, 0.0)
            for k in range(a.shape[1]):
                total = add(total, multiply(at(a, i, k), at(b, k, j)))
            put(out, i, j, total)


@kernel
def matrix_multiply_transposed(a: Floats, b: Floats, out: Floats) -> None:
    """out ← A Bᵀ for interval matrices."""
    for i in range(a.shape[0]):
        for j in range(b.shape[0]):
            total = (0.0, 0.0)
            for k in range(a.shape[1]):
                total = add(total, multiply(at(a, i, k), at(b, j, k)))
            put(out, i, j, total)


@kernel
def outward_radians(low: float, high: float) -> Pair:
    """Bounds in degrees as bounds in radians."""
    return multiply((low, high), (math.pi / 180.0, math.pi / 180.0))
