"""Bounds trusted to the last bit: the composite filter in 400-bit numbers, beside intervals of doubles."""

import math
from decimal import Context, Decimal, localcontext

import numpy as np

from steerway.estimation.heading import START_VARIANCE, CompositeFilter, IntervalFilter, box_of, composite_model
from steerway.sensors import TCM2

PRECISION = Context(prec=125)
"""Decimal digits: 415 bits."""


def exact_headings(model, differences, readings) -> list[Decimal]:
    """Headings (rad) of the ordinary composite filter from the same doubles, nothing rounded before the 125th digit."""
    with localcontext(PRECISION):
        return _exact(model, differences, readings)


def _exact(model, differences, readings):
    values = [Decimal(float(each)) for each in model]
    poles, pushes, outputs = values[0:2], values[2:4], values[4:6]
    a1, a2, b, k, shift, waves, noise, spread = values[6:]
    g = [b * outputs[0], b * outputs[1], a1, a2]
    start = [Decimal(START_VARIANCE)] * 2 + [Decimal(1)] * 2
    x, p = [Decimal(0)] * 4, [[start[i] if i == j else Decimal(0) for j in range(4)] for i in range(4)]
    headings = []
    for difference, second in zip(differences, readings, strict=True):
        for reading in np.degrees(second):
            x = [x[0], x[1], sum(gi * xi for gi, xi in zip(g, x, strict=True)), shift * x[2]]
            row = [sum(p[i][j] * g[j] for j in range(4)) for i in range(4)]
            late = shift * shift * p[2][2] + noise
            for i in range(2):
                p[i][3] = p[3][i] = shift * p[i][2]
                p[i][2] = p[2][i] = row[i]
            p[2][3] = p[3][2] = shift * row[2]
            p[2][2], p[3][3] = sum(gi * ri for gi, ri in zip(g, row, strict=True)) + noise, late
            pc = [k * p[i][2] for i in range(4)]
            s = k * pc[2] + spread
            innovation = Decimal(float(reading)) - k * x[2]
            x = [xi + c / s * innovation for xi, c in zip(x, pc, strict=True)]
            p = [[p[i][j] - pc[i] * pc[j] / s for j in range(4)] for i in range(4)]
        for i in range(2):
            x[i] = poles[i] * x[i] + pushes[i] * Decimal(float(difference))
            for j in range(4):
                p[i][j] *= poles[i]
            for j in range(4):
                p[j][i] *= poles[i]
            p[i][i] += waves
        headings.append((outputs[0] * x[0] + outputs[1] * x[1]) * Decimal(math.pi / 180.0))
    return headings


def rigour(differences, readings, interval_filter=IntervalFilter) -> tuple[float, float]:
    """Share (%) of seconds in which bounds with outward rounding hold the exact estimate, and in which bounds without
    any, which for a point model are the ordinary filter's double, do."""
    model = composite_model(TCM2)
    bounds, naive = interval_filter(box_of(model, 0.0)), CompositeFilter(model)
    held = plain = 0
    exact = exact_headings(model, differences, readings)
    for difference, second, truth in zip(differences, readings, exact, strict=True):
        low, high = bounds.step(difference, second)
        held += not math.isnan(low) and Decimal(low) <= truth <= Decimal(high)
        plain += Decimal(naive.step(difference, second)) == truth
    return 100.0 * held / len(exact), 100.0 * plain / len(exact)
