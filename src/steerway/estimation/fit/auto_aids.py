"""`--aid auto`: the receiver's own SOG and COG are used if a log shows that they carry information.

They carry information if they improve the prediction of the fixes: the density of every fix given the fixes and
velocities before it (C. W. J. Granger, Econometrica 37(3), 1969). A velocity that the receiver differenced from the
same positions improves no prediction. The inference then estimates the noise and the lasting error of SOG and COG.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from steerway.core.arrays import Bools, Floats, Ints
from steerway.core.records import Fixes
from steerway.estimation.filter.row import Rows
from steerway.estimation.fit.posterior import Posterior
from steerway.estimation.fit.selection import BETTER
from steerway.estimation.log.outage import SLIDES, outages
from steerway.estimation.log.record import rows_of
from steerway.estimation.log.run import Track
from steerway.estimation.vessel.aids import AIDS, COG, SOG
from steerway.estimation.vessel.profile import Profile
from steerway.estimation.vessel.structures import Structure

AUTO = "auto"
VELOCITY = ("sog", "cog")
_NOISES = (0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6)
"""1σ (m/s) tried for SOG and COG, all equally probable: from that of a Doppler velocity to that of a poor receiver."""
_NO_ERROR = {"sog_error_std": 1e-3, "sog_error_time": 2.0, "cog_error_std": 1e-3, "cog_error_time": 2.0}
"""Numbers of a negligible lasting error: its σ is a twentieth of the least of `_NOISES`."""
_BLOCKS, _BLOCK = 4, 400
"""Number of pieces of the log that are compared, and of fixes in each piece. Both bound the time of the comparison."""


class Velocity(NamedTuple):
    """The receiver's velocity as an aid: its noise along and across the course (m/s), and the gain of log density.

    The gain is the log of the density of the fixes with the velocity, averaged over `_NOISES`, less that without it.
    """

    noise: float
    gain: float


def velocity_of(fixes: Fixes, structures: Sequence[Structure]) -> Velocity | None:
    """The noise with which SOG and COG predict a vessel's fixes best; None where they do not improve the prediction.

    structures: inferred from positions alone.
    """
    known = np.isfinite(fixes.sog) & np.isfinite(fixes.cog)
    if fixes.mmsi is not None or known.sum() < _BLOCK // 4:
        return None
    return velocity_in(Track(fixes, VELOCITY).record, structures)


def velocity_in(record: Rows, structures: Sequence[Structure]) -> Velocity | None:
    """As `velocity_of`, for a record whose aids are SOG and COG."""
    if not len(record.aids) or np.isfinite(record.north).sum() < _BLOCK // 4:
        return None
    best = max(structures, key=lambda each: each.weight)
    rows, judged = _pieces(record)
    without = _density(best, rows, judged)
    gains = [_density(with_noise(best, noise), rows, judged) - without for noise in _NOISES]
    gain = float(np.logaddexp.reduce(gains)) - math.log(len(_NOISES))
    return Velocity(_NOISES[int(np.argmax(gains))], gain) if gain > BETTER else None


def with_noise(structure: Structure, noise: float) -> Structure:
    """The structure with the parts SOG and COG added, both with this noise (m/s)."""
    numbers = {"sog_std": noise, "velocity_std": noise} | _NO_ERROR
    return structure.model_copy(update={"parts": (*structure.parts, *VELOCITY), "values": structure.values | numbers})


def velocity_parts(profile: Profile) -> tuple[str, ...]:
    """Which of SOG and COG are parts of the profile's structures; empty for a profile without structures."""
    return tuple(name for name in VELOCITY if any(name in each.parts for each in profile.structures))


def _density(structure: Structure, rows: Rows, judged: Bools) -> float:
    """Sum of the log densities of the `judged` fixes, each given the rows before it."""
    posterior = Posterior(structure.parts, rows)
    return float(posterior.densities(posterior.point(structure.values))[judged].sum())


def _pieces(record: Rows) -> tuple[Rows, Bools]:
    """Pieces of a record, with each row twice (its fix, then its velocity); and (n,) bool, which fixes count."""
    fixed = np.flatnonzero(np.isfinite(record.north))
    starts = np.unique(np.linspace(0, max(len(fixed) - _BLOCK, 0), _BLOCKS).astype(int))
    own = [np.arange(fixed[begin], fixed[min(begin + _BLOCK, len(fixed)) - 1] + 1) for begin in starts]
    rows = np.repeat(np.concatenate(own), 2)
    restarts = 2 * np.cumsum([len(each) for each in own])[:-1]
    second = np.arange(len(rows)) % 2 == 1
    pieces = rows_of(record, rows, restarts)
    pieces.north[second] = pieces.east[second] = np.nan
    pieces.aids[~(second[:, None] & np.isin(np.arange(len(AIDS)), (SOG, COG)))] = np.nan
    return pieces, np.isfinite(pieces.north) & ~_sliding(record.time, fixed)[rows]


def _sliding(time: Floats, fixed: Ints) -> Bools:
    """(n,) bool: rows soon after an outage, where positions may slide (see `outage`) and no velocity predicts them."""
    found = np.zeros(len(time), bool)
    for k in outages(time[fixed]):
        back = time[fixed[k + 1]]
        found |= (time >= back) & (time < back + 2.0 * SLIDES)
    return found
