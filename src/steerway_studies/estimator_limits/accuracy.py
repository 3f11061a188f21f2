"""Error against the bound in four cells, with true, tuned and default parameters; and consistency."""

import math
from functools import partial

import numpy as np

import steerway
from steerway.estimation import choose_profile, tune
from steerway_studies.estimator_limits.bound import filtering_bound, smoothing_bound
from steerway_studies.estimator_limits.cells import (
    CELLS,
    EARLIER,
    PLACES,
    QUANTITIES,
    WHAT,
    WHERE,
    WORDS,
    bounded,
    judged,
    over_cells,
)
from steerway_studies.estimator_limits.consistency import coverage_row, covered, report_nees, scores
from steerway_studies.estimator_limits.statistics import BootstrapInterval, over_runs
from steerway_studies.study import Results

PUBLISHED = {
    "o05": ((0.0257, 0.61, 0.128), (0.0261, 8.92, 5.96)),
    "o25": ((0.0388, 1.47, 0.128), (0.0399, 16.9, 6.66)),
    "m05": ((0.0109, 0.137, 0.0155), (0.109, 0.727, 0.247)),
    "m25": ((0.0163, 0.268, 0.0171), (0.164, 1.58, 0.310)),
}
"""The bound as an independent prototype has it: SOG m/s, COG °, rate °/s, straight and in turns."""
PUBLISHED_SMOOTHED = {"o05": 0.49, "o25": 0.43, "m05": 0.29, "m25": 0.33}
"""COG straight, smoothing bound over filtering bound."""
UNITS = {"sog": "mps", "cog": "deg", "rate": "dps"}
_SLOW_TARGETS = {
    ("sog", "straight"): 1.10,
    ("sog", "turn"): 1.20,
    ("cog", "straight"): 3.3,
    ("cog", "turn"): 1.25,
    ("rate", "straight"): 2.6,
    ("rate", "turn"): 1.15,
}
_FAST_TARGETS = {"": 1.15, "tuned_": 1.3, "default_": 1.6}
SMOOTHED_TARGET = 1.1
DEFAULT_RUNS, TUNED_RUNS = 8, 3
"""Runs of a cell, from its first, with what is inferred and what is tuned: an inference takes as long as a hundred runs
with a profile, tuning four times as long."""
NIS_BAND = (1.9, 2.1)
PARAMETERS = {"": "true parameters", "tuned_": "tuned from one earlier voyage", "default_": "as it comes"}
KINDS = ("", "smoothed_", "tuned_", "default_", "default_smoothed_")


def measure(
    name: str, seed: int, tuned_below: float = math.inf, inferred_below: float = math.inf
) -> dict[str, np.ndarray]:
    """One voyage of a cell: sums of squared errors by kind of estimate, of the bounds, of NIS and NEES.

    Vessel and receiver are tuned, and inferred, for seeds below these.
    """
    cell = CELLS[name]
    voyage, fixes = cell.sailed(seed)
    profiles = {"": cell.profile}
    if seed < inferred_below:
        profiles["default_"] = choose_profile(fixes)
    if seed < tuned_below:
        _, earlier = cell.sailed(EARLIER + seed)
        profiles["tuned_"] = tune(earlier).profile
    found = {
        "bound": bounded(filtering_bound(voyage, cell.profile), voyage, cell.scenario),
        "smoothing_bound": bounded(smoothing_bound(voyage, cell.profile), voyage, cell.scenario),
    }
    for kind in KINDS:
        profile = profiles.get(kind.removesuffix("smoothed_"))
        if profile is None:
            continue
        motion = steerway.estimate(fixes, profile, smooth=kind.endswith("smoothed_"))
        found[kind] = judged(motion, voyage, cell.scenario)
        found[f"{kind}covered"] = covered(motion, voyage, cell.scenario)
        if not kind.endswith("smoothed_"):
            settled = (voyage.time >= cell.scenario.settling) & np.isfinite(motion.nis)
            found[f"{kind}nis"] = np.array([motion.nis[settled].sum(), settled.sum()])
    _, found["nees"] = scores(voyage, fixes, cell.profile, cell.scenario)
    return found


def measured(seeds, first_seed, progress) -> dict[str, dict[str, np.ndarray]]:
    """Cell → kind → sums, a row a run."""
    runs = {name: seeds or cell.scenario.runs for name, cell in CELLS.items()}
    below = {"tuned_below": first_seed + TUNED_RUNS, "inferred_below": first_seed + DEFAULT_RUNS}
    return over_cells(partial(measure, **below), runs, first_seed, progress)


