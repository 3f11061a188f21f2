"""Selection of the structures that explain a record: they are fitted, and compared by evidence on the same rows.

On few rows each optional part is tried alone. The best part is then combined with every other part that beats the plain
structure. Structures far behind are given up; the others are fitted to many rows and compared there.
"""

import math
from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from steerway.estimation.filter.bank import LONGEST_STEP
from steerway.estimation.filter.row import Rows
from steerway.estimation.fit.posterior import DRAWS, Fit, Posterior, fitted, likeliest
from steerway.estimation.fit.starts import scales_of, vessels
from steerway.estimation.log.record import excerpt, predictions
from steerway.estimation.vessel.parts import OPTIONAL, PARTS, PLAIN, Parts, Scales, Values
from steerway.estimation.vessel.structures import Structure, model_of, parameters_of

FEW, MANY = 500, 1500
"""Rows of the first and the last fits: a few minutes and half an hour of fixes. They bound the time of an inference."""
FEWEST = 200
"""Least number of rows for a fit: ten for each number of the plain structure. With 150, one of four simulated logs with
fixes 20 and 30 s apart has a log evidence lower by 12. With 300, a fit takes 1.7 times as long and gains nothing."""
OPEN = 10_000
"""Most fixes of a record for which posterior samples (`posterior.DRAWS`) replace the fitted numbers; they cost time
with every fix. Without them, 95 % intervals of a boat at constant speed in 1,001 fixes cover 79 to 89 %."""
START_VESSELS, FIRST_ROUNDS, FEW_ROUNDS, LAST_ROUNDS, OTHER_ROUNDS = 3, 5, 1, 4, 3
"""Number of vessels that a fit starts from; then most rounds of a fit: plain structure on few rows; others on few rows;
best structure on many rows; others on many rows. A round costs one to two runs of the filter for every number."""
FAR_BEHIND, BEHIND = 20.0, 5.0
"""Log evidence by which a structure may trail the best before it is given up: first on few rows, then on many rows
before the fit to them. In five logs and scenes the eventual best trailed by up to 6 on few rows, and fits to many rows
gained 3 to 60."""
USUAL_STATES = 12
"""Largest number of states, times predictions per row, of a structure that is fitted to MANY rows; larger ones get
fewer rows. The plain structure with two errors of the receiver or with waves has 11 states. With 9 instead of 12, the
COG error of the scene `rolling-antenna` is 9 and 24 % larger."""
FINALISTS = 3
"""Most structures that are fitted to many rows; each takes 0.1 to 1 s."""
BETTER = 3.0
"""Difference of log evidence that is called strong (H. Jeffreys, Theory of Probability, 1961)."""
UNRESOLVED_SURGE = 1e-3
"""1σ of the surge, m/s, of waves whose surge the log does not show: too small to change an estimate."""
_BY_ROUNDING, _OF_ROUNDED = 2.0, ("error", "steps")
"""Ratio of the variance of fixes to that of their rounding, and the only parts tried up to this ratio. Other parts fit
the pattern of rounding as motion or obstructions: in 140 generated records SOG errs by 0.19 m/s with, 0.06 without."""
_OTHERWISE = ("error", "steps")
"""Errors of the receiver that the plain structure fits as motion: their fits start from the second best vessel too."""
LEAST_WEIGHT = 0.02
"""Share of the total weight below which a structure is left out. Without it a mean moves by at most this share of the
distance to that structure, well below the σ of the mean."""


class Inference(NamedTuple):
    """Structures with their weights, and all fits that were compared in the end."""

    structures: tuple[Structure, ...]
    fits: tuple[Fit, ...]

    @property
    def used(self) -> list[Fit]:
        """The fits of the structures that have a weight."""
        return [fit for fit in self.fits if fit.parts in {each.parts for each in self.structures}]


