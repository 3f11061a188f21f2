"""estimator-limits: errors against the Cramér–Rao bound in four cells, with true and with inferred parameters.

The bound assumes that the beginning and end of every turn are known. Two vessels, a small craft (O, 1.3 m/s) and a
ship (M, 7.7 m/s), with two receivers; causal and smoothed; consistency of NIS and coverage of the 95 % intervals.
"""

import math
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

import steerway
from steerway.core import NORMAL_95, Fixes, wrap_array
from steerway.estimation import choose_profile
from steerway.sensors import white
from steerway_studies.estimator_limits.bound import (
    FAST,
    SLOW,
    LimitsScenario,
    TrueMotion,
    filtering_bound,
    sail,
    smoothing_bound,
    straight_and_turning,
)
from steerway_studies.study import Results, Study, over_cases, stage

WHAT = {"sog": ("SOG", "m/s", "mps"), "cog": ("COG", "°", "deg"), "rate": ("course rate", "°/s", "dps")}
WHERE = {"straight": "straight", "turn": "in turns"}
PLACES = WHERE | {"all": "all along"}


@dataclass(frozen=True)
class Cell:
    """A vessel and a receiver, with the known parameters of both."""

    scenario: LimitsScenario
    position_std: float
    words: str

    @property
    def profile(self):
        return self.scenario.known(self.position_std)

    def sailed(self, seed: int) -> tuple[TrueMotion, Fixes]:
        """One voyage and its fixes."""
        voyage = sail(self.scenario, seed)
        return voyage, voyage.fixes(white(self.position_std, self.scenario.rate), seed)


CELLS = {
    "o05": Cell(SLOW, 0.5, "O, 0.5 m"),
    "o25": Cell(SLOW, 2.5, "O, 2.5 m"),
    "m05": Cell(FAST, 0.5, "M, 0.5 m"),
    "m25": Cell(FAST, 2.5, "M, 2.5 m"),
}
BOUNDS = {
    "o05": ((0.0257, 0.61, 0.128), (0.0261, 8.92, 5.96)),
    "o25": ((0.0388, 1.47, 0.128), (0.0399, 16.9, 6.66)),
    "m05": ((0.0109, 0.137, 0.0155), (0.109, 0.727, 0.247)),
    "m25": ((0.0163, 0.268, 0.0171), (0.164, 1.58, 0.310)),
}
"""The bound computed by an independent prototype: SOG m/s, COG °, rate °/s, straight and in turns."""
SMOOTHED_BOUNDS = {"o05": 0.49, "o25": 0.43, "m05": 0.29, "m25": 0.33}
"""Ratio of the smoothing bound to the filtering bound of COG on straight legs, by the same prototype."""
SLOW_TARGETS = {"sog": (1.10, 1.20), "cog": (3.3, 1.25), "rate": (2.6, 1.15)}
FAST_TARGETS = {"": 1.15, "default_": 1.6}
SMOOTHED_TARGET = 1.1
KINDS = {
    "": "true parameters",
    "default_": "inferred parameters",
    "smoothed_": "true parameters, smoothed",
    "default_smoothed_": "inferred parameters, smoothed",
}
INFERRED = 8
"""Number of runs of a cell, the first ones, with inferred parameters: an inference takes as long as a hundred runs."""


class Interval(NamedTuple):
    """A number and its 95 % interval over the runs."""

    value: float
    low: float
    high: float


def over_runs(over, under, root=True) -> Interval:
    """√(Σ over / Σ under) of the runs (n,), or the ratio without the root. Its interval is from resampled runs."""
    over, under = np.asarray(over, float), np.asarray(under, float)
    chosen = np.random.default_rng(0).integers(0, len(over), (2000, len(over)))
    with np.errstate(invalid="ignore", divide="ignore"):
        value = over.sum() / under.sum()
        again = over[chosen].sum(axis=1) / under[chosen].sum(axis=1)
    if root:
        value, again = math.sqrt(value), np.sqrt(again)
    low, high = np.nanpercentile(again, [2.5, 97.5]) if np.isfinite(again).any() else (math.nan, math.nan)
    return Interval(float(value), float(low), float(high))


