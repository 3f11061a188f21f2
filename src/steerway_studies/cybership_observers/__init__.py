"""cybership-observers: P2, observers for dynamic positioning on CyberShip II, and the nine-state filter."""

from functools import partial

import numpy as np

from steerway_studies.cybership_observers import trials, tuning
from steerway_studies.cybership_observers.comparisons import REMARKS, compare_all
from steerway_studies.cybership_observers.figures import all_figures
from steerway_studies.parts import over_cases
from steerway_studies.study import Results, Study, seeds_from, stage

SEEDS = 400


def run(seeds: int | None = None, first_seed: int = 0, progress=None) -> Results:
    """See Study. 400 seeds take about three minutes on four cores."""
    chosen = seeds_from(first_seed, seeds, SEEDS)
    step = stage(progress, 0.0, 0.4, "tuning process noise")
    tuned = tuning.tuned_cases(min(len(chosen), tuning.TUNING_SEEDS), step or (lambda share: None))
    step = stage(progress, 0.4, 0.6, "observers on every seed")
    rows = over_cases(partial(trials.trial, tuned), chosen, progress=step)
    table = {key: np.array([row[key] for row in rows]) for key in rows[0]}
    results = Results("Observers for dynamic positioning on CyberShip II")
    results.numbers["seeds"] = len(chosen)
    compare_all(results, table, tuned)
    results.figures |= all_figures(first_seed, results.numbers, table)
    results.remarks += REMARKS
    return results


STUDY = Study("cybership-observers", "P2: observers for dynamic positioning on CyberShip II", run)
