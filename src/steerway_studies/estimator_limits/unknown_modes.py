"""Why a ratio of one is out of reach: what not knowing the modes costs whoever weighs all their histories.

The filter that weighs a thousand histories at a time, the smoother that walks over all of them, and the smoother that
knows the true one, on the same voyages and fixes as the product.
"""

import numpy as np

from steerway_studies.estimator_limits.bound import filtering_bound, smoothing_bound
from steerway_studies.estimator_limits.cells import (
    CELLS,
    PLACES,
    QUANTITIES,
    WHAT,
    WHERE,
    WORDS,
    bounded,
    over_cells,
    sums,
)
from steerway_studies.estimator_limits.consistency import nees, report_nees
from steerway_studies.estimator_limits.histories import all_histories, known_mode_smoother
from steerway_studies.estimator_limits.particles import begun, in_plane, particle_filter
from steerway_studies.estimator_limits.scenarios import straight_and_turning
from steerway_studies.estimator_limits.statistics import errors, over_runs
from steerway_studies.study import Results

SEEDS = 30
PARTICLES = {"o05": 1000, "o25": 1000, "m05": 300, "m25": 300}
SWEEPS = 10
"""Proposals to the chain, per fix."""
SMOOTHED = ("o05", "o25")
"""In M the modes show so clearly that the product's smoother is within a tenth of the bound."""


def one(name: str, seed: int) -> dict[str, np.ndarray]:
    """`sums` of each way to estimate a voyage of a cell, and of the NEES of (U, χ, ω)."""
    cell = CELLS[name]
    voyage, fixes = cell.sailed(seed)
    models, places, dt = cell.profile.modes(), in_plane(fixes), 1.0 / cell.scenario.rate
    start = begun(voyage, models, seed)
    masks = straight_and_turning(cell.scenario, voyage)

    means, spreads = particle_filter(places, start, models, dt, PARTICLES[name], seed)
    error = errors(*means[:, 2:].T, voyage)
    found = {
        "bound": bounded(filtering_bound(voyage, cell.profile), voyage, cell.scenario),
        "particles": sums(np.square(error), masks),
        "nees": nees(error, spreads[:, 2:, 2:], voyage, cell.scenario),
    }
    if name in SMOOTHED:
        known = known_mode_smoother(places, start, voyage.turning, models, dt)
        found["smoothing_bound"] = bounded(smoothing_bound(voyage, cell.profile), voyage, cell.scenario)
        found["known"] = sums(np.square(errors(*known[:, 2:].T, voyage)), masks)
        for key, guess in (("histories", voyage.turning), ("histories_blind", np.zeros(len(places), bool))):
            walked, _ = all_histories(places, start, guess, models, dt, SWEEPS, seed)
            found[key] = sums(np.square(errors(*walked[:, 2:].T, voyage)), masks)
    return found


def measured(seeds, first_seed, progress) -> dict[str, dict[str, np.ndarray]]:
    """Cell → kind → sums, a row a run."""
    return over_cells(one, seeds or SEEDS, first_seed, progress)


KINDS = {
    "particles": ("bound", "filter of {} histories"),
    "known": ("smoothing_bound", "smoother with known modes"),
    "histories": ("smoothing_bound", "smoother by all histories, begun at the true one"),
    "histories_blind": ("smoothing_bound", "smoother by all histories, begun at none"),
}


def report(results: Results, found) -> None:
    """Ratios as numbers, COG of them in the table; NEES of the filter of many histories."""
    results.section = "What not knowing the modes costs"
    for name, kinds in found.items():
        for kind, (bound, words) in KINDS.items():
            if kind not in kinds:
                continue
            for k, where in enumerate(WHERE):
                for i, what in enumerate(WHAT):
                    key = f"{kind}_{name}_{what}_{where}_ratio"
                    value, low, high = over_runs(kinds[kind][:, k, i], kinds[bound][:, k, i])
                    if what == "sog":
                        results.numbers |= {key: value, f"{key}_low": low, f"{key}_high": high}
                        continue
                    who = words.format(PARTICLES[name])
                    what_for = f"{WORDS[name]}, {who}: {QUANTITIES[what]} over its bound, {PLACES[where]}"
                    published = {"o05": "2.5", "o25": "2.6"}.get(name, "") if key.endswith("cog_straight_ratio") else ""
                    results.compare(
                        key, value, what_for, "", published if kind == "particles" else "", interval=(low, high)
                    )
        who = f"{WORDS[name]}, filter of {PARTICLES[name]} histories"
        report_nees(results, f"particles_{name}", who, kinds["nees"], judged=False)
