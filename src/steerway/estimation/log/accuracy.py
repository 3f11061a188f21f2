"""Variance of a fix by the accuracy its receiver reports.

A reported accuracy is not the noise that a filter sees, because most of the error persists from fix to fix. A profile
therefore states the usual noise of a receiver, and the reported accuracy counts relative to its own usual value. Up to
twice that value it is ignored; above, the noise grows in proportion. (In 47 logs of windsurfers with u-blox receivers,
noise from fix to fix is 1.0 times the usual at reports of two to three times their median, 1.5 times at five, 2 at ten
and 7 at twenty to thirty.) A fix that is reported better than usual is seldom better.
"""

import math

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel, lean_kernel

USUAL, COUNT = range(2)
"""Columns of a receiver's state: log of its usual reported σ, and the number of fixes averaged, up to `_FIRST`."""

_MEANINGLESS = 2.0
"""Ratio to the usual report up to which a report is ignored. See the logs above."""
_FIRST = 20.0
"""Number of fixes (some seconds) whose mean is the first usual value."""
_RISE, _FALL = 3e-4, 1e-3
"""Largest change per fix of the usual value's log, up and down. The usual value thus converges to about the lower
quartile (0.3/1.3 = 0.23): half an hour under trees does not become usual, and a start under trees is forgotten."""


@lean_kernel
def variance_scale(usual: Floats, reported: float) -> float:
    """Factor (at least 1) on the usual variance of a fix, from its reported σ (m; NaN: none).

    usual: (2,) state of the receiver, updated in place; zeros before the first fix.
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
    """(n,) `variance_scale` of one receiver's fixes in order."""
    found = np.empty(len(reported))
    for k in range(len(reported)):
        found[k] = variance_scale(usual, reported[k])
    return found
