"""`tune`: the inference of `estimate` with more effort, checked on a part of the log that it has not seen.

The last fifth of the fixes is held back. Whether a quick or a thorough inference from the rest predicts these fixes
better is nearly random. The mean of both predicts better than either, as averages over models do (J. A. Hoeting, D.
Madigan, A. E. Raftery and C. T. Volinsky, Statistical Science 14(4), 1999). The result is this mean if it predicts the
fixes held back better than the quick inference, by strong evidence (`BETTER`). Otherwise it is the profile that
`estimate` infers from the whole log.
"""

import math
from collections.abc import Callable, Iterable

import numpy as np

from steerway.core.errors import InputError
from steerway.core.records import OK, REJECTED, Fixes
from steerway.core.statistics import NORMAL_95
from steerway.estimation.filter.row import Rows
from steerway.estimation.fit.description import Tuned
from steerway.estimation.fit.posterior import Posterior
from steerway.estimation.fit.selection import BETTER, Inference, infer
from steerway.estimation.log.record import part_of
from steerway.estimation.log.run import Track, motion_of_track
from steerway.estimation.vessel.profile import Profile
from steerway.estimation.vessel.structures import Structure

_HELD_BACK = 0.2
"""Share of the fixes that is held back: one fold of the usual five (T. Hastie, R. Tibshirani and J. Friedman, The
Elements of Statistical Learning, 2nd ed., §7.10)."""
_FEWEST = 60
"""Least number of fixes with a course: three for each number of the plain structure. Fewer determine no motion."""
_MORE = 2
"""Factor on the rows and on the rounds of the quick inference: four times its work, some ten seconds."""


def tune(fixes: Fixes, name: str = "tuned", progress: Callable[[float], None] | None = None) -> Tuned:
    """Fit a profile to the longest track of `fixes`.

    Args:
        fixes: at least a minute of motion.
        name: of the profile.
        progress: called with the share of the work done, 0 to 1.

    Raises InputError when there is too little motion to fit anything.
    """
    report = progress or (lambda _: None)
    fixes = _longest_track(fixes)
    track = Track(fixes, ())
    record = track.record
    known = np.flatnonzero(np.isfinite(record.north))
    if len(known) < _FEWEST:
        raise InputError(f"the log has {len(known)} fixes, expected at least {_FEWEST} for tuning")
    cut = int(known[int((1.0 - _HELD_BACK) * len(known))])
    seen = part_of(record, 0, cut)
    quick = infer(seen)
    report(0.1)
    moving = int(np.isfinite(motion_of_track(track, quick.structures).cog).sum())
    if moving < _FEWEST:
        raise InputError(f"{moving} of {len(known)} fixes are under way, expected at least {_FEWEST} for tuning")
    both = [quick, infer(seen, (), _MORE)]
    report(0.5)
    default, better = (_predictive(record, each, cut) for each in (quick.structures, _mean(both)))
    is_better = better > default + BETTER
    final = [infer(record)]
    report(0.6)
    if is_better:
        final.append(infer(record, (), _MORE))
    report(1.0)
    motion = motion_of_track(track, _mean(final))
    nis = motion.nis[np.isin(motion.status, (OK, REJECTED)) & np.isfinite(motion.nis)]
    return Tuned(
        profile=Profile(name=name, structures=_with_intervals(final)),
        default=Profile.of(final[0].structures),
        fixes=len(known),
        moving=moving,
        rejected=int((motion.status == REJECTED).sum()),
        nis_mean=float(nis.mean()) if len(nis) else math.nan,
        nis_within_pct=100.0 * float((nis < -2.0 * math.log(0.05)).mean()) if len(nis) else math.nan,
        held_back=int(np.sum(known >= cut)),
        held_back_log_likelihood=better if is_better else default,
        default_held_back_log_likelihood=default,
        at_bounds=tuple(dict.fromkeys(name for one in final for fit in one.used for name in fit.at_bounds)),
    )


def log_likelihood(fixes: Fixes, profile: Profile, since: float) -> float:
    """Sum of the log densities (1/m² a fix) that a profile predicts for a vessel's fixes from `since` (Unix s) on.

    Every fix is predicted from the fixes before it.
    """
    record = Track(fixes, ()).record
    return _predictive(record, profile.structures, int(np.searchsorted(record.time, since)))


def _mean(found: list[Inference]) -> list[Structure]:
    """The structures of several inferences, with equal weights for the inferences."""
    return [each.model_copy(update={"weight": each.weight / len(found)}) for one in found for each in one.structures]


def _predictive(record: Rows, structures: Iterable[Structure], cut: int) -> float:
    """Sum of the log densities that weighted structures predict for the rows from `cut` on, each from all before it."""
    logs = []
    for each in structures:
        posterior = Posterior(each.parts, record)
        logs.append(math.log(each.weight) + posterior.densities(posterior.point(each.values))[cut:])
    return float(np.logaddexp.reduce(logs, axis=0).sum())


def _with_intervals(found: list[Inference]) -> tuple[Structure, ...]:
    """The structures of several inferences with 95 % intervals of their numbers (Laplace)."""
    deviations = [{fit.parts: fit.deviations for fit in one.fits} for one in found for _ in one.structures]
    structures = []
    for each, spread in zip(_mean(found), deviations, strict=True):
        factors = {name: math.exp(NORMAL_95 * std) for name, std in spread[each.parts].items()}
        intervals = {name: (each.values[name] / factor, each.values[name] * factor) for name, factor in factors.items()}
        structures.append(each.model_copy(update={"intervals": intervals}))
    return tuple(structures)


def _longest_track(fixes: Fixes) -> Fixes:
    """The fixes of the vessel with the most fixes."""
    fixes = fixes.rows(fixes.has_position).in_order()
    return max((track for _, track in fixes.tracks()), key=len)
