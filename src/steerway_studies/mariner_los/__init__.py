"""mariner-los: P1 section 4, path following of a MARINER-class ship on an estimated course.

Fossen, "Line-of-sight path-following control utilizing an extended Kalman filter for estimation of speed and course
over ground from GNSS positions", Journal of Marine Science and Technology, 2022.
"""

import math

from steerway_studies.mariner_los.comparisons import REMARKS, compare_all
from steerway_studies.mariner_los.figures import all_figures
from steerway_studies.mariner_los.ship import NOISES, ShipCase, measured
from steerway_studies.parts import over_cases
from steerway_studies.study import Results, Study, seeds_from, stage

SEEDS = 4
ROTATION_SEEDS = 1
ROTATIONS = tuple(range(0, 360, 15))
"""Degrees."""
LOW_PASSES = (20.0, 40.0, 100.0, 200.0)
"""T_lp, s."""


def run(seeds: int | None = None, first_seed: int = 0, progress=None) -> Results:
    """See Study."""
    results = Results("mariner-los: path following of a MARINER-class ship on an estimated course (P1 §4)")
    truths = [ShipCase("truth", low_pass=low_pass) for low_pass in LOW_PASSES]
    noisy = [
        ShipCase(feedback, noise, low_pass, seed=seed)
        for feedback in ("printed", "product")
        for noise in NOISES.values()
        for low_pass in LOW_PASSES
        for seed in seeds_from(first_seed, seeds, SEEDS)
    ]
    rotated = [
        ShipCase(feedback, turned=math.radians(angle), seed=seed)
        for feedback in ("printed", "product")
        for angle in ROTATIONS
        for seed in seeds_from(first_seed, seeds, ROTATION_SEEDS)
    ]
    cases = truths + noisy + rotated
    step = stage(progress, 0.0, 0.95, f"{len(cases)} voyages")
    found = dict(zip(cases, over_cases(measured, cases, progress=step), strict=True))
    compare_all(results, *({case: found[case] for case in each} for each in (truths, noisy, rotated)))
    results.figures |= all_figures(first_seed)
    results.remarks += REMARKS
    return results


STUDY = Study("mariner-los", "P1 §4: path following of a MARINER-class ship on an estimated course", run)
