"""What a fix costs: whole records through the compiled filters on one core."""

import time

import numpy as np

from steerway.estimation import FiveStateFilter
from steerway.sensors import white
from steerway_studies.estimator_limits.cells import CELLS
from steerway_studies.estimator_limits.correlated import boat_profile
from steerway_studies.estimator_limits.scenarios import sail
from steerway_studies.study import Results

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


def measured(first_seed: int) -> dict[str, float]:
    """µs a fix of every kind of filter."""
    cell = CELLS["m05"]
    fixes = sail(cell.scenario, first_seed).fixes(white(cell.position_std), first_seed)
    wandering = boat_profile()
    slow = {name: getattr(wandering, name) for name in ("error_std", "error_time")}
    drift = {name: getattr(wandering, name) for name in ("drift_std", "drift_time")}
    updates = {
        "two_modes_gm": slow,
        "two_modes_two_gm": slow | drift,
        "two_modes": {},
        "five_states": {"turn_time": 0.0},
    }
    return {key: microseconds(cell.profile.model_copy(update=update), fixes) for key, update in updates.items()}


_KINDS = {
    "two_modes_gm": ("two modes, one Gauss–Markov error", TARGET),
    "two_modes_two_gm": ("two modes, two Gauss–Markov errors", None),
    "two_modes": ("two modes, white noise", None),
    "five_states": ("the plain five states", None),
}


def report(results: Results, found) -> None:
    """Two modes with one, two and no pair of receiver-error states; one mode."""
    results.section = "Cost"
    for key, (words, target) in _KINDS.items():
        results.compare(
            f"cost_us_per_fix_{key}",
            found[key],
            f"a fix through a whole record: {words}",
            "µs",
            "",
            f"≤ {target:g}" if target else "",
            found[key] <= target if target else None,
        )
