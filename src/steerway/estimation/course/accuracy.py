"""How far to doubt a fix by what its receiver says of its accuracy.

What a receiver says is not the noise that a filter sees: its errors of a metre are much the same from fix to fix. So a
profile tells how the receiver is as a rule, and what it says of one fix counts against what it says as a rule. Up to
twice as much it wavers and means nothing; from there on the noise grows with it. (Over 47 logs of windsurfers with
u-blox receivers noise from fix to fix is 1.0 times the usual where they say two to three times their median, 1.5 times
at five, 2 at ten and 7 at twenty to thirty.) A receiver that calls itself better than usual is seldom better.
"""

import math

import numpy as np

from steerway.core.compiled import kernel, lean_kernel

USUAL, COUNT = range(2)
"""What is remembered of a receiver: log of the deviation it states as a rule, and of how many of the first fixes."""

_WAVERING = 2.0
"""What a receiver says differs by so much between fixes that are alike."""
_FIRST = 20.0
"""Fixes whose mean is the rule to begin with."""
_RISE, _FALL = 3e-4, 1e-3
"""Most that a fix moves the rule by, which so comes to what a quarter of the fixes fall below: neither half an hour
under trees nor the kilometres that a receiver in trouble says make a new rule, and a start under trees is forgotten."""


@lean_kernel
def doubt(usual, said):
    """How many times its usual variance a fix has, at least 1, by the deviation said of it (m; NaN: nothing was said).

    usual: (2,) what is remembered, brought up to date; of a receiver not heard yet all zero.
    """
    if not (said > 0.0 and math.isfinite(said)):
        return 1.0
    level = math.log(said)
    excess = level - usual[USUAL] if usual[COUNT] > 0.0 else 0.0
    if usual[COUNT] < _FIRST:
        usual[COUNT] += 1.0
        usual[USUAL] += (level - usual[USUAL]) / usual[COUNT]
    else:
        usual[USUAL] += min(max(excess, -_FALL), _RISE)
    return max(math.exp(excess) / _WAVERING, 1.0) ** 2


@kernel
def doubts_of(usual, said):
    """`doubt` of one receiver's fixes (n,) in their order."""
    found = np.empty(len(said))
    for k in range(len(said)):
        found[k] = doubt(usual, said[k])
    return found