def errors(sog, cog, course_rate, voyage) -> np.ndarray:
    """(3, n) errors of SOG, COG and course rate (n,)."""
    return np.stack([sog - voyage.sog, wrap_array(cog - voyage.cog), course_rate - voyage.course_rate])


def sums(squares, masks) -> np.ndarray:
    """(2, 5): for straight rows and rows in turns the sums of three squares (3, n), rows with and without a course."""
    found = np.empty((2, 5))
    for k, mask in enumerate(masks):
        chosen = squares[:, mask]
        known = np.isfinite(chosen[1])
        found[k, :3] = chosen[:, known].sum(axis=1)
        found[k, 3:] = known.sum(), (~known).sum()
    return found


def judged(motion, voyage, scenario) -> np.ndarray:
    """`sums` of the errors of an estimate."""
    squares = np.square(errors(motion.sog, motion.cog, motion.course_rate, voyage))
    squares[:, ~np.isfinite(squares[1])] = np.nan
    return sums(squares, straight_and_turning(scenario, voyage))


def bounded(covariance, voyage, scenario) -> np.ndarray:
    """`sums` of a bound (n, 5, 5)."""
    return sums(np.diagonal(covariance, axis1=1, axis2=2)[:, 2:].T, straight_and_turning(scenario, voyage))


def covered(motion, voyage, scenario) -> np.ndarray:
    """(3, 4) for each of PLACES: rows with the truth in the 95 % interval of SOG, COG and course rate, and all rows."""
    error = np.abs(errors(motion.sog, motion.cog, motion.course_rate, voyage))
    held = error < NORMAL_95 * np.stack([motion.sog_std, motion.cog_std, motion.course_rate_std])
    straight, turning = straight_and_turning(scenario, voyage)
    masks = [np.isfinite(motion.cog) & rows for rows in (straight, turning, voyage.time >= scenario.settling)]
    return np.array([[*held[:, mask].sum(axis=1), mask.sum()] for mask in masks])


def measure(inferred_below: int, case) -> dict[str, np.ndarray]:
    """One run of a cell: sums of squared errors by kind of estimate, of the bounds and of NIS; rows covered."""
    name, seed = case
    cell = CELLS[name]
    voyage, fixes = cell.sailed(seed)
    found = {
        "bound": bounded(filtering_bound(voyage, cell.profile), voyage, cell.scenario),
        "smoothing_bound": bounded(smoothing_bound(voyage, cell.profile), voyage, cell.scenario),
    }
    inferred = choose_profile(fixes) if seed < inferred_below else None
    for kind in KINDS:
        profile = inferred if kind.startswith("default_") else cell.profile
        if profile is None:
            continue
        motion = steerway.estimate(fixes, profile, smooth=kind.endswith("smoothed_"))
        found[kind] = judged(motion, voyage, cell.scenario)
        found[f"{kind}covered"] = covered(motion, voyage, cell.scenario)
        if not kind.endswith("smoothed_"):
            settled = (voyage.time >= cell.scenario.settling) & np.isfinite(motion.nis)
            found[f"{kind}nis"] = np.array([motion.nis[settled].sum(), settled.sum()])
    return found


def run(seeds=None, first_seed=0, progress=None) -> Results:
    """See Study; `seeds` runs per cell, by default 30 (60 in O), of which `INFERRED` with inferred parameters."""
    results = Results("The estimator at its limit", lead=LEAD)
    cases = [(name, first_seed + k) for name, cell in CELLS.items() for k in range(seeds or cell.scenario.runs)]
    step = stage(progress, 0.0, 1.0, "error against the bound")
    measured = over_cases(partial(measure, first_seed + INFERRED), cases, progress=step)
    found = {}
    for name in CELLS:
        runs = [run for (cell, _), run in zip(cases, measured, strict=True) if cell == name]
        found[name] = {kind: np.array([run[kind] for run in runs if kind in run]) for kind in runs[0]}
    for name, of_cell in found.items():
        _bounds(results, name, of_cell)
    for kind in KINDS:
        results.section = f"Error over the bound, {KINDS[kind]}"
        for name, of_cell in found.items():
            _ratios(results, name, of_cell, kind)
    _consistency(results, found)
    return results