def infer(record: Rows, aids: Sequence[str] = (), effort: int = 1) -> Inference:
    """Fit and compare the declared structures on a record (see `log.run.Track`) with these aids.

    effort: factor on the usual numbers of rows and rounds.
    """
    few = affordable(record, PLAIN + tuple(aids), effort * FEW, 1.0 / effort)
    scales = scales_of(record)
    contenders = screened(PLAIN + tuple(aids), few, scales)
    many = affordable(record, next(iter(contenders)), effort * MANY, 0.5 / effort)
    draws = DRAWS if np.isfinite(record.north).sum() <= OPEN else 0
    return weighed(refitted(contenders, many, scales.shortest, effort, draws), record.quantum, draws)


def affordable(record: Rows, parts: Parts, most: int, apart: float) -> Rows:
    """At most `most` rows; fewer for large structures and fixes far apart, so that no run of the filter costs more."""
    rows = excerpt(record, most, apart)
    states = model_of(parts, dict.fromkeys(parameters_of(parts)[0], 1.0)).states
    share = USUAL_STATES / (states * predictions(rows).mean())
    return rows if share >= 1.0 else excerpt(record, max(FEWEST, int(share * most)), apart)


def refitted(few: dict[Parts, Fit], rows: Rows, shortest: float, effort: int, draws: int) -> dict[Parts, Fit]:
    """The best structures of `few` (fits to few rows, the best first), fitted to `rows`.

    Every structure of `few` competes as it is, and with its parts added to the best: many rows may show what few do
    not. A fit starts from its own values, or from those of the best fit for the numbers that both have, if these are
    likelier. A structure whose start is far behind is not fitted.
    """
    first = next(iter(few))
    fits = {first: fitted(first, rows, few[first].values, effort * LAST_ROUNDS, shortest, draws)}
    waiting: dict[Parts, tuple[float, Values]] = {}
    penalty = {parts: fit.evidence - fit.log_posterior for parts, fit in few.items()}
    plain = next(parts for parts in few if parts == plain_of(parts))

    def consider(parts: Parts, values: Values, penalty: float, behind: float) -> None:
        if parts not in fits and parts not in waiting:
            found = fits[best].values
            [(begin, log)] = likeliest(parts, rows, [values | found, found | values], shortest)
            waiting[parts] = log + penalty + behind, begin

    while len(fits) < FINALISTS:
        best = max(fits, key=lambda parts: fits[parts].evidence)
        top = fits[best]
        for parts, fit in few.items():
            if fit.evidence > few[first].evidence - FAR_BEHIND:
                consider(parts, fit.values, penalty[parts], BEHIND)
            more = top.evidence - top.log_posterior - penalty[plain]
            consider(together(best, parts), fit.values, penalty[parts] + more, 0.0)
        if not waiting:
            break
        parts = max(waiting, key=lambda parts: waiting[parts][0])
        expected, begin = waiting.pop(parts)
        if expected < top.evidence:
            break
        fits[parts] = fitted(parts, rows, begin, effort * OTHER_ROUNDS, shortest, draws)
    return {parts: with_resolved_surge(fit, rows, shortest) for parts, fit in fits.items()}


def with_resolved_surge(fit: Fit, rows: Rows, shortest: float) -> Fit:
    """The fit, without the surge of its waves if the record does not show one.

    A fit may contain waves because of yaw alone, even falsely: a slalom looks like wave yaw of the same period. Noise,
    which has power at every period, is then taken for the surge of that wave, and the smoothed speed follows it.
    """
    if "wave_surge" not in fit.values:
        return fit
    posterior, quiet = Posterior(fit.parts, rows, shortest), fit.values | {"wave_surge": UNRESOLVED_SURGE}
    with_it, without = (posterior.densities(posterior.point(each)).sum() for each in (fit.values, quiet))
    if with_it - without > BETTER + math.log(len(rows.time)):
        return fit
    others = tuple(each | {"wave_surge": UNRESOLVED_SURGE} for each in fit.others)
    return fit._replace(values=quiet, others=others)


