"""What instruments add in scenario O with fixes of 0.5 m: Doppler velocity, a yaw gyro with a bias, both."""

import math

import numpy as np

import steerway
from steerway.core import Fixes
from steerway.estimation import FiveStateFilter
from steerway.sensors import Gnss, Instrument
from steerway_studies.estimator_limits.cells import CELLS, PLACES, WHERE, judged
from steerway_studies.estimator_limits.scenarios import sail
from steerway_studies.estimator_limits.statistics import over_runs
from steerway_studies.parts import over_cases
from steerway_studies.study import Results, seeds_from

SEEDS = 8  # of several inferences each
CELL = CELLS["o05"]
VELOCITY_STD = 0.05
GYRO_STD, GYRO_BIAS = math.radians(0.1), math.radians(0.3)
FOUND = 0.2
"""Part of the bias by which what is found of it may err."""
AIDS = {"doppler": ("sog", "cog"), "gyro": ("yaw_rate",), "both": ("sog", "cog", "yaw_rate")}
TARGETS = {"gyro": (0.6, 1.05), "doppler": (1.4, 1.9), "both": (0.45, 0.7)}
PUBLISHED = {"gyro": ("0.52", "0.90"), "doppler": ("1.2", "1.6"), "both": ("0.37", "0.56")}
BIAS_TARGET = 60.0
PROFILE = CELL.profile.model_copy(
    update={
        "sog_std": VELOCITY_STD,
        "velocity_std": VELOCITY_STD,
        "yaw_rate_std": GYRO_STD,
        "gyro_bias_std": GYRO_BIAS,
        "gyro_bias_time": 10_000.0,
    }
)
VARIANTS = {"": PROFILE, "default_": None}
"""Prefix of the key → profile."""


def aided_fixes(voyage, seed: int, bias: float = GYRO_BIAS) -> Fixes:
    """Fixes with the receiver's own velocity and a gyro's rate beside them."""
    gnss = Gnss(rate=CELL.scenario.rate, white=CELL.position_std, velocity_std=VELOCITY_STD)
    velocity = {"north_velocity": voyage.sog * np.cos(voyage.cog), "east_velocity": voyage.sog * np.sin(voyage.cog)}
    fixes = gnss.fixes(voyage.time, voyage.north, voyage.east, seed, **velocity)
    gyro = Instrument(rate=CELL.scenario.rate, white=GYRO_STD, bias=bias)
    _, rate = gyro.measured(voyage.time, voyage.course_rate, [seed, 3])
    return Fixes(fixes.time, fixes.latitude, fixes.longitude, sog=fixes.sog, cog=fixes.cog, yaw_rate=rate)


def one(seed: int, profiles=VARIANTS) -> dict[str, np.ndarray]:
    """`sums` with each aid and profile, and the history of the error of the gyro's bias as found."""
    voyage = sail(CELL.scenario, seed)
    found = {}
    bias = GYRO_BIAS if seed % 2 else -GYRO_BIAS
    fixes = aided_fixes(voyage, seed, bias)
    for name, aid in AIDS.items():
        for variant, profile in profiles.items():
            motion = steerway.estimate(fixes, profile, aid=aid)
            found[variant + name] = judged(motion, voyage, CELL.scenario)
    found["bias"] = bias_found(fixes) - bias
    return found


def bias_found(fixes: Fixes) -> np.ndarray:
    """(n,) the bias of the gyro as the filter has it after each row, rad/s."""
    estimator = FiveStateFilter(PROFILE, AIDS["gyro"])
    bias = np.empty(len(fixes))
    for k in range(len(fixes)):
        if k:
            estimator.predict(fixes.time[k] - fixes.time[k - 1])
        estimator.update(fixes.latitude[k], fixes.longitude[k])
        estimator.aid_by(yaw_rate=fixes.yaw_rate[k])
        bias[k] = estimator.gyro_bias
    return bias


def measured(seeds, first_seed, progress) -> dict[str, np.ndarray]:
    """Kind → sums or histories, a row a run."""
    runs = over_cases(one, seeds_from(first_seed, seeds, SEEDS), progress=progress)
    return {key: np.array([run[key] for run in runs]) for key in runs[0]}


def found_after(errors, limit) -> float:
    """s from which on the RMS over runs of an error (runs, n) stays below the limit; NaN if it never does."""
    above = np.flatnonzero(np.sqrt(np.mean(errors**2, axis=0)) > limit)
    first = 0 if len(above) == 0 else above[-1] + 1
    return first / CELL.scenario.rate if first < errors.shape[1] else math.nan


def report(results: Results, found) -> None:
    """COG by aid, and when the bias is found."""
    results.section = "Aiding"
    for variant, who in (("", "true parameters"), ("default_", "as it comes")):
        for name in AIDS:
            runs = found[variant + name]
            for k, where in enumerate(WHERE):
                value, low, high = np.degrees(over_runs(runs[:, k, 1], runs[:, k, 3]))
                target = TARGETS[name][k]
                results.compare(
                    f"{variant}aided_{name}_cog_{where}_deg",
                    value,
                    f"O, 0.5 m, {who}, aided by {_WORDS[name]}: RMS of COG, {PLACES[where]}",
                    "°",
                    "" if variant else PUBLISHED[name][k],
                    f"≤ {target:g}",
                    value <= target,
                    (low, high),
                )
    chosen = np.random.default_rng(0).integers(0, len(found["bias"]), (200, len(found["bias"])))
    again = [found_after(found["bias"][rows], FOUND * GYRO_BIAS) for rows in chosen]
    value = found_after(found["bias"], FOUND * GYRO_BIAS)
    results.compare(
        "gyro_bias_found_s",
        value,
        "a gyro's bias of 0.3 °/s: known to a fifth (RMS over the runs) from",
        "s",
        "",
        f"≤ {BIAS_TARGET:g}",
        value <= BIAS_TARGET,
        np.nanpercentile(again, [2.5, 97.5]),
    )


_WORDS = {"doppler": "the receiver's Doppler velocity", "gyro": "a yaw gyro", "both": "both"}
