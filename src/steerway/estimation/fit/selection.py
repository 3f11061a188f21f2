"""Which structures a record is evidence for: all declared ones are fitted and compared on the same rows.

Each optional part is tried by itself on few rows, and the best together with every other that is better than none.
Structures that fall behind there are given up, the others are fitted and compared on many.
"""

import math
from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from steerway.estimation.filter.bank import LONGEST_STEP
from steerway.estimation.filter.model import Model
from steerway.estimation.filter.row import Rows
from steerway.estimation.fit.posterior import DRAWS, Fit, Posterior, fitted, likeliest
from steerway.estimation.fit.starts import scales_of, vessels
from steerway.estimation.log.record import excerpt, predictions
from steerway.estimation.vessel.parts import OPTIONAL, PARTS, PLAIN, Parts, Scales, Values
from steerway.estimation.vessel.structures import model_of, parameters_of

FEW, MANY = 500, 1500
"""Rows for a first fit and for the last, a few minutes and half an hour of a usual receiver. Chosen: they
bound the time that an inference takes."""
FEWEST = 200
"""Rows for a fit at least, ten for each number of the plain structure. With 150, of four simulated logs with fixes 20
and 30 s apart one ends 12 of log evidence below; 300 gain nothing there, and cost 1.7 times where minutes apart."""
OPEN = 10_000
"""Fixes up to which the numbers of a structure are averaged over what the record leaves open, which costs time with
every fix. Without that, deviations of a boat at constant speed in 1,001 fixes hold 79 to 89 % of the errors where they
should hold 95."""
START_VESSELS, FIRST_ROUNDS, FEW_ROUNDS, LAST_ROUNDS, OTHER_ROUNDS = 3, 5, 1, 4, 3
"""Kinds of vessel that a fit begins from, and rounds of a fit at most: of the plain structure, of the others on few
rows, of the best on many, of the others there. Chosen: each costs one to two runs of the filter for every number."""
FAR_BEHIND, BEHIND = 20.0, 5.0
"""Log evidence by which a structure may be behind the best before it is given up: on few rows, and on many before it is
fitted to them. Chosen: in five logs and scenes those that were best in the end were behind by up to 6 on few rows, and
fits to many gained 3 to 60 there."""
USUAL_STATES = 12
"""States of a structure, times predictions a row, up to which it is fitted to MANY rows: the plain one with two errors
of the receiver or with waves has 11. With 9, fits of large structures are worse (COG of the scene `rolling-antenna` by
9 and 24 %)."""
FINALISTS = 3
"""Structures fitted to many rows at most. Chosen: each takes 0.1 to 1 s."""
BETTER = 3.0
"""Log evidence that is called strong (H. Jeffreys, Theory of Probability, 1961)."""
UNRESOLVED_SURGE = 1e-3
"""m/s, surge of waves that the log does not show: so small that it changes no estimate."""
_BY_ROUNDING, _OF_ROUNDED = 2.0, ("error", "steps")
"""Variance of fixes, in that of their rounding, up to which only these parts are tried: the others take the pattern of
rounding for motion or obstructions (SOG of 140 generated records is off by 0.19 m/s with all, 0.06 so)."""
_OTHERWISE = ("error", "steps")
"""Parts that explain what the plain structure explains by the vessel: the search begins from a second vessel too."""
LEAST_WEIGHT = 0.02
"""Share of all weight below which a structure is left out: a mean moves by this part of the distance at most.
Chosen: well below the deviation of a mean."""


class Structure(NamedTuple):
    """One of the structures that a record is evidence for."""

    weight: float
    parts: Parts
    values: Values
    quantum: tuple[float, float] = (0.0, 0.0)
    """Last digit of a fix north and east, m; 0 where fixes are not rounded."""

    @property
    def model(self) -> Model:
        """What the filters work with."""
        return model_of(self.parts, self.values, self.quantum)


class Inference(NamedTuple):
    """Structures with their weights, and all fits that competed to the end."""

    structures: tuple[Structure, ...]
    fits: tuple[Fit, ...]

    @property
    def used(self) -> list[Fit]:
        """The fits of the structures."""
        return [fit for fit in self.fits if fit.parts in {each.parts for each in self.structures}]


def infer(record: Rows, aids: Sequence[str] = (), effort: int = 1) -> Inference:
    """Fit and compare the declared structures on a record (see `whole_log.Track`) with these of its aids.

    effort: how many times the usual rows and rounds.
    """
    few = affordable(record, PLAIN + tuple(aids), effort * FEW, 1.0 / effort)
    scales = scales_of(record)
    contenders = screened(PLAIN + tuple(aids), few, scales)
    many = affordable(record, next(iter(contenders)), effort * MANY, 0.5 / effort)
    draws = DRAWS if np.isfinite(record.north).sum() <= OPEN else 0
    return weighed(refitted(contenders, many, scales.shortest, effort, draws), record.quantum, draws)


def affordable(record: Rows, parts: Parts, most: int, apart: float) -> Rows:
    """At most so many rows; for large structures and fixes far apart fewer, so that no run of the filter costs more."""
    rows = excerpt(record, most, apart)
    states = model_of(parts, dict.fromkeys(parameters_of(parts)[0], 1.0)).states
    share = USUAL_STATES / (states * predictions(rows).mean())
    return rows if share >= 1.0 else excerpt(record, max(FEWEST, int(share * most)), apart)


def refitted(few: dict[Parts, Fit], rows: Rows, shortest: float, effort: int, draws: int) -> dict[Parts, Fit]:
    """The best of the structures fitted on few rows (the best first), fitted to other rows.

    They compete with the best as they are, and with their parts added to it: what few rows do not tell, many may. They
    begin with what the best found of the numbers that they share, where they hardly move, and only those are fitted
    that are not far behind there already.
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

    Waves may be found by their yaw alone: a slalom looks like the yaw of a wave with its period. Noise then passes for
    the surge of that wave, because noise has a part at every period, and the smoothed speed follows it.
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
        """Fit a part, unless it explains nothing even with the likeliest numbers."""
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
    """A structure with the parts that may be added to it of another."""
    return plain_of(structure) + tuple(part for part in OPTIONAL if part in structure or part in other)


def plain_of(structure: Parts) -> Parts:
    """The parts of a structure that are not among OPTIONAL."""
    return tuple(part for part in structure if part not in OPTIONAL)


def weighed(fits: dict[Parts, Fit], quantum: tuple[float, float] = (0.0, 0.0), draws: int = 0) -> Inference:
    """The structures by their evidence; those of hardly any weight are left out.

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
        structures += [Structure(weight / total / len(numbers), parts, values, quantum) for values in numbers]
    return Inference(tuple(structures), tuple(fits.values()))


def searched(parts: Parts, rows: Rows, values: Values, scales: Scales) -> tuple[Values, float]:
    """Numbers to begin from where the last part comes to others with these values, and their log posterior."""
    begun, log = [values], -math.inf
    if parts[-1] == "obstructions":  # which may have been taken for manoeuvres
        begun += vessels(scales.noise)
    stages = PARTS[parts[-1]].begin
    for stage in stages(scales, values) if stages else ():
        grid = [dict(zip(stage, chosen, strict=True)) for chosen in product(*stage.values())]
        starts = [each | chosen for each in begun for chosen in grid]
        [(best, log)] = likeliest(parts, rows, starts, scales.shortest)
        begun = [best]
    return begun[0], log