def screened(base: Parts, few: Rows, scales: Scales) -> dict[Parts, Fit]:
    """Fits of structures on few rows, the best first."""
    shortest = scales.shortest
    kinds = vessels(scales.noise, far=shortest > 2.0 * LONGEST_STEP)
    begin = [fitted(base, few, start, 1) for start, _ in likeliest(base, few, kinds, shortest, START_VESSELS)]
    begin.sort(key=lambda fit: -fit.log_posterior)
    plain = fitted(base, few, begin[0].values, FIRST_ROUNDS)
    fits = {base: plain}

    def compete(part: str, begun: Fit) -> None:
        """Fit a structure with this part added, unless it is far behind even with the likeliest numbers."""
        parts = (*begun.parts, part)
        start, log = searched(parts, few, begun.values, scales)
        if log > begun.log_posterior - FAR_BEHIND:
            found = fitted(parts, few, start, FEW_ROUNDS, shortest)
            fits[parts] = max(fits.get(parts, found), found, key=lambda fit: fit.evidence)

    is_rounding = scales.noise**2 <= _BY_ROUNDING * sum(digit**2 for digit in few.quantum) / 24.0
    for part in OPTIONAL:
        if not PARTS[part].resolved(shortest) or (is_rounding and part not in _OF_ROUNDED):
            continue
        if not (first := PARTS[part].only_with):
            if part in _OTHERWISE:
                compete(part, begin[1])
            compete(part, plain)
        elif (*base, first) in fits and fits[*base, first].evidence > plain.evidence + BETTER:
            compete(part, fits[*base, first])
    ranked = sorted(fits, key=lambda parts: -fits[parts].evidence)
    best = ranked[0]
    good = [other for other in ranked if fits[other].evidence > plain.evidence + BETTER]
    while good:  # until no other part makes the best better
        gains = {}
        for other in good:
            parts = together(best, other)
            if parts not in fits:
                one, two = fits[best].values, fits[other].values
                [(start, _)] = likeliest(parts, few, [two | one, one | two], shortest)
                fits[parts] = fitted(parts, few, start, FEW_ROUNDS, shortest)
            gains[other] = fits[parts].evidence - fits[best].evidence
        good = [other for other in good if gains[other] > 0.0]
        best = max(fits, key=lambda parts: fits[parts].evidence)
    return {parts: fits[parts] for parts in sorted(fits, key=lambda parts: -fits[parts].evidence)}


def together(structure: Parts, other: Parts) -> Parts:
    """A structure with the optional parts of another added."""
    return plain_of(structure) + tuple(part for part in OPTIONAL if part in structure or part in other)


def plain_of(structure: Parts) -> Parts:
    """The parts of a structure that are not optional."""
    return tuple(part for part in structure if part not in OPTIONAL)


def weighed(fits: dict[Parts, Fit], quantum: tuple[float, float] = (0.0, 0.0), draws: int = 0) -> Inference:
    """Weigh structures by their evidence; those below LEAST_WEIGHT are left out.

    draws: total number of parameter sets drawn from the posterior (`Fit.others`), shared among the structures.
    """
    top = max(fit.evidence for fit in fits.values())
    weights = {parts: math.exp(fit.evidence - top) for parts, fit in fits.items()}
    least = LEAST_WEIGHT * sum(weights.values())
    kept = {parts: weight for parts, weight in weights.items() if weight > least}
    total = sum(kept.values())
    structures = []
    for parts, weight in kept.items():
        drawn = 2 * round(draws * weight / total / 2)
        numbers = fits[parts].others[:drawn] or (fits[parts].values,)
        each = weight / total / len(numbers)
        structures += [Structure(weight=each, parts=parts, values=values, quantum=quantum) for values in numbers]
    return Inference(tuple(structures), tuple(fits.values()))


def searched(parts: Parts, rows: Rows, values: Values, scales: Scales) -> tuple[Values, float]:
    """The likeliest start for fitting `parts`, and its log posterior. The numbers of the last part are searched on its
    grid; the others are `values` (for obstructions, also those of typical vessels)."""
    begun, log = [values], -math.inf
    if parts[-1] == "obstructions":  # a fit without obstructions may contain manoeuvres instead
        begun += vessels(scales.noise)
    stages = PARTS[parts[-1]].begin
    for stage in stages(scales, values) if stages else ():
        grid = [dict(zip(stage, chosen, strict=True)) for chosen in product(*stage.values())]
        starts = [each | chosen for each in begun for chosen in grid]
        [(best, log)] = likeliest(parts, rows, starts, scales.shortest)
        begun = [best]
    return begun[0], log
