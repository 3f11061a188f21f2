"""Error against the bound in four cells, with true, tuned and default parameters; and consistency."""

import math
from functools import partial

import numpy as np

import steerway
from steerway.estimation import choose_profile
from steerway.estimation.tuning.tuned import tune
from steerway.simulation.campaign import over_seeds
from steerway.studies.estimator_limits.bound import filtering_bound, smoothing_bound
from steerway.studies.estimator_limits.cells import (
    CELLS,
    EARLIER,
    WHAT,
    WHERE,
    WORDS,
    bounded,
    consistency,
    judged,
)
from steerway.studies.estimator_limits.statistics import Interval, over_runs
from steerway.studies.study import Results

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
TUNED_RUNS = 30
"""Tuning takes longer than all the rest."""
NIS_BAND = (1.9, 2.1)
NEES_TURN = 1.5
MANNERS = {"": "true parameters", "tuned_": "tuned from one earlier voyage", "default_": "as it comes"}
KINDS = ("", "smoothed_", "tuned_", "default_", "default_smoothed_")


def measure(name: str, seed: int, tuned: bool = True) -> dict[str, np.ndarray]:
    """One voyage of a cell: sums of squared errors by kind of estimate, of the bounds, of NIS and NEES."""
    cell = CELLS[name]
    voyage, fixes = cell.sailed(seed)
    profiles = {"": cell.profile, "default_": choose_profile(fixes)}
    if tuned:
        _, earlier = cell.sailed(EARLIER + seed)
        profiles["tuned_"] = tune(earlier).profile
    found = {
        "bound": bounded(filtering_bound(voyage, cell.profile), voyage, cell.scenario),
        "smoothing_bound": bounded(smoothing_bound(voyage, cell.profile), voyage, cell.scenario),
    }
    for kind in KINDS:
        if kind.startswith("tuned_") and not tuned:
            continue
        profile = profiles[kind.removesuffix("smoothed_")]
        motion = steerway.estimate(fixes, profile, smooth=kind.endswith("smoothed_"))
        found[kind] = judged(motion, voyage, cell.scenario)
        if not kind.endswith("smoothed_"):
            settled = (voyage.time >= cell.scenario.settling) & np.isfinite(motion.nis)
            found[f"{kind}nis"] = np.array([motion.nis[settled].sum(), settled.sum()])
    _, found["nees"] = consistency(voyage, fixes, cell.profile, cell.scenario)
    return found


def measured(seeds, first_seed, progress) -> dict[str, dict[str, np.ndarray]]:
    """Cell → kind → sums, a row a run."""
    cases = [
        (name, first_seed + k, k < TUNED_RUNS)
        for name, cell in CELLS.items()
        for k in range(seeds or cell.scenario.runs)
    ]
    runs = over_seeds(partial(_nth, cases), range(len(cases)), progress=progress)
    found = {}
    for name in CELLS:
        of_cell = [run for (cell, _, _), run in zip(cases, runs, strict=True) if cell == name]
        found[name] = {kind: np.array([run[kind] for run in of_cell if kind in run]) for kind in of_cell[0]}
    return found


def _nth(cases, index):
    return measure(*cases[index])


def ratio(sums, kind, bound, what, where) -> Interval:
    """Error over bound in one cell, one quantity, straight or in turns."""
    i, k = WHAT.index(what), WHERE.index(where)
    return over_runs(sums[kind][:, k, i], sums[bound][: len(sums[kind]), k, i])


def report(results: Results, found) -> None:
    """All of it into the results."""
    for name, sums in found.items():
        _bounds(results, name, sums)
    for kind in ("", "tuned_", "default_", "smoothed_", "default_smoothed_"):
        for name, sums in found.items():
            _ratios(results, name, sums, kind)
    for name, sums in found.items():
        _consistency(results, name, sums)


def _bounds(results, name, sums):
    for k, where in enumerate(WHERE):
        for i, what in enumerate(WHAT):
            value, low, high = over_runs(sums["bound"][:, k, i], sums["bound"][:, k, 3])
            scale = 1.0 if what == "sog" else math.degrees(1.0)
            published = PUBLISHED[name][k][i]
            results.compare(
                f"{name}_{what}_{where}_bound_{UNITS[what]}",
                value * scale,
                f"{WORDS[name]}: bound of {_quantity(what)}, {_place(where)}",
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
    words = MANNERS[kind.removesuffix("smoothed_")] + (", smoothed" if smoothed else "")
    for what in WHAT:
        for where in WHERE:
            value = ratio(sums, kind, "smoothing_bound" if smoothed else "bound", what, where)
            aim = target(name, kind, what, where)
            results.compare(
                f"{kind}{name}_{what}_{where}_ratio",
                value.value,
                f"{WORDS[name]}, {words}: {_quantity(what)} over its bound, {_place(where)}",
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
    for kind in MANNERS:
        nis = over_runs(sums[f"{kind}nis"][:, 0], sums[f"{kind}nis"][:, 1], root=False)
        held = NIS_BAND[0] <= nis.value <= NIS_BAND[1]
        results.compare(
            f"{kind}{name}_nis",
            nis.value,
            f"{WORDS[name]}, {MANNERS[kind]}: mean NIS",
            "",
            "2",
            "1.9 to 2.1" if kind == "" else "",
            held if kind == "" else None,
            nis[1:],
        )
    nees = sums["nees"]
    for k, where in enumerate((*WHERE, "all")):
        runs = nees[:, k]
        value = over_runs(runs[:, 0], runs[:, 1], root=False)
        band = value.low <= 3.0 <= value.high
        target, met = ("3 in its 95 % interval", band) if where != "turn" else ("≤ 4.5", value.value <= 3.0 * NEES_TURN)
        words = {"straight": "straight", "turn": "in turns", "all": "all along"}[where]
        results.compare(
            f"{name}_nees_{where}",
            value.value,
            f"{WORDS[name]}, true parameters: mean NEES of (U, χ, ω), {words}",
            "",
            "3",
            target,
            met,
            value[1:],
        )


def _quantity(what):
    return {"sog": "SOG", "cog": "COG", "rate": "course rate"}[what]


def _unit(what):
    return {"sog": "m/s", "cog": "°", "rate": "°/s"}[what]


def _place(where):
    return {"straight": "straight", "turn": "in turns"}[where]
