"""Receivers whose error wanders: P1's ship with its printed noise, and a small boat with a low-cost one.

The ship sails P1's route on true states, so that every receiver and filter sees the same voyage. The filter knows
what the receiver errs by; its motion model is that of scenario M.
"""

import math
from functools import cache

import numpy as np

import steerway
from steerway.core import markov_std
from steerway.sensors import low_cost
from steerway_studies.estimator_limits.cells import PLACES, WHERE, sums
from steerway_studies.estimator_limits.particles import in_plane
from steerway_studies.estimator_limits.scenarios import (
    FAST,
    SLOW,
    LimitsScenario,
    TrueMotion,
    sail,
    straight_and_turning,
)
from steerway_studies.estimator_limits.statistics import error_squares, errors, over_runs
from steerway_studies.mariner_los.ship import (
    CORRELATION_TIME,
    PRINTED_NOISE,
    STATED_NOISE,
    STEP,
    ShipCase,
    receiver,
    voyage,
)
from steerway_studies.papers.ekf_5states import ekf_5states
from steerway_studies.parts import over_cases
from steerway_studies.study import Results, seeds_from

SEEDS = 8  # of several inferences each
NOISES = {"printed_noise": PRINTED_NOISE, "stated_noise": STATED_NOISE}
HELD_RATE = math.radians(1.0) / 60.0
"""A course that changes by less than 1° a minute is held."""
OTHER_LIMITS = (1.2, 3.0, 6.0, 12.0)
"""° a minute: the error depends on what counts as a straight leg."""
VARIANTS = ("", "default_")
"""Prefixes of keys: with the known parameters, and as it comes."""
SETTLED = 100.0
WHITE = 0.005
"""m: P1's receiver has no white noise at all."""
SMALL_BOAT = LimitsScenario(
    profile=SLOW.profile, speed=1.0, duration=SLOW.duration, runs=SEEDS, recovery=SLOW.recovery, settling=SLOW.settling
)


def ship_profile(noise: float):
    """The motion of scenario M and P1's receiver with this driving noise (m a step)."""
    slow = {"error_std": markov_std(noise, CORRELATION_TIME, STEP), "error_time": CORRELATION_TIME}
    return FAST.profile.model_copy(update={"name": "mariner", "position_std": WHITE, **slow})


def boat_profile():
    """The motion of scenario O and a receiver like a low-cost one."""
    (drift_std, drift_time), (error_std, error_time) = low_cost().markov
    errors = {"error_std": error_std, "error_time": error_time, "drift_std": drift_std, "drift_time": drift_time}
    return SLOW.profile.model_copy(update={"position_std": low_cost().white, **errors})


@cache
def ship() -> TrueMotion:
    """P1's ship on its route, on true states; `turning` where the course is not held."""
    run, _ = voyage(ShipCase("truth"))
    rate = run["true_course_rate"]
    place = run["true_north"], run["true_east"]
    return TrueMotion(run.time, *place, run.true_sog, run.true_cog, rate, np.abs(rate) > HELD_RATE)


def one(seed: int, variants=VARIANTS) -> dict[str, np.ndarray]:
    """`sums` and NIS of one seed of every receiver, filter and variant."""
    found = {}
    truth = ship()
    settled = truth.time > SETTLED
    masks = settled & ~truth.turning, settled & truth.turning
    for label, noise in NOISES.items():
        fixes = receiver(noise).fixes(truth.time, truth.north, truth.east, seed)
        found[f"printed_filter_mariner_{label}"] = sums(printed(fixes, truth), masks)
        for variant, profile in zip(VARIANTS, (ship_profile(noise), None), strict=True):
            if variant not in variants:
                continue
            motion = steerway.estimate(fixes, profile)
            squares = error_squares(motion, truth)
            found[f"{variant}mariner_{label}"] = sums(squares, masks)
            found[f"{variant}mariner_{label}_nis"] = _nis(motion, settled)
            for limit in OTHER_LIMITS:
                holding = np.abs(truth.course_rate) <= math.radians(limit) / 60.0
                found[f"{variant}mariner_{label}_{limit:g}"] = sums(squares, (settled & holding, settled & ~holding))
    boat = sail(SMALL_BOAT, seed)
    fixes = boat.fixes(low_cost(), seed)
    for variant, profile in zip(VARIANTS, (boat_profile(), None), strict=True):
        if variant not in variants:
            continue
        motion = steerway.estimate(fixes, profile)
        found[f"{variant}ublox_like"] = sums(error_squares(motion, boat), straight_and_turning(SMALL_BOAT, boat))
        found[f"{variant}ublox_like_nis"] = _nis(motion, boat.time > SMALL_BOAT.settling)
    return found


