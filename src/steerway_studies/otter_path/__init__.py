"""otter-path: an Otter on a straight leg across current and wind, by course, by heading and by adaptive guidance.

What P1 claims for course: line of sight on the estimated course over ground needs to know neither current nor crab
angle. The leg is 400 m north and judged from 150 to 380 m; the current sets 0.3 m/s and the wind drifts with 5 N to the
east. Fixes at 5 Hz with white noise, no speed and no course from the receiver.
"""

from steerway_studies.otter_path.boat import CASES, leg
from steerway_studies.otter_path.comparisons import compare_all
from steerway_studies.otter_path.figures import all_figures
from steerway_studies.parts import over_cases
from steerway_studies.study import Results, Study, seeds_from, stage

SEEDS = 20


def run(seeds=None, first_seed=0, progress=None) -> Results:
    """See Study; `seeds` noise seeds a case, 20 by default."""
    chosen = seeds_from(first_seed, seeds, SEEDS)
    pairs = [(case, seed) for case in CASES for seed in chosen]
    found = dict(zip(pairs, over_cases(_leg_of, pairs, progress=stage(progress, 0.0, 1.0, "legs")), strict=True))
    results = Results("An Otter on a leg across the current (P1, otter-path)")
    compare_all(results, {case: [found[case, seed] for seed in chosen] for case in CASES})
    results.figures |= all_figures(first_seed)
    return results


def _leg_of(pair):
    return leg(*pair)


STUDY = Study("otter-path", "An Otter on a leg across the current: course against heading guidance (P1)", run)
