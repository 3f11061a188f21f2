"""springer-mission: P4, weighted interval Kalman filter, line of sight and MPC on Springer, and the aided filter."""

from steerway.sensors import TRUE_TCM2
from steerway_studies.springer_mission import bounds, comparisons, figures, missions, perturbed
from steerway_studies.springer_mission.navigators import nominal
from steerway_studies.springer_mission.world import World, sail
from steerway_studies.study import Results, Study, seeds_from

PAPER_SEEDS, CIRCUITS, UNSEEN, WORLDS, ALARMS, MODELS = 20, 100, 100, 24, 100, 200


def run(seeds: int | None = None, first_seed: int = 0, progress=None) -> Results:
    """See Study; `seeds` sets every repetition count."""
    results = Results("P4: Springer's way-point mission with Kalman, interval and aided filters")
    step = progress or (lambda share, words: None)
    bounds.decoding(results)
    bounds.offsets(results)
    reference = bounds.reference_voyage(first_seed)
    step(0.05, "rigour and bounds")
    bounds.rigorous(results, reference)
    bounds.inclusion(results, reference, seeds or MODELS, first_seed)
    traces = bounds.widths(results, reference)
    weighted, navigator = bounds.tautology(results, first_seed)
    step(0.2, "the paper's mission")
    comparisons.paper(results, missions.many(missions.paper_mission, seeds_from(first_seed, seeds, PAPER_SEEDS)))
    step(0.35, "random circuits")
    circuits = missions.many(missions.random_mission, seeds_from(first_seed, seeds, CIRCUITS))
    comparisons.circuits(results, circuits)
    step(0.5, "unseen compasses")
    unseen = missions.many(missions.unseen_mission, seeds_from(first_seed, seeds, UNSEEN))
    comparisons.unseen(results, unseen)
    step(0.75, "harder worlds")
    worlds = {kind: missions.real_missions(kind, seeds_from(first_seed, seeds, WORLDS)) for kind in "abcd"}
    comparisons.worlds(results, worlds)
    comparisons.boxed(results, worlds["a"])
    step(0.85, "perturbed worlds")
    scenes = missions.many(perturbed.missions, seeds_from(first_seed, seeds, WORLDS))
    perturbed.compare(results, scenes)
    step(0.95, "alarms")
    comparisons.alarms(results, missions.many(missions.alarm_mission, seeds_from(first_seed, seeds, ALARMS)))
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