def _nis(motion, rows):
    rows = rows & np.isfinite(motion.nis)
    return np.array([motion.nis[rows].sum(), rows.sum()])


def printed(fixes, truth):
    """(3, n) squared errors of the printed filter with P1's tuning, begun at the truth."""
    north, east = in_plane(fixes).T
    start = np.array([north[0], east[0], truth.sog[0], truth.cog[0], 0.0])
    states = ekf_5states(north, east, STEP, 1, "NED", [1e-5, 1e-5], [0.1, 0.1], 1e-5, 0.2, x_init=start)
    return np.square(errors(*states[:, 2:].T, truth))


def measured(seeds, first_seed, progress) -> dict[str, np.ndarray]:
    """Kind → sums, a row a run."""
    runs = over_cases(one, seeds_from(first_seed, seeds, SEEDS), progress=progress)
    return {key: np.array([run[key] for run in runs]) for key in runs[0]}


_TARGETS = {
    "mariner_printed_noise": (0.95, 2.2),
    "mariner_stated_noise": (0.35, 0.9),
    "ublox_like": (4.0, None),
    "printed_filter_mariner_printed_noise": (None, None),
}
_PUBLISHED = {"printed_filter_mariner_printed_noise": ("2.24", "2.65")}
WORDS = {
    "mariner_printed_noise": "MARINER, 0.21 m a step",
    "mariner_stated_noise": "MARINER, 0.0634 m a step",
    "ublox_like": "boat of O at 1 m/s, low-cost receiver",
}
_NIS_BAND = (1.8, 2.1)


def report(results: Results, found) -> None:
    """COG, straight and in turns, and NIS of every receiver and filter."""
    results.section = "Correlated receiver errors"
    for scene, words in WORDS.items():
        for variant, who in (
            ("", "receiver known"),
            ("default_", "as it comes"),
            ("printed_filter_", "printed filter"),
        ):
            key = variant + scene
            if key in found:
                _cog(results, key, f"{words}, {who}", found[key])
        for variant, who in (("", "receiver known"), ("default_", "as it comes")):
            total = found[f"{variant}{scene}_nis"]
            nis = over_runs(total[:, 0], total[:, 1], root=False)
            results.compare(
                f"{variant}{scene}_nis",
                nis.value,
                f"{words}, {who}: mean NIS",
                "",
                "2",
                "1.8 to 2.1",
                _NIS_BAND[0] <= nis.value <= _NIS_BAND[1],
                nis[1:],
            )
    _limits(results, found)


def _limits(results, found):
    """COG of P1's ship, receiver known, were the course held up to another rate of change."""
    rows = []
    for limit in (math.degrees(HELD_RATE) * 60.0, *OTHER_LIMITS):
        row = [f"{limit:g}"]
        for label in NOISES:
            key = f"mariner_{label}" if limit not in OTHER_LIMITS else f"mariner_{label}_{limit:g}"
            values = [np.degrees(over_runs(found[key][:, k, 1], found[key][:, k, 3])[0]) for k in range(len(WHERE))]
            row.append(" / ".join(f"{value:.2f}" for value in values))
        rows.append(row)
    names = ("held below (°/min)", *(WORDS[f"mariner_{label}"] for label in NOISES))
    results.tables.append(
        ("MARINER, receiver known: RMS of COG, straight / in turns, by what counts as held (°)", names, rows)
    )


def _cog(results, key, words, runs):
    for k, where in enumerate(WHERE):
        value, low, high = np.degrees(over_runs(runs[:, k, 1], runs[:, k, 3]))
        target = _TARGETS.get(key.removeprefix("default_"), (None, None))[k]
        results.compare(
            f"{key}_cog_{where}_deg",
            value,
            f"{words}: RMS of COG, {PLACES[where]}",
            "°",
            _PUBLISHED.get(key, ("", ""))[k],
            f"≤ {target:g}" if target else "",
            value <= target if target else None,
            (low, high),
        )
