"""`tune`: the inference of `estimate` with more effort, checked on a part of the log that it has not seen.

The last fifth of the fixes is held back. To the quick inference in the rest comes a thorough one, on more rows and from
more starting points. Which of the two predicts later fixes better is all but chance; the mean of both predicts them
better than either, as averages over what a log leaves open do (J. A. Hoeting, D. Madigan, A. E. Raftery and C. T.
Volinsky, Statistical Science 14(4), 1999). It is taken where it predicts the fixes held back better than the quick one
by what is called strong evidence; else the answer is what `estimate` finds by itself in the whole log.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from steerway.core.errors import InputError
from steerway.core.records import OK, REJECTED, Fixes
from steerway.estimation.inference.description import structures_of
from steerway.estimation.inference.fit import FURTHEST, Fit, Posterior, Rows, fitted, likeliest
from steerway.estimation.inference.parts import PLAIN
from steerway.estimation.inference.record import excerpt
from steerway.estimation.inference.selection import (
    BETTER,
    FEW,
    FINALISTS,
    LAST_ROUNDS,
    MANY,
    Inference,
    Structure,
    infer,
    screened,
    weighed,
)
from steerway.estimation.inference.starts import scales_of
from steerway.estimation.inference.whole_log import Track, motion_of, part_of
from steerway.estimation.profiles.inferred import InferredProfile, WeighedStructure

_HELD_BACK = 0.2
"""Share of the fixes, the last ones. Chosen: one part where five are usual (T. Hastie, R. Tibshirani and J. Friedman,
The Elements of Statistical Learning, 2nd ed., §7.10)."""
_FEWEST = 60
"""Fixes with a course; with fewer no number of the motion is determined. Chosen: three for each
number of the plain structure."""
_MORE = 2
"""How many times the rows and the differences of the quick inference: four times its work. Chosen: some ten
seconds."""
_FAR_BEHIND = 30.0
"""Log evidence by which a structure may be behind the best after its first round: further rounds gain some 20 at most
(in five recorded logs 1 to 48)."""
_INTERVAL = 1.96
"""Standard deviations of a 95 % interval: the 0.975 quantile of the normal distribution."""


@dataclass(frozen=True)
class Tuned:
    """A profile fitted to a log, and how well what was found in the rest predicts the fixes that were held back."""

    profile: InferredProfile
    default: InferredProfile
    """What `estimate` finds by itself in the same fixes."""
    fixes: int
    moving: int
    rejected: int
    nis_mean: float
    """Over all fixes; 2 where noise is as inferred and no fix is wrong."""
    nis_within_pct: float
    """Share of fixes within the predicted 95 % region."""
    held_back: int
    held_back_log_likelihood: float
    default_held_back_log_likelihood: float
    at_bounds: tuple[str, ...]
    """Numbers that ended at the bounds of the search."""

    @property
    def is_default(self) -> bool:
        """Whether more effort found nothing that predicts better than the default."""
        return self.held_back_log_likelihood <= self.default_held_back_log_likelihood

    @property
    def cannot_tell(self) -> tuple[str, ...]:
        """Names of the numbers that this log does not determine: see `InferredProfile`."""
        return tuple(
            dict.fromkeys(
                name for each in self.profile.structures for name in each.values if not each.is_determined(name)
            )
        )

    def as_dict(self) -> dict:
        """All as plain numbers, texts and lists; `structures` as in the profile."""
        names = ("fixes", "moving", "rejected", "nis_mean", "nis_within_pct", "held_back", "held_back_log_likelihood")
        own = {name: getattr(self, name) for name in (*names, "default_held_back_log_likelihood", "is_default")}
        structures = [each.model_dump(mode="json") for each in self.profile.structures]
        lists = {"at_bounds": list(self.at_bounds), "cannot_tell": list(self.cannot_tell)}
        return own | lists | {"structures": structures}

    def sentences(self) -> list[tuple[str, str]]:
        """The fit as (what, value) pairs of text."""
        ours, default = self.held_back_log_likelihood, self.default_held_back_log_likelihood
        verdict = (
            "the default's, which more effort does not improve"
            if self.is_default
            else f"better by {ours - default:.1f}"
        )
        return [
            ("fixes", f"{self.fixes}, {self.moving} under way, {self.rejected} rejected"),
            *((f"weight {each['weight']:.2f}", each["words"]) for each in structures_of(self.profile)),
            *([("at a bound", ", ".join(self.at_bounds))] if self.at_bounds else []),
            *([("not determined", ", ".join(self.cannot_tell))] if self.cannot_tell else []),
            ("NIS", f"{self.nis_mean:.2f} (2 expected), {self.nis_within_pct:.1f} % of fixes in the predicted 95 %"),
            (f"log likelihood of {self.held_back} fixes held back", f"{ours:.1f}, default {default:.1f}: {verdict}"),
        ]


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
    record = Track(fixes, ()).record
    known = np.flatnonzero(np.isfinite(record.north))
    cut = int(known[int((1.0 - _HELD_BACK) * len(known))]) if len(known) else 0
    seen = part_of(record, 0, cut)
    if len(known) < _FEWEST:
        raise InputError(f"the log has {len(known)} fixes, expected at least {_FEWEST} under way to tune by")
    quick = infer(seen)
    report(0.15)
    moving = int(np.isfinite(motion_of(fixes, quick.structures).cog).sum())
    if moving < _FEWEST:
        raise InputError(f"{moving} of {len(known)} fixes are under way, expected at least {_FEWEST} to tune by")
    thorough = _thorough(seen, quick, lambda share: report(0.15 + 0.5 * share))
    default, better = (_predictive(record, each, cut) for each in (quick.structures, _mean(quick, thorough)))
    final = [infer(record)]
    report(0.8)
    if better > default + BETTER:
        final.append(_refitted(record, thorough))
    report(1.0)
    held_back = len(known) - int(np.sum(known < cut))
    return _tuned(fixes, record, final, name, moving, held_back, better if len(final) > 1 else default, default)


def log_likelihood(fixes: Fixes, profile: InferredProfile, since: float) -> float:
    """Log density (1/m² a fix) that a profile predicts for the fixes of one vessel from a time (s) on.

    Every fix from those before it.
    """
    record = Track(fixes, ()).record
    return _predictive(record, profile.weighed, int(np.searchsorted(record.time, since)))


def _thorough(record: Rows, quick: Inference, report) -> Inference:
    """The inference on more rows, begun from the quick one's results and from those of a search of its own."""
    few, many = excerpt(record, _MORE * FEW, 0.5), excerpt(record, _MORE * MANY, 0.25)
    scales = scales_of(record)
    shortest = scales.shortest
    starts = {fit.parts: [fit.values] for fit in quick.fits}
    for parts, fit in list(screened(PLAIN, few, scales).items())[:FINALISTS]:
        starts.setdefault(parts, []).append(fit.values)
    report(0.3)
    first: dict[tuple, Fit] = {}
    for parts, each in starts.items():
        first[parts] = fitted(parts, many, likeliest(parts, many, each, shortest)[0][0], 1, shortest)
        report(0.3 + 0.3 * len(first) / len(starts))
    least = max(fit.evidence for fit in first.values()) - _FAR_BEHIND
    return weighed(
        {
            parts: fitted(parts, many, fit.values, _MORE * LAST_ROUNDS - 1, shortest)
            for parts, fit in first.items()
            if fit.evidence > least
        }
    )


