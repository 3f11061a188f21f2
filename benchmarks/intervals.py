"""CPU time of an interval filter, against the crisp filter; paper P4, section 6, gives a factor of 5 to 10."""

import numpy as np

from benchmarks.support.harness import Result, interleaved
from steerway.estimation.heading import CompositeFilter, IntervalFilter, box_of, composite_model
from steerway.sensors import TCM2, DynamicCompass
from steerway_studies.papers.interval_filter import PrintedIntervalFilter

_SECONDS, _ROUNDS, _TOLERANCE = 400, 5, 0.001


def run():
    compass = DynamicCompass(TCM2).start(0.0, np.random.default_rng(1))
    readings = [compass.readings(0.02 * second, 40) for second in range(_SECONDS)]
    box = box_of(composite_model(), _TOLERANCE, False)
    kinds = {
        "crisp": lambda: CompositeFilter(composite_model()),
        "sharpened": lambda: IntervalFilter(box),
        "as printed": lambda: PrintedIntervalFilter(box),
    }
    seconds = dict.fromkeys(kinds, _SECONDS) | {"as printed": 5}  # its bounds are lost after some ten seconds

    def of(kind):
        def work():
            for _ in range(_SECONDS // seconds[kind]):
                estimator = kinds[kind]()
                for each in readings[: seconds[kind]]:
                    estimator.step(0.0, each)

        return work

    taken = interleaved({kind: of(kind) for kind in kinds}, _ROUNDS)
    yield Result("a second of the crisp filter, 40 readings", 1e6 * taken["crisp"] / _SECONDS, "µs")
    for kind in ("sharpened", "as printed"):
        yield Result(f"interval filter, {kind} / crisp", taken[kind] / taken["crisp"], "times", note="P4: 5 to 10")
