"""Which structures a record is evidence for: all declared ones are fitted and compared on the same rows.

Each optional part is tried by itself on few rows, and the best together with every other that is better than none.
Structures that fall behind there are given up, the others are fitted and compared on many.
"""

import math
from itertools import product
from typing import NamedTuple

import numpy as np

from steerway.estimation.inference.fit import DRAWS, Fit, Rows, fitted, likeliest
from steerway.estimation.inference.record import excerpt, white_std
from steerway.estimation.inference.structures import SHIP, VESSELS

PLAIN = ("base", "wander")
OPTIONAL = ("waves", "antenna", "clock", "error", "steps")
"""Parts that a structure may have beside the plain ones."""
SECOND = {"antenna": "second_roll", "error": "quick_error", "clock": "beat", "steps": "slips"}
"""Parts that may come with one of these, where that is better than none."""

FEW, MANY = 500, 1500
"""Rows for a first fit and for the last, a few minutes and half an hour of a usual receiver. Chosen: they
bound the time that an inference takes."""
OPEN = 10_000
"""Fixes up to which the numbers of a structure are averaged over what the record leaves open, which costs time with
every fix. Without that, deviations of a boat at constant speed in 1,001 fixes hold 79 to 89 % of the errors where they
should hold 95."""
START_ROUNDS, FIRST_ROUNDS, FEW_ROUNDS, LAST_ROUNDS = 1, 8, 1, 2
"""Rounds of a fit at most: from either start, of the plain structure, of the others on few rows, the last. Chosen: each
costs one to two runs of the filter for every number."""
FAR_BEHIND, BEHIND = 20.0, 10.0
"""Log evidence by which a structure may be behind the best before it is given up: on few rows, and on many before it is
fitted to them. Chosen: in five logs and scenes those that were best in the end were behind by up to 6 on few rows, and
fits to many gained 3 to 60 there."""
FINALISTS = 3
"""Structures fitted to many rows at most. Chosen: each takes 0.1 to 1 s."""
LOST = 10.0
"""Log posterior by which a structure may be behind the best on many rows before its fit ends. Chosen: a further round
gains 0.1 to 3, and its weight is then below 0.1 %."""
BETTER = 3.0
"""Log evidence that is called strong (H. Jeffreys, Theory of Probability, 1961)."""
LEAST_WEIGHT = 0.02
"""Share of all weight below which a structure is left out: a mean moves by this part of the distance at most.
Chosen: well below the deviation of a mean."""
RESOLVED = 2.0
"""Usual intervals between fixes in the shortest period that they resolve (the sampling theorem)."""
NOISES = (3.0, 1.0, 0.5)
"""Noise of a fix to begin from, in that of third differences: motion makes those larger, a receiver's filter less.
Chosen: starting points only."""
_PERIODS = (3.0, 4.5, 7.0, 10.0, 15.0, 22.0)
"""s, to begin from: of waves, from a lake's to the longest swell, a factor of one and a half apart. Chosen: a grid."""
_ROLLS = (1.5, 2.0, 2.5, 3.2, 4.0)
"""s, of the roll of small craft, a factor of a quarter apart: its prior is that narrow. Chosen: a grid."""


class Structure(NamedTuple):
    """One of the structures that a record is evidence for."""

    weight: float
    parts: tuple
    values: dict


class Inference(NamedTuple):
    """Structures with their weights, and all fits that competed to the end."""

    structures: tuple
    fits: tuple


def infer(record: Rows, aids=()) -> Inference:
    """Fit and compare the declared structures on a record (see `whole_log.Track`) with these of its aids."""
    few, many = excerpt(record, FEW, 1.0), excerpt(record, MANY, 0.5)
    noise, shortest = scales_of(record)
    contenders = screened(PLAIN + tuple(aids), few, noise, shortest)
    draws = DRAWS if np.isfinite(record.north).sum() <= OPEN else 0
    return weighed(refitted(contenders, many, shortest, draws), draws)


def refitted(contenders: dict[tuple, Fit], rows, shortest, draws) -> dict[tuple, Fit]:
    """The best of these structures (the best first) fitted to other rows.

    All but the first begin with what it found of the numbers that they share, where they hardly move, and only those
    are fitted that are not far behind there already.
    """
    best, *others = contenders
    found = fitted(best, rows, contenders[best].values, LAST_ROUNDS, shortest, draws=draws)
    fits, starts, expected = {best: found}, {}, {}
    for parts in others:
        few = contenders[parts]
        starts[parts], log = likeliest(parts, rows, [few.values | found.values, few.values], shortest)
        expected[parts] = log + few.evidence - few.log_posterior
    for parts in sorted(others, key=lambda parts: -expected[parts])[: FINALISTS - 1]:
        if expected[parts] > max(fit.evidence for fit in fits.values()) - BEHIND:
            least = max(fit.log_posterior for fit in fits.values()) - LOST
            fits[parts] = fitted(parts, rows, starts[parts], LAST_ROUNDS, shortest, least, draws)
    return fits


def scales_of(record: Rows) -> tuple[float, float]:
    """Noise of a fix by third differences (m), and the shortest period (s) that the fixes resolve."""
    fixed = np.isfinite(record.north)
    noise = white_std(record.time[fixed], record.north[fixed], record.east[fixed])
    return noise, RESOLVED * float(np.median(np.diff(record.time[fixed])))