def _refitted(record: Rows, found: Inference) -> Inference:
    """The structures of an inference fitted to a whole record."""
    many, shortest = excerpt(record, _MORE * MANY, 0.25), scales_of(record).shortest
    starts = {each.parts: each.values for each in found.structures}
    return weighed({p: fitted(p, many, values, _MORE * LAST_ROUNDS, shortest) for p, values in starts.items()})


def _mean(*found: Inference) -> list[Structure]:
    """The structures of several inferences, each of them with the same weight."""
    return [each._replace(weight=each.weight / len(found)) for one in found for each in one.structures]


def _predictive(record: Rows, structures, cut) -> float:
    """Log density that the weighted structures predict for the rows from `cut` on, each from those before it."""
    logs = []
    for each in structures:
        posterior = Posterior(each.parts, record)
        logs.append(math.log(each.weight) + posterior.densities(posterior.point(each.values))[cut:])
    return float(np.logaddexp.reduce(logs, axis=0).sum())


def _tuned(fixes, record, found: list[Inference], name, moving, held_back, ours, default) -> Tuned:
    many = excerpt(record, _MORE * MANY, 0.25)
    kept, at_bounds = [], {}
    for one in found:
        used = {each.parts for each in one.structures}
        posteriors = {fit.parts: Posterior(fit.parts, many) for fit in one.fits if fit.parts in used}
        spreads = {fit.parts: _spread(posteriors[fit.parts], fit.values) for fit in one.fits if fit.parts in used}
        for weight, parts, values in one.structures:
            intervals, ends = _intervals(posteriors[parts], values, spreads[parts])
            share = weight / len(found)
            kept.append(WeighedStructure(weight=share, parts=parts, values=values, intervals=intervals))
            at_bounds |= dict.fromkeys(ends)
    motion = motion_of(fixes, _mean(*found))
    nis = motion.nis[np.isin(motion.status, (OK, REJECTED)) & np.isfinite(motion.nis)]
    return Tuned(
        profile=InferredProfile(name=name, structures=tuple(kept)),
        default=InferredProfile.of(found[0].structures),
        fixes=int(np.isfinite(record.north).sum()),
        moving=moving,
        rejected=int((motion.status == REJECTED).sum()),
        nis_mean=float(nis.mean()) if len(nis) else math.nan,
        nis_within_pct=100.0 * float((nis < -2.0 * math.log(0.05)).mean()) if len(nis) else math.nan,
        held_back=held_back,
        held_back_log_likelihood=ours,
        default_held_back_log_likelihood=default,
        at_bounds=tuple(at_bounds),
    )


def _spread(posterior: Posterior, values):
    """Deviations of the numbers about a maximum (Laplace)."""
    x = posterior.point(values)
    scores = posterior.scores(x, posterior.densities(x))
    return np.sqrt(np.diag(np.linalg.inv(scores @ scores.T + np.eye(len(x)))))


def _intervals(posterior: Posterior, values, spread):
    """95 % intervals of the numbers by name, and names of those at a bound of the search."""
    x = posterior.point(values)
    ends = [list(posterior.values(x + sign * _INTERVAL * spread).values()) for sign in (-1.0, 1.0)]
    intervals = {name: (low, high) for name, low, high in zip(posterior.names, *ends, strict=True)}
    return intervals, [name for name, each in zip(posterior.names, x, strict=True) if abs(each) > 0.999 * FURTHEST]


def _longest_track(fixes: Fixes) -> Fixes:
    """The fixes of the vessel that has most of them."""
    fixes = fixes.rows(fixes.has_position).in_order()
    return max((track for _, track in fixes.tracks()), key=len)
