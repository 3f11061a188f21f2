"""A vessel that is not as she was taken to be: her dwell times or noise densities three times more or less.

The filter keeps the parameters of scenarios O and M. What that costs is its error over that of a filter told the truth
on the same voyages.
"""

from dataclasses import replace

import numpy as np

import steerway
from steerway.sensors.gnss import white
from steerway.simulation.campaign import over_seeds
from steerway.studies.estimator_limits.cells import CELLS, WHAT, WORDS, judged
from steerway.studies.estimator_limits.scenarios import sail
from steerway.studies.estimator_limits.statistics import over_runs
from steerway.studies.study import Results

SEEDS = 60
DWELL = ("straight_time", "turn_time")
DENSITIES = ("speed_noise", "course_rate_noise", "turn_speed_noise", "turn_course_rate_noise")
CHANGES = {
    "dwell_x3": (DWELL, 3.0),
    "dwell_d3": (DWELL, 1.0 / 3.0),
    "density_x3": (DENSITIES, 3.0),
    "density_d3": (DENSITIES, 1.0 / 3.0),
}
WORDS_OF_CHANGES = {
    "dwell_x3": "dwell times × 3",
    "dwell_d3": "dwell times ÷ 3",
    "density_x3": "densities × 3",
    "density_d3": "densities ÷ 3",
}
TARGET = 25.0


def one(seed: int) -> dict[str, np.ndarray]:
    """`sums` (2, 2, 5) of the filter told and of the one that holds its parameters, by cell and change."""
    found = {}
    for name, cell in CELLS.items():
        for change, (parameters, factor) in CHANGES.items():
            update = {each: factor * getattr(cell.scenario.profile, each) for each in parameters}
            scenario = replace(cell.scenario, profile=cell.scenario.profile.model_copy(update=update))
            voyage = sail(scenario, seed)
            fixes = voyage.fixes(white(cell.position_std, scenario.rate), seed)
            told = scenario.known(cell.position_std)
            found[f"{name}_{change}"] = np.stack(
                [judged(steerway.estimate(fixes, each), voyage, scenario) for each in (told, cell.profile)]
            )
    return found


def measured(seeds, first_seed, progress) -> dict[str, np.ndarray]:
    """Cell and change → (runs, 2, 2, 5)."""
    runs = over_seeds(one, range(first_seed, first_seed + (seeds or SEEDS)), progress=progress)
    return {key: np.array([run[key] for run in runs]) for key in runs[0]}


def report(results: Results, found) -> None:
    """Every cost as a number; in the table, for each change and quantity, the worst of cells and places.

    All along weighs rows straight and in turns alike, as whoever tunes does.
    """
    for change, words in WORDS_OF_CHANGES.items():
        for i, what in enumerate(WHAT):
            costs = {}
            for name in CELLS:
                runs = found[f"{name}_{change}"][..., i]
                places = {"straight": runs[:, :, 0], "turn": runs[:, :, 1], "all": runs.sum(axis=2)}
                for where, of_place in places.items():
                    costs[name, where] = [100.0 * (each - 1.0) for each in over_runs(of_place[:, 1], of_place[:, 0])]
                    results.numbers[f"held_{name}_{change}_{what}_{where}_pct"] = costs[name, where][0]
            overall = {(name, where): cost for (name, where), cost in costs.items() if where == "all"}
            for key, chosen in ((f"{what}_worst", costs), (f"{what}_all_worst", overall)):
                (name, where), (value, low, high) = max(chosen.items(), key=lambda each: each[1][0])
                place = {"straight": "straight", "turn": "in turns", "all": "all along"}[where]
                quantity = {"sog": "SOG", "cog": "COG", "rate": "course rate"}[what]
                results.compare(
                    f"held_{change}_{key}_pct",
                    value,
                    f"{words}, parameters held: cost in {quantity}, at worst ({WORDS[name]}, {place})",
                    "%",
                    "",
                    f"≤ {TARGET:g}",
                    value <= TARGET,
                    (low, high),
                )
