"""A vessel with other parameters than the filter supposes: dwell times or noise densities three times more or less.

The filter keeps the parameters of scenarios O and M. The cost is its error over that of a filter with the true
parameters on the same voyages. In O, where the modes are hard to see, a filter of many histories of modes keeps them
too: what it loses is the cost of wrong parameters, not of the product's approximations.
"""

from dataclasses import replace

import numpy as np

import steerway
from steerway.sensors import white
from steerway_studies.estimator_limits.cells import CELLS, PLACES, QUANTITIES, WHAT, WORDS, judged, sums
from steerway_studies.estimator_limits.particles import begun, in_plane, particle_filter
from steerway_studies.estimator_limits.scenarios import sail, straight_and_turning
from steerway_studies.estimator_limits.statistics import errors, over_runs
from steerway_studies.parts import over_cases
from steerway_studies.study import Results, seeds_from

SEEDS = 30
HISTORIES = {"o05": 300, "o25": 300}
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


def one(seed: int, names=tuple(CELLS)) -> dict[str, np.ndarray]:
    """`sums` (2, 2, 5) of the filter with the true parameters and of the one that holds its own, by cell and change."""
    found = {}
    for name in names:
        cell = CELLS[name]
        for change in CHANGES:
            scenario = changed(cell.scenario, change)
            voyage = sail(scenario, seed)
            fixes = voyage.fixes(white(cell.position_std, scenario.rate), seed)
            profiles = scenario.known(cell.position_std), cell.profile
            estimates = (steerway.estimate(fixes, each) for each in profiles)
            found[f"{name}_{change}"] = np.stack([judged(each, voyage, scenario) for each in estimates])
            if name in HISTORIES:
                weighed = [_weighed(voyage, fixes, each, scenario, HISTORIES[name], seed) for each in profiles]
                found[f"particles_{name}_{change}"] = np.stack(weighed)
    return found


def changed(scenario, change):
    """The scenario with a vessel of other dwell times or densities."""
    parameters, factor = CHANGES[change]
    update = {each: factor * getattr(scenario.profile, each) for each in parameters}
    return replace(scenario, profile=scenario.profile.model_copy(update=update))


def _weighed(voyage, fixes, profile, scenario, histories, seed):
    models = profile.modes()
    start = begun(voyage, models, seed)
    means, _ = particle_filter(in_plane(fixes), start, models, 1.0 / scenario.rate, histories, seed)
    return sums(np.square(errors(*means[:, 2:].T, voyage)), straight_and_turning(scenario, voyage))


def measured(seeds, first_seed, progress) -> dict[str, np.ndarray]:
    """Cell and change → (runs, 2, 2, 5)."""
    runs = over_cases(one, seeds_from(first_seed, seeds, SEEDS), progress=progress)
    return {key: np.array([run[key] for run in runs]) for key in runs[0]}


def report(results: Results, found) -> None:
    """Every cost as a number; in the list, for each change and quantity, the worst of cells and places.

    All along weighs rows straight and in turns alike, as whoever tunes does.
    """
    results.section = "Parameters held"
    for change, words in WORDS_OF_CHANGES.items():
        for i, what in enumerate(WHAT):
            by_cell = {name: _costs(found[f"{name}_{change}"][..., i]) for name in CELLS}
            costs = {(name, where): cost for name, of_cell in by_cell.items() for where, cost in of_cell.items()}
            for (name, where), cost in costs.items():
                results.numbers[f"held_{name}_{change}_{what}_{where}_pct"] = cost[0]
            overall = {key: cost for key, cost in costs.items() if key[1] == "all"}
            for key, chosen in ((f"{what}_worst", costs), (f"{what}_all_worst", overall)):
                (name, where), (value, low, high) = max(chosen.items(), key=lambda each: each[1][0])
                results.compare(
                    f"held_{change}_{key}_pct",
                    value,
                    f"{words}, parameters held: cost in {QUANTITIES[what]}, at worst ({WORDS[name]}, {PLACES[where]})",
                    "%",
                    "",
                    f"≤ {TARGET:g}",
                    value <= TARGET,
                    (low, high),
                )
    rows = [_row(results, found, name, change) for change in CHANGES for name in HISTORIES]
    results.tables.append((_TITLE, _COLUMNS, rows))


def _costs(squares) -> dict[str, list[float]]:
    """By place the cost in % and its interval, of sums (runs, 2, 2) of squared errors: true and held, by place."""
    places = {"straight": squares[:, :, 0], "turn": squares[:, :, 1], "all": squares.sum(axis=2)}
    return {
        where: [100.0 * (each - 1.0) for each in over_runs(of_place[:, 1], of_place[:, 0])]
        for where, of_place in places.items()
    }


def _row(results, found, name, change):
    """Cost of COG and course rate for the product and for the filter of many histories."""
    row = [WORDS_OF_CHANGES[change], WORDS[name]]
    for i, what in enumerate(WHAT):
        ours, theirs = (_costs(found[f"{who}{name}_{change}"][..., i]) for who in ("", "particles_"))
        for where, (value, low, high) in theirs.items():
            key = f"held_particles_{name}_{change}_{what}_{where}_pct"
            results.numbers |= {key: value, f"{key}_low": low, f"{key}_high": high}
        if what == "sog":  # it hardly suffers
            continue
        row += [" / ".join(f"{each[where][0]:+.1f}" for where in PLACES) for each in (ours, theirs)]
    return row


_TITLE = "Parameters held: cost in the RMS error, straight / in turns / all along (%)"
_FILTERS = ("product", "300 histories")
_COLUMNS = ("the vessel has", "of", *(f"{what}, {who}" for what in ("COG", "course rate") for who in _FILTERS))
