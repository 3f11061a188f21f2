"""otter-course: P0 sections 5–7, an Otter on course commands of 20° and back to 0°, and estimates on real logs.

Fossen and Fossen, "Five-state extended Kalman filter for estimation of speed over ground (SOG), course over ground
(COG) and course rate of unmanned surface vehicles (USVs): experimental results", Sensors 21, 2021, 7910.
"""

from steerway_studies.otter_course import comparisons, figures
from steerway_studies.otter_course.boat import as_published, identified, steered_by_product
from steerway_studies.otter_course.comparisons import NOISY
from steerway_studies.otter_course.logs import add_logs
from steerway_studies.parts import over_cases
from steerway_studies.study import Results, Study, seeds_from, stage

SEEDS = 20


def run(seeds: int | None = None, first_seed: int = 0, progress=None) -> Results:
    """See Study."""
    results = Results("otter-course: an Otter on course commands of 20° and 0°, and real logs (P0 §5–7)")
    published, failing = as_published(), as_published(0.01, first_seed)
    comparisons.published_set_up(results, published)
    comparisons.gains(results)
    comparisons.published_with_noise(results, failing)
    chosen = seeds_from(first_seed, seeds, SEEDS)
    step = stage(progress, 0.0, 0.8, f"{len(chosen)} seeds with noise")
    comparisons.product_with_noise(results, over_cases(comparisons.noisy_numbers, chosen, progress=step))

    runs = {
        f"product filter, {noise:g} m of noise, ω_n = {bandwidth:g} rad/s": steered_by_product(
            noise, bandwidth, identified(noise, first_seed), first_seed
        )
        for noise, bandwidth, _ in NOISY.values()
    }
    results.figures |= figures.all_figures(published, failing, runs)
    if progress:
        progress(0.85, "real logs")
    results.remarks += comparisons.REMARKS
    add_logs(results)
    return results


STUDY = Study("otter-course", "P0 §5–7: an Otter on course commands of 20° and 0°, and the estimate on real logs", run)
