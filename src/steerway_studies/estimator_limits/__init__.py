"""Study estimator-limits: error against what the information allows, consistency, and what troubles do.

The bound is that of an estimator that knows when turns begin and end. Ratios to it for a filter with the true
parameters, with tuned ones and with the default; smoothed; with correlated receiver errors; aided; with wrong
parameters; with faults; and the time that a fix takes.
"""

from functools import partial

from steerway_studies.estimator_limits import (
    accuracy,
    aided,
    correlated,
    cost,
    failures,
    figures,
    held,
    known_modes,
    unknown_modes,
)
from steerway_studies.estimator_limits.remarks import LEAD, remarks
from steerway_studies.study import Results, Study


def run(seeds=None, first_seed=0, progress=None) -> Results:
    """The study; `seeds` runs a cell, by default 30 (60 in O)."""
    results = Results("The estimator at its limit", lead=LEAD)
    costs = cost.measured(first_seed)  # before the other work warms the machine
    began = 0.02
    found = {}
    for section, share, words in _SECTIONS:
        step = progress and partial(_stepped, progress, began, share, words)
        found[section] = section.measured(seeds, first_seed, step)
        began += share
    for section, _, _ in _SECTIONS:
        section.report(results, found[section])
    cost.report(results, costs)
    _figures(results, found)
    results.remarks += remarks(results.numbers)
    if progress:
        progress(1.0, "")
    return results


_SECTIONS = (
    (accuracy, 0.3, "error against the bound"),
    (known_modes, 0.04, "known modes"),
    (unknown_modes, 0.36, "what not knowing the modes costs"),
    (correlated, 0.08, "wandering receivers"),
    (aided, 0.05, "aiding"),
    (held, 0.05, "parameters held"),
    (failures, 0.1, "troubles"),
)
"""What is measured, its part of the time, and in words."""


def _stepped(progress, began, share, words, part):
    progress(began + share * part, words)


def _figures(results: Results, found) -> None:
    numbers = results.numbers
    results.figures["ratios"] = (
        figures.ratios(
            numbers,
            {
                "": ("true parameters", "o"),
                "tuned_": ("tuned from one earlier voyage", "s"),
                "default_": ("as it comes", "^"),
                "particles_": ("filter of many histories of modes", "x"),
            },
            lambda name, what, where: accuracy.target(name, "", what, where),
        ),
        "Error of the filter over its bound, with 95 % intervals. Black: targets with the true parameters.",
    )
    results.figures["smoothed"] = (
        figures.ratios(
            numbers,
            {
                "smoothed_": ("smoothed, true parameters", "o"),
                "histories_": ("smoother by all histories of modes", "s"),
                "told_": ("smoother with known modes", "^"),
            },
            lambda name, what, where: accuracy.SMOOTHED_TARGET,
        ),
        "Error of the smoother over the smoothing bound, whose owner knows the modes. Who does not know them cannot in "
        "the mean do better than by weighing all their histories, here by sampling them. Black: the target.",
    )
    results.figures["consistency"] = (
        figures.consistency(numbers),
        "NIS of a fix, and NEES of speed, course and course rate. Grey: the band asked for, and the expectation; "
        "dashed: 1.5 times that. Blue: straight; red: in turns; black: all along.",
    )
    results.figures["wandering_receivers"] = (
        figures.correlated(numbers, correlated.WORDS),
        "Error of COG with receivers whose error wanders.",
    )
    results.figures["gyro_bias"] = (
        figures.bias(found[aided]["bias"], aided.CELL.scenario.rate, aided.FOUND * aided.GYRO_BIAS),
        "Error of a gyro's bias as found from fixes of 0.5 m. Grey band: a fifth of the bias.",
    )
    results.figures["held"] = (
        figures.held(numbers, held.WORDS_OF_CHANGES),
        "Cost of a vessel that dwells three times longer or shorter, or is three times more or less restless, than "
        "the filter supposes. Dashed: the target. Black: what it costs a filter of 300 histories of modes.",
    )


STUDY = Study("estimator-limits", "error against the Cramér–Rao bound, consistency, smoothing, aiding, troubles", run)
