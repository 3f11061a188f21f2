"""springer-mission: P4, weighted interval Kalman filter, line of sight and MPC on Springer, and the aided filter."""

from functools import partial

from steerway.sensors import TRUE_TCM2
from steerway_studies.springer_mission import bounds, comparisons, figures, missions
from steerway_studies.springer_mission.navigators import nominal
from steerway_studies.springer_mission.world import World, sail
from steerway_studies.study import Results, Study, seeds_from, stage

PAPER_SEEDS, CIRCUITS, UNSEEN, WORLDS, ALARMS, MODELS = 20, 100, 100, 24, 100, 200


def run(seeds: int | None = None, first_seed: int = 0, progress=None) -> Results:
    """See Study; `seeds` sets every repetition count."""
    results = Results("P4: Springer's way-point mission with Kalman, interval and aided filters")
    step = progress or (lambda share, words: None)
    step(0.0, "bounds")
    bounds.decoding(results)
    bounds.offsets(results)
    reference = bounds.reference_voyage(first_seed)
    bounds.inclusion(results, reference, seeds or MODELS, first_seed)
    traces = bounds.widths(results, reference)
    weighted, navigator = bounds.tautology(results, first_seed)

    def voyages(mission, usual, began, share, words):
        return missions.many(mission, seeds_from(first_seed, seeds, usual), stage(progress, began, share, words))

    comparisons.paper(results, voyages(missions.paper_mission, PAPER_SEEDS, 0.1, 0.05, "the paper's mission"))
    circuits = voyages(missions.random_mission, CIRCUITS, 0.15, 0.05, "random circuits")
    comparisons.circuits(results, circuits)
    unseen = voyages(missions.unseen_mission, UNSEEN, 0.2, 0.55, "unseen compasses")
    comparisons.unseen(results, unseen)
    worlds = {
        kind: voyages(partial(missions.real_mission, kind), WORLDS, 0.75 + 0.0375 * k, 0.0375, "harder worlds")
        for k, kind in enumerate("abcd")
    }
    comparisons.worlds(results, worlds)
    comparisons.boxed(results, worlds["a"])
    comparisons.alarms(results, voyages(missions.alarm_mission, ALARMS, 0.9, 0.05, "alarms"))
    bounds.speeds(results, reference)
    lost = sail(World(compass=TRUE_TCM2), nominal(), first_seed)
    results.figures |= figures.all_figures(lost, weighted, navigator, reference, traces, circuits, unseen, worlds)
    results.remarks += comparisons.REMARKS
    step(1.0, "done")
    return results


STUDY = Study(
    "springer-mission",
    "P4: interval filters, MPC and the aided filter on Springer's way-point mission",
    run,
    needs=("daqp",),
)
