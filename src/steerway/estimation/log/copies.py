"""Copies of fixes: positions that a receiver holds, or that a logger writes twice."""

import numpy as np

from steerway.core.arrays import Bools, Floats


def without_copies(
    time: Floats, north: Floats, east: Floats, digits: tuple[float, float] = (0.0, 0.0)
) -> tuple[Floats, Floats]:
    """North and east (n,) with NaN for copies of the fix before.

    Coarse positions of a vessel that hardly moves repeat themselves too. After such a repeat the position moves by a
    step or two; after a copy it moves by the whole displacement since. A vessel that moved at `REST_SPEED` or less
    since the first repeat was at rest, whatever the next step is. If a vessel is too fast for rounding to repeat a fix,
    each repeat is a copy.

    digits: the last digit of north and of east, m; 0 for positions that are not rounded.
    """
    north, east = np.array(north, dtype=np.float64), np.array(east, dtype=np.float64)
    known = np.flatnonzero(np.isfinite(north) & np.isfinite(east))
    if len(known) < 3:
        return north, east
    steps = np.abs(np.diff(np.column_stack([north[known], east[known]]), axis=0))
    same = (steps == 0.0).all(axis=1)
    if not same.any():
        return north, east
    resolved = np.where(steps > TURNED * steps.max(axis=1, keepdims=True), steps, np.nan)
    resolution = [np.nanquantile(column, 0.05) if np.isfinite(column).any() else 0.0 for column in resolved.T]
    coarse = np.maximum(np.nan_to_num(resolution), 1e-9)
    far = (steps > FEW_STEPS * coarse).any(axis=1)
    follows = np.flatnonzero(~same)  # the next move after each run of repeats
    after = np.searchsorted(follows, np.arange(len(same)))
    at = time[known]
    since = at[np.append(0, follows + 1)]
    way = REST_SPEED * (at[follows + 1] - since[:-1])
    gone = far[follows] & (np.hypot(*steps[follows].T) > way)
    moved = np.append(gone, at[-1] - since[-1] <= HELD)[after]
    copies = known[1:][same & (moved | _under_way(north[known], east[known], digits))]
    north[copies] = east[copies] = np.nan
    return north, east


def _under_way(north: Floats, east: Floats, digits: tuple[float, float]) -> Bools:
    """(n − 1,) bool: steps in which rounding cannot repeat a fix, by the displacements before and after.

    A displacement of more than n + 1.5 digits in n steps is more than a digit per step, however it is rounded.
    """
    found = np.zeros(len(north) - 1, bool)
    for column, digit in zip((north, east), digits, strict=True):
        for steps in _STEPS_BESIDE if digit else ():
            way = column[steps:] - column[:-steps]
            before, after = way[: -steps - 1], way[steps + 1 :]
            least = (steps + 1.5) * digit
            found[steps : len(north) - 1 - steps] |= (np.minimum(np.abs(before), np.abs(after)) > least) & (
                before * after > 0.0
            )
    return found


_STEPS_BESIDE = 2, 3, 4
"""Numbers of steps before and after a repeat over which a vessel has to move; over more steps it may stop and go."""
REST, REST_SPEED = 10.0, 0.3
"""Time, s, and speed, m/s (`course.STEERAGEWAY`): at rest, a vessel is no faster in this time before and after a
repeat."""
HELD = 1.0
"""Longest time, s, for which repeats at the end of a record count as copies. Loggers repeat for less; a boat that stays
at one place for longer has stopped."""
TURNED = 1e-4
"""Ratio of a step along one axis to that along the other below which it is 0. As meridians converge, a step due north
goes a little east in the plane: by this ratio after 0.7 km at 60° of latitude."""
FEW_STEPS = 2.5
"""Largest step of a vessel that hardly moves, in units of the resolution: one or two, plus rounding."""
