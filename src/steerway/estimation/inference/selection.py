"""Which structures a record is evidence for: all declared ones are fitted and compared on the same rows.

Each optional part is tried by itself, on few rows first; structures that fall behind there are given up. The best is
tried together with the other parts that were better than none.
"""

import math
from itertools import product
from typing import NamedTuple

import numpy as np

from steerway.estimation.inference.fit import Fit, Rows, fitted, likeliest
from steerway.estimation.inference.record import excerpt, white_std
from steerway.estimation.inference.structures import VESSELS

PLAIN = ("base", "wander")
OPTIONAL = ("waves", "antenna", "clock", "error")
"""Parts that a structure may have beside the plain ones."""
SECOND = {"antenna": "second_roll", "error": "quick_error"}
"""Parts that may come with one of these, where that is better than none."""

FEW, MANY = 800, 2400
"""Rows for a first fit and for the last, a few minutes and half an hour of a usual receiver."""
BEHIND = 4.0
"""Log evidence by which a structure may be behind another on few rows before it is given up."""
BETTER = 3.0
"""Log evidence that is called strong (H. Jeffreys, Theory of Probability, 1961)."""
LEAST_WEIGHT = 0.02
_PERIODS = (3.0, 4.5, 7.0, 10.0, 15.0, 22.0)
_ROLLS = (1.5, 2.0, 2.5, 3.2, 4.0, 5.0)


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
    """Fit and compare the declared structures on a record (see `record.record_of`) with these of its aids."""
    few, many = excerpt(record, FEW, 1.0), excerpt(record, MANY, 0.5)
    fixed = np.isfinite(record.north)
    noise = white_std(record.time[fixed], record.north[fixed], record.east[fixed])
    base = PLAIN + tuple(aids)
    start = likeliest(base, few, [v | {"fix_std": noise * s} for v, s in product(VESSELS, (1.0, 0.5))])
    plain = fitted(base, many, fitted(base, few, start, 4).values, 6)
    level = fitted(base, few, plain.values, 1).evidence
    fits = {base: plain}

    def compete(parts, values):
        """Fit a structure on few rows from these numbers, and on many unless it falls behind."""
        fit = fitted(parts, few, values, 2)
        if fit.evidence > level - BEHIND:
            fits[parts] = fitted(parts, many, fit.values, 3)

    for part in OPTIONAL:
        parts = (*base, part)
        compete(parts, searched(parts, few, starts(part, plain.values, noise)))
        if parts in fits and part in SECOND and fits[parts].evidence > plain.evidence + BETTER:
            parts = (*parts, SECOND[part])
            compete(parts, searched(parts, few, starts(SECOND[part], fits[parts[:-1]].values, noise)))
    if (top := max(fits, key=lambda parts: fits[parts].evidence)) != base:
        # a part must not win by a better place in the numbers that all share
        again = fitted(base, many, fits[top].values, 3)
        plain = fits[base] = max(plain, again, key=lambda fit: fit.evidence)
    better = sorted(
        (p for p, f in fits.items() if f.evidence > plain.evidence + BETTER), key=lambda p: -fits[p].evidence
    )
    for other in better[1:]:
        combine(fits, better[0], other, base, few, many)
    return weighed(fits)


def combine(fits, best, other, base, few, many) -> None:
    """Let the best structure compete with the parts of another added, if few rows say that it gains by them."""
    parts = best + tuple(part for part in other[len(base) :] if part not in best)
    if parts in fits:
        return
    own = {name: value for name, value in fits[other].values.items() if name not in fits[best].values}
    fit = fitted(parts, few, fits[best].values | own, 2)
    if fit.evidence > fitted(best, few, fits[best].values, 1).evidence:
        fits[parts] = fitted(parts, many, fit.values, 3)


def weighed(fits: dict[tuple, Fit]) -> Inference:
    """The structures by their evidence; those of hardly any weight are left out."""
    top = max(fit.evidence for fit in fits.values())
    weights = {parts: math.exp(fit.evidence - top) for parts, fit in fits.items()}
    least = LEAST_WEIGHT * sum(weights.values())
    kept = {parts: weight for parts, weight in weights.items() if weight > least}
    total = sum(kept.values())
    structures = tuple(Structure(weight / total, parts, fits[parts].values) for parts, weight in kept.items())
    return Inference(structures, tuple(fits.values()))


def starts(part, values, noise) -> list[list[dict]]:
    """Where to begin the search for a part's numbers: lists of numbers, each to be added to the likeliest so far."""
    still = {"speed_std": 0.01, "wander_std": 0.003}
    noisy = {"fix_std": noise}
    if part == "waves":
        surges = product((values, values | still), _PERIODS, (0.05, 0.2))
        yaws = product((*_PERIODS, 30.0), (0.015, 0.05))
        return [
            [v | {"surge_period": period, "wave_surge": std, "wave_yaw": 0.005} for v, period, std in surges],
            [{"yaw_period": period, "wave_yaw": std} for period, std in yaws],
        ]
    if part == "antenna":
        rolls = product((values, noisy, {"fix_std": 0.5 * noise}), _ROLLS, (0.02, 0.15))
        return [[v | {"antenna_period": period, "antenna_std": std} for v, period, std in rolls]]
    if part == "second_roll":
        return [[values | {"roll_period": period, "roll_std": std} for period, std in product(_ROLLS, (0.02, 0.1))]]
    if part == "quick_error":
        return [[values]]
    if part == "clock":
        clocks = product((1.0, 0.5), (0.01, 0.1))
        return [[values | {"fix_std": share * values["fix_std"], "time_std": std} for share, std in clocks]]
    errors = product((values, values | {"fix_std": 0.7 * values["fix_std"]}, noisy), (0.2, 1.0), (20.0, 200.0))
    return [[v | {"error_std": std, "error_time": time} for v, std, time in errors]]


def searched(parts, rows, stages) -> dict:
    """The likeliest of the starting points, stage by stage."""
    best = {}
    for stage in stages:
        best = likeliest(parts, rows, [best | start for start in stage])
    return best
