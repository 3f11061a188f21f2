"""adaptive-speed: P3, adaptive speed control and fusion of GPS, Doppler log and accelerometer."""

from steerway_studies.adaptive_speed import cases, printed
from steerway_studies.adaptive_speed.cases import FAULTS, Job
from steerway_studies.adaptive_speed.comparisons import compare_all
from steerway_studies.adaptive_speed.figures import all_figures
from steerway_studies.adaptive_speed.plants import PLANTS, SPEEDS
from steerway_studies.parts import over_cases
from steerway_studies.study import Results, Study, seeds_from, stage

FEW, MANY, BASELINE = 20, 100, 5
"""Seeds of what varies little, of what chance decides, and of the baseline."""


def voyages(seeds: int | None, first: int) -> list[Job]:
    """Every voyage of the study."""

    def of(kind, count, setpoints=SPEEDS, plants=("a",)):
        numbers = seeds_from(first, seeds, count)
        return [Job(kind, seed, speed, plant) for plant in plants for speed in setpoints for seed in numbers]

    many = seeds_from(first, seeds, MANY)
    return [
        *of("staircase", FEW, setpoints=(3,), plants=PLANTS),
        *of("outage", FEW, setpoints=(3,)),
        *of("printed_filter", FEW),
        *of("ours", FEW, plants=PLANTS),
        *of("baseline", BASELINE, plants=PLANTS),
        *of("chance", MANY),
        *[Job("faultless", seed, SPEEDS[seed % 3]) for seed in many],
        *of("gps_only", FEW),
        *of("water_track", FEW),
        *of("fault", FEW, setpoints=(3,), plants=FAULTS),
    ]


def run(seeds: int | None = None, first_seed: int = 0, progress=None) -> Results:
    """See Study; some five minutes on two idle cores. `seeds` sets every repetition count."""
    jobs = voyages(seeds, first_seed)
    step = stage(progress, 0.0, 0.9, f"{len(jobs)} voyages")
    judged = dict(zip(jobs, over_cases(cases.run, jobs, progress=step), strict=True))
    tracks = {
        "printed": {speed: printed.as_printed(speed) for speed in SPEEDS},
        "published": {speed: printed.as_published(speed) for speed in SPEEDS},
    }
    results = Results("P3: adaptive speed control and speed fusion")
    compare_all(results, judged, tracks)
    if progress:
        progress(0.95, "drawing")
    results.figures |= all_figures(judged, tracks, first_seed)
    if progress:
        progress(1.0, "done")
    return results


STUDY = Study("adaptive-speed", "P3: adaptive speed control, fusion of GPS, Doppler log and accelerometer", run)
