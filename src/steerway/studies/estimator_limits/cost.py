"""What a fix costs: whole records through the compiled filters on one core."""

import time

import numpy as np

from steerway.estimation.filter import FiveStateFilter
from steerway.sensors.gnss import white
from steerway.studies.estimator_limits.cells import CELLS
from steerway.studies.estimator_limits.correlated import boat_profile
from steerway.studies.estimator_limits.scenarios import sail
from steerway.studies.study import Results

REPEATS = 7
TARGET = 3.0


def microseconds(profile, fixes) -> float:
    """µs a fix: the best of some passes over a record of one vessel, which runs on one core."""
    estimator = FiveStateFilter(profile)
    estimator.filter(fixes)
    best = np.inf
    for _ in range(REPEATS):
        began = time.perf_counter()
        estimator.filter(fixes)
        best = min(best, time.perf_counter() - began)
    return 1e6 * best / len(fixes)


def report(results: Results, first_seed: int) -> None:
    """Two modes with two, one and no pair of receiver-error states; one mode."""
    cell = CELLS["m05"]
    fixes = sail(cell.scenario, first_seed).fixes(white(cell.position_std), first_seed)
    known = cell.profile
    wandering = boat_profile()
    slow = {name: getattr(wandering, name) for name in ("error_std", "error_time")}
    drift = {name: getattr(wandering, name) for name in ("drift_std", "drift_time")}
    profiles = {
        "two_modes_gm": (known.model_copy(update=slow), "two modes, one Gauss–Markov error", TARGET),
        "two_modes_two_gm": (known.model_copy(update=slow | drift), "two modes, two Gauss–Markov errors", None),
        "two_modes": (known, "two modes, white noise", None),
        "five_states": (known.model_copy(update={"turn_time": 0.0}), "the plain five states", None),
    }
    for key, (profile, words, target) in profiles.items():
        value = microseconds(profile, fixes)
        results.compare(
            f"cost_us_per_fix_{key}",
            value,
            f"a fix through a whole record: {words}",
            "µs",
            "",
            f"≤ {target:g}" if target else "",
            value <= target if target else None,
        )
