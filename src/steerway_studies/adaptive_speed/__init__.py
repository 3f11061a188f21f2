"""P3: adaptive speed control and the fusion of GPS, Doppler log and accelerometer, as printed and as it can be done."""

from steerway_studies.adaptive_speed import cases, figures, findings, printed
from steerway_studies.adaptive_speed.cases import FAULTS, Job
from steerway_studies.adaptive_speed.plants import PLANTS, SPEEDS
from steerway_studies.study import Results, Study

FEW, MANY, BASELINE = 20, 100, 5
"""Seeds of what varies little, of what chance decides, and of the baseline."""


def voyages(seeds: int | None, first: int) -> list[Job]:
    """Every voyage of the study."""

    def of(kind, count, setpoints=SPEEDS, plants=("a",)):
        numbers = range(first, first + (seeds or count))
        return [Job(kind, seed, speed, plant) for plant in plants for speed in setpoints for seed in numbers]

    many = range(first, first + (seeds or MANY))
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


def run(seeds=None, first_seed=0, progress=None) -> Results:
    """The whole study: under three minutes on four idle cores. `seeds` sets every repetition count."""
    from steerway.simulation import over_seeds

    def tell(share):
        if progress:
            progress(0.9 * share, "sailing")

    jobs = voyages(seeds, first_seed)
    judged = dict(zip(jobs, over_seeds(cases.run, jobs, progress=tell), strict=True))
    tracks = {
        "printed": {speed: printed.as_printed(speed) for speed in SPEEDS},
        "published": {speed: printed.as_published(speed) for speed in SPEEDS},
    }
    results = Results("P3: adaptive speed control and speed fusion")
    findings.record(results, judged, tracks)
    if progress:
        progress(0.95, "drawing")
    figures.draw(results, judged, tracks, first_seed)
    if progress:
        progress(1.0, "done")
    return results


STUDY = Study("adaptive-speed", "P3: adaptive speed control, fusion of GPS, Doppler log and accelerometer", run)
