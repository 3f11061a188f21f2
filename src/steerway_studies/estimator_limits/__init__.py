"""Study estimator-limits: error against what the information allows, consistency, and what troubles do.

The bound is that of an estimator that knows when turns begin and end. Ratios to it for a filter with the true
parameters, with tuned ones and with the default; smoothed; with correlated receiver errors; aided; with wrong
parameters; with faults; and the time that a fix takes.
"""

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
from steerway_studies.study import Results, Study, stage


def run(seeds=None, first_seed=0, progress=None) -> Results:
    """The study; `seeds` runs a cell, by default 30 (60 in O), and fewer of what is inferred from the fixes."""
    results = Results("The estimator at its limit", lead=LEAD)
    costs = cost.measured(first_seed)  # before the other work warms the machine
    began = 0.02
    found = {}
    for section, share, words in _SECTIONS:
        found[section] = section.measured(seeds, first_seed, stage(progress, began, share, words))
        began += share
    for section, _, _ in _SECTIONS:
        section.report(results, found[section])
    cost.report(results, costs)
    results.figures |= figures.all_figures(results.numbers, found[aided]["bias"])
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


STUDY = Study("estimator-limits", "error against the Cramér–Rao bound, consistency, smoothing, aiding, troubles", run)
