"""at-sea: the autopilot in currents up to 80 % of the boat's speed: squares and surveys, three boats, 18 receivers.

Each seed draws a balanced part of the grid: every direction of the current with the Otter and the motorboat; currents,
routes and receivers evenly mixed. Boats start from rest, without a compass. `own_gate_stops` counts the runs in which
fixes were rejected for so long that the autopilot aboard would have stopped.
"""

import math
from functools import partial

import numpy as np

from steerway.core import rms
from steerway.report import PALETTE, Curve, Panel, series
from steerway_studies.at_sea.sailing import (
    CRAFT,
    SHARES,
    SHIP_LENGTH,
    JudgedRun,
    all_cases,
    drawn,
    judged,
)
from steerway_studies.study import Quantity, Results, Study, over_cases, seeds_from, stage

SEEDS = 8
SMALL = ("otter", "motorboat")


def run(seeds=None, first_seed=0, progress=None, full=False) -> Results:
    """See Study. Runs `seeds` parts of the grid (8 by default), or with `full` the whole grid for every seed."""
    chosen = seeds_from(first_seed, seeds, SEEDS)
    pairs = [(case, seed) for seed in chosen for case in (all_cases() if full else drawn(seed))]
    found = over_cases(_judged_of, pairs, progress=stage(progress, 0.0, 1.0, "squares and surveys"))
    results = Results("The autopilot in currents up to 80 % of the boat's speed")
    results.add(numbers_of(found), QUANTITIES)
    results.figures["distances"] = _by_current(found)
    results.remarks.append(REMARK.format(len(found)))
    return results


def _judged_of(pair):
    return judged(*pair)


def _pooled(runs: list[JudgedRun]) -> float:
    """Root mean square of the runs' distances, m; NaN if a run has no distance."""
    legs = np.array([each.legs for each in runs])
    return rms(legs) if np.isfinite(legs).all() else math.nan


def numbers_of(found: list[JudgedRun]) -> dict[str, float]:
    """Numbers of the runs that were simulated: routes finished, distances from the legs and at the corners."""
    refused, found = sum(each.refused for each in found), [each for each in found if not each.refused]
    n = {
        "refused": refused,
        "finished_pct_50": 100.0 * float(np.mean([each.finished for each in found if each.case.share in SHARES[:3]])),
        "finished_pct_80": 100.0 * float(np.mean([each.finished for each in found if each.case.share in SHARES[3:]])),
        "own_gate_stops": sum(each.own_stop for each in found),
    }
    usual = [each for each in found if each.case.share <= 0.5]
    small = [each for each in usual if each.case.craft in SMALL]
    for words, velocity in (("velocity", True), ("positions", False)):
        of_kind = [each for each in small if each.case.receiver.velocity is velocity]
        slow = [each for each in of_kind if each.case.receiver.errors == "wandering"]
        steady = [each for each in of_kind if each not in slow and each.case.receiver.rate >= 5.0]
        n[f"leg_rms_wandering_{words}_m"], n[f"leg_rms_{words}_m"] = _pooled(slow), _pooled(steady)
        for craft in SMALL:
            for errors in ("rtk", "white"):
                part = [each for each in steady if (each.case.craft, each.case.receiver.errors) == (craft, errors)]
                n[f"leg_rms_{words}_{craft}_{errors}_m"] = _pooled(part)
    ships = [each for each in usual if each.case.craft == "mariner"]
    n["mariner_leg_rms_lengths"] = _pooled(ships) / SHIP_LENGTH
    every = [each.legs / SHIP_LENGTH for each in found if each.case.craft == "mariner"]
    n["mariner_legs_mean"], n["mariner_legs_most"] = (float(np.mean(every)), max(every)) if every else (math.nan,) * 2
    for craft in CRAFT:
        corners = [each.corners for each in usual if each.case.craft == craft]
        n[f"corner_radii_{craft}"] = float(np.nanmax(corners)) if corners else math.nan
    return n


QUANTITIES = [
    Quantity("refused", "runs refused before sailing: a leg shorter than its turns", ""),
    Quantity("finished_pct_50", "routes finished, currents up to 50 %", "%", "", "≥ 99.5"),
    Quantity("finished_pct_80", "routes finished, currents of 80 %", "%", "", "≥ 97"),
    Quantity("own_gate_stops", "runs that the autopilot aboard would have stopped by its own gate", "", "", "0"),
    *(
        quantity
        for words, what, most in (("velocity", "with velocity", "≤ 0.3"), ("positions", "positions only", "≤ 0.8"))
        for quantity in (
            Quantity(f"leg_rms_{words}_m", f"RMS distance, {what}, ≥ 5 Hz, currents ≤ 50 %", "m", "", most),
            *(
                Quantity(f"leg_rms_{words}_{craft}_{errors}_m", f"the same, {craft}, {errors}", "m")
                for craft in SMALL
                for errors in ("rtk", "white")
            ),
            Quantity(f"leg_rms_wandering_{words}_m", f"wandering receiver, relative to its slow error, {what}", "m"),
        )
    ),
    Quantity("mariner_leg_rms_lengths", "Mariner, RMS distance in ship lengths, currents ≤ 50 %", "", "", "≤ 0.1"),
    Quantity("mariner_legs_mean", "the same in all currents, mean of the runs", "", "", "≤ 0.1"),
    Quantity("mariner_legs_most", "the same in all currents, largest run", "", "", "≤ 0.5"),
    *(
        Quantity(f"corner_radii_{craft}", f"{craft}: largest distance at corners, in turn radii", "", "", "≤ 1.5")
        for craft in CRAFT
    ),
]
REMARK = (
    "{} runs. Legs count from 20 s after a turn begins (the ship: 600 s), the first leg from twice this time. The "
    "boat's speed is that of its route: the Otter 1.2 m/s, the motorboat 2 m/s (its top speed), the Mariner 15 knots. "
    "The turn radius is over ground with the current, (U + V)/ω for the largest ordered rate ω. "
    "Positions are 0.2 s late, and the filter is given this latency."
)


def _by_current(found):
    panels = []
    for craft in CRAFT:
        curves = []
        for errors, colour in zip(("rtk", "white", "wandering"), PALETTE, strict=False):
            runs = [each for each in found if (each.case.craft, each.case.receiver.errors) == (craft, errors)]
            shares = [100.0 * each.case.share for each in runs]
            curves.append(Curve(shares, [each.legs for each in runs], errors, colour, "."))
        panels.append(Panel("RMS distance (m)", curves, craft, log=True))
    caption = "RMS distance from the legs of every run, against the current in shares of the boat's speed."
    return series(panels, "current (% of the boat's speed)", columns=len(CRAFT)), caption


STUDY = Study(
    "at-sea",
    "squares and surveys in currents up to 80 % of the boat's speed, from rest, no compass",
    run,
    run_full=partial(run, full=True),
)