def _bounds(results, name, of_cell):
    results.section = "The bound"
    cell = CELLS[name]
    for k, (where, place) in enumerate(WHERE.items()):
        for i, (what, (quantity, unit, suffix)) in enumerate(WHAT.items()):
            scale = 1.0 if what == "sog" else math.degrees(1.0)
            found = over_runs(of_cell["bound"][:, k, i], of_cell["bound"][:, k, 3])
            value, low, high = (scale * each for each in found)
            expected = BOUNDS[name][k][i]
            results.compare(
                f"{name}_{what}_{where}_bound_{suffix}",
                value,
                f"{cell.words}: bound of {quantity}, {place}",
                unit,
                f"{expected:g}",
                "within 2 %",
                abs(value / expected - 1.0) <= 0.02,
                (low, high),
            )
    found = over_runs(of_cell["smoothing_bound"][:, 0, 1], of_cell["bound"][:, 0, 1])
    what = f"{cell.words}: smoothing bound over filtering bound, COG, straight"
    key = f"{name}_cog_straight_smoothing_share"
    results.compare(key, found.value, what, "", f"{SMOOTHED_BOUNDS[name]:g}", interval=found[1:])


def _ratios(results, name, of_cell, kind):
    bound = "smoothing_bound" if kind.endswith("smoothed_") else "bound"
    for i, (what, (quantity, *_)) in enumerate(WHAT.items()):
        for k, (where, place) in enumerate(WHERE.items()):
            runs = of_cell[kind][:, k, i]
            found = over_runs(runs, of_cell[bound][: len(runs), k, i])
            aim = target(name, kind, what, k)
            results.compare(
                f"{kind}{name}_{what}_{where}_ratio",
                found.value,
                f"{CELLS[name].words}, {KINDS[kind]}: {quantity} over its bound, {place}",
                "",
                "",
                f"≤ {aim:g}" if aim else "",
                found.value <= aim if aim else None,
                found[1:],
            )
    undefined = of_cell[kind][:, :, 4].sum() / of_cell[kind][:, :, 3:].sum()
    results.numbers[f"{kind}{name}_undefined_pct"] = 100.0 * float(undefined)


def target(name, kind, what, k) -> float | None:
    """The target of an error over its bound; None without a target."""
    if kind == "smoothed_":
        return SMOOTHED_TARGET
    if name.startswith("m"):
        return FAST_TARGETS.get(kind)
    return SLOW_TARGETS[what][k] if kind == "" else None


def _consistency(results, found):
    """NIS, and the share of rows with the truth in the 95 % interval."""
    results.section = "Consistency"
    rows = []
    for kind, words in KINDS.items():
        for name, of_cell in found.items():
            if f"{kind}nis" in of_cell:
                nis = over_runs(of_cell[f"{kind}nis"][:, 0], of_cell[f"{kind}nis"][:, 1], root=False)
                aim = ("1.9 to 2.1", 1.9 <= nis.value <= 2.1) if kind == "" else ("", None)
                what = f"{CELLS[name].words}, {words}: mean NIS"
                results.compare(f"{kind}{name}_nis", nis.value, what, "", "2", *aim, nis[1:])
            runs = of_cell[f"{kind}covered"]
            shares = 100.0 * runs[..., :3].sum(axis=0) / runs[..., 3:].sum(axis=0)
            for k, where in enumerate(PLACES):
                for i, what in enumerate(WHAT):
                    results.numbers[f"{kind}{name}_{what}_{where}_coverage_pct"] = float(shares[k, i])
            cells = [" / ".join(f"{share:.1f}" for share in shares[:, i]) for i in range(len(WHAT))]
            rows.append((words, CELLS[name].words, *cells))
    heading = "Rows with the truth in the 95 % interval of the estimate (%): straight / in turns / all along"
    names = [quantity for quantity, *_ in WHAT.values()]
    results.tables.append((heading, ("parameters", "vessel and receiver", *names), rows))


LEAD = (
    "A small craft (O, 1.3 m/s) and a ship (M, 7.7 m/s) alternate straight legs and turns by the filter's own model, "
    "with fixes of 0.5 and 2.5 m at 5 Hz. Errors are RMS over many runs. Most rows give them as a ratio to the "
    "Cramér–Rao bound, which assumes that the beginning and end of every turn are known; in brackets are 95 % "
    "intervals over the runs."
)
STUDY = Study("estimator-limits", "error against the Cramér–Rao bound, causal and smoothed, and consistency", run)
