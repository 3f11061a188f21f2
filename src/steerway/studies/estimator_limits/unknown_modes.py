"""Why a ratio of one is out of reach: what not knowing the modes costs whoever weighs all their histories.

The filter that weighs a thousand histories at a time, the smoother that walks over all of them, and the smoother that
is told the true one, on the same voyages and fixes as the product.
"""

from functools import partial

import numpy as np

from steerway.simulation.campaign import over_seeds
from steerway.studies.estimator_limits.bound import filtering_bound, smoothing_bound
from steerway.studies.estimator_limits.cells import CELLS, WHAT, WHERE, WORDS, bounded, by_place, sums
from steerway.studies.estimator_limits.histories import all_histories, told_smoother
from steerway.studies.estimator_limits.particles import begun, in_plane, particle_filter
from steerway.studies.estimator_limits.scenarios import cells
from steerway.studies.estimator_limits.statistics import over_runs, turned
from steerway.studies.study import Results

SEEDS = 30
PARTICLES = {"o05": 1000, "o25": 1000, "m05": 300, "m25": 300}
SWEEPS = 10
"""Proposals to the chain, per fix."""
SMOOTHED = ("o05", "o25")
"""In M the modes show so clearly that the product's smoother is within a tenth of the bound."""


def one(case) -> dict[str, np.ndarray]:
    """`sums` of each way to estimate a voyage of a cell, and of the NEES of (U, χ, ω)."""
    name, seed = case
    cell = CELLS[name]
    voyage, fixes = cell.sailed(seed)
    models, places, dt = cell.profile.manners(), in_plane(fixes), 1.0 / cell.scenario.rate
    start = begun(voyage, models, seed)
    masks = cells(cell.scenario, voyage)

    means, spreads = particle_filter(places, start, models, dt, PARTICLES[name], seed)
    error = _errors(means, voyage)
    nees = np.einsum("ki,kij,kj->k", error, np.linalg.inv(spreads[:, 2:, 2:]), error)
    found = {
        "bound": bounded(filtering_bound(voyage, cell.profile), voyage, cell.scenario),
        "particles": sums(np.square(error).T, masks),
        "nees": by_place(nees, voyage, cell.scenario),
    }
    if name in SMOOTHED:
        told = told_smoother(places, start, voyage.turning, models, dt)
        found["smoothing_bound"] = bounded(smoothing_bound(voyage, cell.profile), voyage, cell.scenario)
        found["told"] = sums(np.square(_errors(told, voyage)).T, masks)
        for key, guess in (("histories", voyage.turning), ("histories_blind", np.zeros(len(places), bool))):
            walked, _ = all_histories(places, start, guess, models, dt, SWEEPS, seed)
            found[key] = sums(np.square(_errors(walked, voyage)).T, masks)
    return found


def _errors(states, voyage):
    """(n, 3) of SOG, COG and course rate."""
    errors = states[:, 2:] - voyage.states[:, 2:]
    errors[:, 1] = turned(errors[:, 1])
    return errors


def measured(seeds, first_seed, progress) -> dict[str, dict[str, np.ndarray]]:
    """Cell → kind → sums, a row a run."""
    cases = [(name, seed) for name in CELLS for seed in range(first_seed, first_seed + (seeds or SEEDS))]
    runs = over_seeds(partial(_nth, cases), range(len(cases)), progress=progress)
    found = {}
    for name in CELLS:
        of_cell = [run for (cell, _), run in zip(cases, runs, strict=True) if cell == name]
        found[name] = {kind: np.array([run[kind] for run in of_cell]) for kind in of_cell[0]}
    return found


def _nth(cases, index):
    return one(cases[index])


KINDS = {
    "particles": ("bound", "filter of {} histories"),
    "told": ("smoothing_bound", "smoother told the modes"),
    "histories": ("smoothing_bound", "smoother by all histories, begun at the true one"),
    "histories_blind": ("smoothing_bound", "smoother by all histories, begun at none"),
}


def report(results: Results, found) -> None:
    """Ratios as numbers, COG of them in the table; NEES of the filter of many histories."""
    for name, kinds in found.items():
        for kind, (bound, words) in KINDS.items():
            if kind not in kinds:
                continue
            for k, where in enumerate(WHERE):
                place = "straight" if where == "straight" else "in turns"
                for i, what in enumerate(WHAT):
                    key = f"{kind}_{name}_{what}_{where}_ratio"
                    value, low, high = over_runs(kinds[kind][:, k, i], kinds[bound][:, k, i])
                    if what == "sog":
                        results.numbers |= {key: value, f"{key}_low": low, f"{key}_high": high}
                        continue
                    who, quantity = words.format(PARTICLES[name]), {"cog": "COG", "rate": "course rate"}[what]
                    what_for = f"{WORDS[name]}, {who}: {quantity} over its bound, {place}"
                    published = {"o05": "2.5", "o25": "2.6"}.get(name, "") if key.endswith("cog_straight_ratio") else ""
                    results.compare(
                        key, value, what_for, "", published if kind == "particles" else "", interval=(low, high)
                    )
        for k, where in enumerate((*WHERE, "all")):
            value = over_runs(kinds["nees"][:, k, 0], kinds["nees"][:, k, 1], root=False)
            place = {"straight": "straight", "turn": "in turns", "all": "all along"}[where]
            results.compare(
                f"particles_{name}_nees_{where}",
                value.value,
                f"{WORDS[name]}, filter of {PARTICLES[name]} histories: mean NEES of (U, χ, ω), {place}",
                "",
                "3",
                interval=value[1:],
            )
