"""Variance of a fix by the accuracy its receiver reports.

A reported accuracy is not the noise that a filter sees: errors of a metre are much the same from fix to fix. So a
profile states the usual noise of a receiver, and the reported accuracy counts relative to its usual value. Up to twice
that it fluctuates without meaning; from there on the noise grows with it. (Over 47 logs of windsurfers with u-blox
receivers noise from fix to fix is 1.0 times the usual where the report is two to three times its median, 1.5 times at
five, 2 at ten and 7 at twenty to thirty.) A fix reported better than usual is seldom better.
"""

import math

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel, lean_kernel

USUAL, COUNT = range(2)
"""State of a receiver: log of its usual reported deviation, and of how many of the first fixes."""

_MEANINGLESS = 2.0
"""Factor by which reports differ between fixes that are alike. Chosen by the logs above."""
_FIRST = 20.0
"""Fixes whose mean is the usual value to begin with. Chosen: some seconds, before which a boat does not depend on
it."""
_RISE, _FALL = 3e-4, 1e-3
"""Largest change of the logarithm per fix, which so converges to about the lower quartile (0.3/1.3 = 0.23): neither
half an hour under trees nor reports of kilometres become usual, and a start under trees is forgotten. Chosen."""


@lean_kernel
def variance_scale(usual: Floats, reported: float) -> float:
    """How many times its usual variance a fix has, at least 1, by its reported deviation (m; NaN: none).

    usual: (2,) state of the receiver, updated; zero before its first fix.
    """
    if not (reported > 0.0 and math.isfinite(reported)):
        return 1.0
    level = math.log(reported)
    excess = level - usual[USUAL] if usual[COUNT] > 0.0 else 0.0
    if usual[COUNT] < _FIRST:
        usual[COUNT] += 1.0
        usual[USUAL] += (level - usual[USUAL]) / usual[COUNT]
    else:
        usual[USUAL] += min(max(excess, -_FALL), _RISE)
    return max(math.exp(excess) / _MEANINGLESS, 1.0) ** 2


@kernel
def variance_scales_of(usual: Floats, reported: Floats) -> Floats:
    """`variance_scale` of one receiver's fixes (n,) in their order."""
    found = np.empty(len(reported))
    for k in range(len(reported)):
        found[k] = variance_scale(usual, reported[k])
    return found
