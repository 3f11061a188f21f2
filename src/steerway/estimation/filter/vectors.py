"""Vectors and symmetric matrices of the plane, north and east, written out: numba's `@` is several times slower."""

import math
from typing import NamedTuple

from steerway.core.compiled import lean_kernel


class Vec2(NamedTuple):
    """A vector."""

    n: float
    e: float


class Sym2(NamedTuple):
    """A symmetric matrix."""

    nn: float
    ne: float
    ee: float


@lean_kernel
def plus(a: Sym2, b: Sym2) -> Sym2:
    """Sum of two matrices."""
    return Sym2(a.nn + b.nn, a.ne + b.ne, a.ee + b.ee)


@lean_kernel
def scaled(factor: float, a: Sym2) -> Sym2:
    """A matrix times a number."""
    return Sym2(factor * a.nn, factor * a.ne, factor * a.ee)


@lean_kernel
def outer(v: Vec2) -> Sym2:
    """v vᵀ."""
    return Sym2(v.n * v.n, v.n * v.e, v.e * v.e)


@lean_kernel
def widened(a: Sym2, variance: float) -> Sym2:
    """A covariance with the same variance added in every direction."""
    return Sym2(a.nn + variance, a.ne, a.ee + variance)


@lean_kernel
def times(a: Sym2, v: Vec2) -> Vec2:
    """Product of a matrix and a vector."""
    return Vec2(a.nn * v.n + a.ne * v.e, a.ne * v.n + a.ee * v.e)


@lean_kernel
def sandwich(a: Sym2, b: Sym2) -> Sym2:
    """a b a of two matrices."""
    nn, ne = a.nn * b.nn + a.ne * b.ne, a.nn * b.ne + a.ne * b.ee
    en, ee = a.ne * b.nn + a.ee * b.ne, a.ne * b.ne + a.ee * b.ee
    return Sym2(nn * a.nn + ne * a.ne, nn * a.ne + ne * a.ee, en * a.ne + ee * a.ee)


@lean_kernel
def trace(a: Sym2) -> float:
    """Sum of the diagonal."""
    return a.nn + a.ee


@lean_kernel
def determinant(a: Sym2) -> float:
    """Determinant of a matrix."""
    return a.nn * a.ee - a.ne * a.ne


@lean_kernel
def inverse(a: Sym2) -> Sym2:
    """a⁻¹."""
    d = determinant(a)
    return Sym2(a.ee / d, -a.ne / d, a.nn / d)


@lean_kernel
def dot(v: Vec2, w: Vec2) -> float:
    """vᵀ w."""
    return v.n * w.n + v.e * w.e


@lean_kernel
def nis(v: Vec2, s: Sym2) -> float:
    """Normalised innovation squared, vᵀ S⁻¹ v."""
    return (s.ee * v.n * v.n - 2.0 * s.ne * v.n * v.e + s.nn * v.e * v.e) / determinant(s)


@lean_kernel
def density(v: Vec2, s: Sym2, freedom: float) -> float:
    """Density (1/m²) of an innovation v (m) under Student's t distribution of scale S (m²).

    freedom: its degrees of freedom; infinite for the normal distribution.
    """
    scale = 2.0 * math.pi * math.sqrt(determinant(s))
    if math.isinf(freedom):
        return math.exp(-0.5 * nis(v, s)) / scale
    tail = 1.0 + nis(v, s) / freedom
    power = tail**3 if freedom == 4.0 else tail ** (0.5 * freedom + 1.0)  # a cube takes less time
    return 1.0 / (scale * power)