def ratio(sums, kind, bound, what, where) -> BootstrapInterval:
    """Error over bound in one cell, one quantity, straight or in turns."""
    i, k = WHAT.index(what), WHERE.index(where)
    return over_runs(sums[kind][:, k, i], sums[bound][: len(sums[kind]), k, i])


def report(results: Results, found) -> None:
    """All of it into the results."""
    results.section = "The bound"
    for name, sums in found.items():
        _bounds(results, name, sums)
    for kind in ("", "tuned_", "default_", "smoothed_", "default_smoothed_"):
        results.section = f"Error over the bound, {_in_words(kind)}"
        for name, sums in found.items():
            _ratios(results, name, sums, kind)
    results.section = "Consistency"
    for name, sums in found.items():
        _consistency(results, name, sums)
    _coverage(results, found)


def _bounds(results, name, sums):
    for k, where in enumerate(WHERE):
        for i, what in enumerate(WHAT):
            value, low, high = over_runs(sums["bound"][:, k, i], sums["bound"][:, k, 3])
            scale = 1.0 if what == "sog" else math.degrees(1.0)
            published = PUBLISHED[name][k][i]
            results.compare(
                f"{name}_{what}_{where}_bound_{UNITS[what]}",
                value * scale,
                f"{WORDS[name]}: bound of {QUANTITIES[what]}, {PLACES[where]}",
                _unit(what),
                f"{published:g}",
                "within 2 %",
                abs(value * scale / published - 1.0) <= 0.02,
                (low * scale, high * scale),
            )
    value = over_runs(sums["smoothing_bound"][:, 0, 1], sums["bound"][:, 0, 1])
    results.compare(
        f"{name}_cog_straight_smoothing_share",
        value.value,
        f"{WORDS[name]}: smoothing bound over filtering bound, COG, straight",
        "",
        f"{PUBLISHED_SMOOTHED[name]:g}",
        interval=value[1:],
    )


def _ratios(results, name, sums, kind):
    smoothed = kind.endswith("smoothed_")
    words = _in_words(kind)
    for what in WHAT:
        for where in WHERE:
            value = ratio(sums, kind, "smoothing_bound" if smoothed else "bound", what, where)
            aim = target(name, kind, what, where)
            results.compare(
                f"{kind}{name}_{what}_{where}_ratio",
                value.value,
                f"{WORDS[name]}, {words}: {QUANTITIES[what]} over its bound, {PLACES[where]}",
                "",
                "",
                f"≤ {aim:g}" if aim else "",
                value.value <= aim if aim else None,
                value[1:],
            )
    undefined = sums[kind][:, :, 4].sum() / sums[kind][:, :, 3:].sum()
    results.numbers[f"{kind}{name}_undefined_pct"] = 100.0 * float(undefined)


def target(name, kind, what, where) -> float | None:
    """The ratio to be reached, None where none is set."""
    if kind == "smoothed_":
        return SMOOTHED_TARGET
    if name.startswith("m"):
        return _FAST_TARGETS.get(kind)
    return _SLOW_TARGETS[what, where] if kind == "" else None


def _consistency(results, name, sums):
    for kind in PARAMETERS:
        nis = over_runs(sums[f"{kind}nis"][:, 0], sums[f"{kind}nis"][:, 1], root=False)
        held = NIS_BAND[0] <= nis.value <= NIS_BAND[1]
        results.compare(
            f"{kind}{name}_nis",
            nis.value,
            f"{WORDS[name]}, {PARAMETERS[kind]}: mean NIS",
            "",
            "2",
            "1.9 to 2.1" if kind == "" else "",
            held if kind == "" else None,
            nis[1:],
        )
    report_nees(results, name, f"{WORDS[name]}, true parameters", sums["nees"], judged=True)


def _coverage(results, found):
    rows = []
    for kind in KINDS:
        for name, sums in found.items():
            rows.append((_in_words(kind), WORDS[name], *coverage_row(results, f"{kind}{name}", sums[f"{kind}covered"])))
    heading = "Rows with the truth in the 95 % interval of the estimate (%): straight / in turns / all along"
    results.tables.append((heading, ("parameters", "vessel and receiver", *QUANTITIES.values()), rows))


def _in_words(kind):
    return PARAMETERS[kind.removesuffix("smoothed_")] + (", smoothed" if kind.endswith("smoothed_") else "")


def _unit(what):
    return {"sog": "m/s", "cog": "°", "rate": "°/s"}[what]