def screened(base, few, noise, shortest=0.0) -> dict[tuple, Fit]:
    """Fits of structures on few rows, the best first, without those that fall behind."""
    ends = []
    for vessels in (VESSELS, (SHIP,)):
        begin, _ = likeliest(base, few, [v | {"fix_std": noise * s} for v, s in product(vessels, NOISES)])
        ends.append(fitted(base, few, begin, START_ROUNDS))
    plain = fitted(base, few, max(ends, key=lambda fit: fit.evidence).values, FIRST_ROUNDS)
    fits = {base: plain}

    def compete(part, with_parts, values):
        parts = (*with_parts, part)
        fits[parts] = fitted(
            parts, few, searched(parts, few, starts(part, values, noise), shortest), FEW_ROUNDS, shortest
        )
        return parts, fits[parts].evidence > plain.evidence + BETTER

    for part in OPTIONAL:
        parts, better = compete(part, base, plain.values)
        if better and part in SECOND:
            compete(SECOND[part], parts, fits[parts].values)
    ranked = sorted(fits, key=lambda parts: -fits[parts].evidence)
    best = ranked[0]
    if best != base:
        # a part must not win by a better place in the numbers that all share
        again = fitted(base, few, fits[best].values, FEW_ROUNDS, shortest)
        plain = fits[base] = max(plain, again, key=lambda fit: fit.evidence)
    good = [other for other in ranked if fits[other].evidence > plain.evidence + BETTER]
    if "error" in best:  # under which turns may have been taken for wander
        steady = tuple(part for part in best if part != "wander")
        begin, _ = likeliest(steady, few, [fits[best].values | vessel for vessel in VESSELS], shortest)
        fits[steady] = fitted(steady, few, begin, FEW_ROUNDS, shortest)
        best = max(best, steady, key=lambda parts: fits[parts].evidence)
    while good:  # until no other part makes the best better
        gains = {}
        for other in good:
            parts = best + tuple(part for part in other[len(base) :] if part not in best)
            if parts not in fits:
                one, two = fits[best].values, fits[other].values
                begin, _ = likeliest(parts, few, [two | one, one | two], shortest)
                fits[parts] = fitted(parts, few, begin, FEW_ROUNDS, shortest)
            gains[other] = fits[parts].evidence - fits[best].evidence
        good = [other for other in good if gains[other] > 0.0]
        best = max(fits, key=lambda parts: fits[parts].evidence)
    ranked = sorted(fits, key=lambda parts: -fits[parts].evidence)
    return {parts: fits[parts] for parts in ranked if fits[parts].evidence > fits[ranked[0]].evidence - FAR_BEHIND}


def weighed(fits: dict[tuple, Fit], draws=0) -> Inference:
    """The structures by their evidence; those of hardly any weight are left out.

    draws: how many sets of numbers drawn from the posterior (`Fit.others`) stand for all structures.
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
        structures += [Structure(weight / total / len(numbers), parts, values) for values in numbers]
    return Inference(tuple(structures), tuple(fits.values()))


def starts(part, values, noise) -> list[list[dict]]:
    """Where to begin the search for a part's numbers: lists of numbers, each to be added to the likeliest so far."""
    still = {"speed_std": 0.01, "wander_std": 0.003}
    noisy = {"fix_std": noise}
    if part == "waves":
        surges = product((values, values | still), _PERIODS, (0.05, 0.2))
        yaws = product((*_PERIODS, 30.0), (0.03, 0.1))
        return [
            [v | {"surge_period": period, "wave_surge": std, "wave_yaw": 0.01} for v, period, std in surges],
            [{"yaw_period": period, "wave_yaw": std} for period, std in yaws],
        ]
    if part == "antenna":
        rolls = product((values, noisy, {"fix_std": 0.5 * noise}), _ROLLS, (0.02, 0.15))
        return [[v | {"antenna_period": period, "antenna_std": std} for v, period, std in rolls]]
    if part == "second_roll":
        return [[values | {"roll_period": period, "roll_std": std} for period, std in product(_ROLLS, (0.02, 0.1))]]
    if part == "quick_error":
        return [
            [values | {"quick_std": std, "quick_time": time} for std, time in product(_sizes(noise, 0.2), (1.5, 5.0))]
        ]
    if part == "clock":
        clocks = product((1.0, 0.5), (0.01, 0.1))
        return [[values | {"fix_std": share * values["fix_std"], "time_std": std} for share, std in clocks]]
    if part == "beat":
        beats = product((1.0, 0.3), (0.1, 0.3), (*_PERIODS, 40.0))
        return [
            [
                values | {"time_std": share * values.get("time_std", 0.05), "beat_std": std, "beat_period": period}
                for share, std, period in beats
            ]
        ]
    if part == "slips":
        share = values | {"step_std": 0.3 * values["step_std"]}
        return [[v | {"slip_std": std} for v, std in product((values, share), (0.1, 0.3, 1.0))]]
    if part == "steps":
        shares = (values, values | {"fix_std": 0.5 * values["fix_std"]})
        steps = product(shares, (10.0, 60.0), (3.0 * noise, 10.0 * noise))
        return [[v | {"step_every": every, "step_std": std} for v, every, std in steps]]
    errors = product((values, values | {"fix_std": 0.7 * values["fix_std"]}, noisy), _sizes(noise, 1.0), (20.0, 200.0))
    return [[v | {"error_std": std, "error_time": time} for v, std, time in errors]]


def _sizes(noise, largest):
    """Where to begin the search for the size (m) of a receiver's error: from its noise to that of a receiver alone."""
    return noise, math.sqrt(noise * largest), largest


def searched(parts, rows, stages, shortest=0.0) -> dict:
    """The likeliest of the starting points, stage by stage."""
    best = {}
    for stage in stages:
        best, _ = likeliest(parts, rows, [best | start for start in stage], shortest)
    return best
