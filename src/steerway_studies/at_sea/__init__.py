"""at-sea: the autopilot in currents up to 80 % of the boat's speed: squares and surveys, three boats, many receivers.

Each seed draws a balanced part of the grid: every direction of the current with the Otter and the motorboat, currents,
routes and receivers evenly mixed. Boats start from rest, with no compass. An autopilot as aboard would have stopped
where fixes do not fit its estimate for as long as the one aboard allows: `own_gate_stops`.
"""

from functools import partial

from steerway_studies.at_sea.cases import ablations, all_cases, drawn
from steerway_studies.at_sea.comparisons import compare_all
from steerway_studies.at_sea.figures import all_figures
from steerway_studies.at_sea.sailing import judged
from steerway_studies.parts import over_cases
from steerway_studies.study import Results, Study, seeds_from, stage

SEEDS = 8


def run(seeds=None, first_seed=0, progress=None, full=False) -> Results:
    """See Study; `seeds` parts of the grid, 8 by default, or as often the whole grid."""
    chosen = seeds_from(first_seed, seeds, SEEDS)
    pairs = [(case, seed) for seed in chosen for case in (all_cases() if full else drawn(seed))]
    others = [(case, seed) for seed in chosen for case in ablations(seed)]
    found = over_cases(_judged_of, pairs, progress=stage(progress, 0.0, 0.85, "squares and surveys"))
    without = over_cases(_judged_of, others, progress=stage(progress, 0.85, 0.15, "ablations"))
    results = Results("The autopilot in currents up to 80 % of the boat's speed")
    compare_all(results, found, without)
    results.figures |= all_figures(found, first_seed)
    return results


def _judged_of(pair):
    return judged(*pair)


STUDY = Study(
    "at-sea",
    "squares and surveys in currents up to 80 % of the boat's speed, from rest, no compass",
    run,
    run_full=partial(run, full=True),
)
