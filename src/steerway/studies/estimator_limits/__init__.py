"""Study estimator-limits: error against what the information allows, consistency, and what troubles do.

The bound is that of an estimator told when turns begin and end. Ratios to it for a filter with the true parameters,
with tuned ones, and as it comes; smoothed; with receivers whose error wanders; aided; told wrong; in trouble; and the
cost of a fix.
"""

from functools import partial

from steerway.studies.estimator_limits import (
    accuracy,
    aided,
    correlated,
    cost,
    failures,
    figures,
    held,
    told,
    unknown_modes,
)
from steerway.studies.study import Results, Study


def run(seeds=None, first_seed=0, progress=None) -> Results:
    """The study; `seeds` runs a cell, by default 30 (60 in O)."""
    results = Results("The estimator at its limit")
    costs = cost.measured(first_seed)  # before the other work warms the machine
    began = 0.02
    found = {}
    for section, share, words in _SECTIONS:
        step = progress and partial(_told, progress, began, share, words)
        found[section] = section.measured(seeds, first_seed, step)
        began += share
    for section, _, _ in _SECTIONS:
        section.report(results, found[section])
    cost.report(results, costs)
    _figures(results, found)
    results.remarks += _REMARKS
    if progress:
        progress(1.0, "")
    return results


_SECTIONS = (
    (accuracy, 0.3, "error against the bound"),
    (told, 0.04, "told the modes"),
    (unknown_modes, 0.36, "what not knowing the modes costs"),
    (correlated, 0.08, "wandering receivers"),
    (aided, 0.05, "aiding"),
    (held, 0.05, "parameters held"),
    (failures, 0.1, "troubles"),
)
"""What is measured, its part of the time, and in words."""


def _told(progress, began, share, words, part):
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
                "told_": ("smoother told the modes", "^"),
            },
            lambda name, what, where: accuracy.SMOOTHED_TARGET,
        ),
        "Error of the smoother over the smoothing bound, whose owner knows the modes. Who does not know them cannot "
        "do better than the smoother that weighs all their histories. Black: the target.",
    )
    results.figures["consistency"] = (
        figures.consistency(numbers),
        "NIS of a fix, and NEES of speed, course and course rate. Grey: the band asked for; dashed: 1.5 times.",
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
        "the filter takes her to. Dashed: the target.",
    )


_REMARKS = [
    "The bound belongs to an estimator that is told when turns begin and end. Straight ahead in O, whoever has to find "
    "out pays: COG errs by 2.4 and 2.7 times its bound (0.5 and 2.5 m) in a filter of a thousand histories, by 1.3 and "
    "1.6 times in a smoother that weighs all histories. 1.1 is out of reach there, and in turns (1.10 and 1.16) just "
    "so; the smoother that is told the modes has ratios of one. Between the smoother by all histories and the "
    "product's lies what a better one could still gain.",
    "NEES is about 3 all along. Straight and turning rows taken apart it cannot be: the filter does not know which it "
    "is in, so that it doubts too much while she holds her course and too little in the first seconds of a turn. The "
    "filter of many histories shows the same 1.1 to 1.5 straight and 9 to 12 in turns: targets of 3 and 4.5 would ask "
    "for a covariance that knows the mode. Intervals are over runs, since the rows of a run err alike.",
    "Parameters held three times off cost at most 9 % all along, which is what tuning aims at. Straight ahead alone "
    "the known ones can be worth more, since who knows that turns are rare or mild may trust a held course longer.",
    "P1's ship counts as straight while her course changes by less than 1° a minute. With the receiver known at 0.21 m "
    "a step other limits gave, straight and in turns, 0.72 and 2.11° (1.2° a minute), 0.77 and 2.19 (3), 0.88 and 2.27 "
    "(6), 1.12 and 2.41 (12); 1.25 and 2.09 from 250 s after a waypoint on (four seeds). The printed filter has P1's"
    " tuning (α1 = 1e-5, α2 = 0.2 1/s). P1's receiver has no white noise but a random walk; as it comes, motion and "
    "receiver are fitted together to the voyage itself.",
]

STUDY = Study("estimator-limits", "error against the Cramér–Rao bound, consistency, smoothing, aiding, troubles", run)
