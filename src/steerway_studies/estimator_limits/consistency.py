"""Consistency of an estimate: NIS, NEES of (U, χ, ω), and how often the truth lies in its 95 % intervals."""

import numpy as np

from steerway.core import NORMAL_95, Fixes
from steerway.estimation import FiveStateFilter
from steerway_studies.estimator_limits.cells import PLACES, WHAT
from steerway_studies.estimator_limits.scenarios import LimitsScenario, TrueMotion, straight_and_turning
from steerway_studies.estimator_limits.statistics import errors, over_runs
from steerway_studies.study import Results

STATES = 3
NEES_TURN = 1.5
"""Times its expectation that NEES may be in turns."""


def scores(voyage: TrueMotion, fixes: Fixes, profile, scenario) -> tuple[np.ndarray, np.ndarray]:
    """Sum and rows (2,) of the NIS of fixes, and (3, 2) of the NEES of (U, χ, ω): straight, in turns, all along."""
    estimator = FiveStateFilter(profile)
    states, spreads = np.full((len(fixes), STATES), np.nan), np.zeros((len(fixes), STATES, STATES))
    spreads[:] = np.eye(STATES)
    nis = np.full(len(fixes), np.nan)
    for k in range(len(fixes)):
        if k:
            estimator.predict(fixes.time[k] - fixes.time[k - 1])
        nis[k] = estimator.update(fixes.latitude[k], fixes.longitude[k])
        if estimator.underway:
            states[k], spreads[k] = estimator.state[2:5], estimator.covariance[2:5, 2:5]
    counted = (voyage.time >= scenario.settling) & np.isfinite(nis)
    return np.array([nis[counted].sum(), counted.sum()]), nees(errors(*states.T, voyage), spreads, voyage, scenario)


def nees(error, covariance, voyage, scenario) -> np.ndarray:
    """(3, 2) sum and rows of the NEES of errors (3, n): straight, in turns, all along; NaN is no course."""
    squares = np.einsum("ik,kij,jk->k", error, np.linalg.inv(covariance), error)
    return np.array([[squares[mask].sum(), mask.sum()] for mask in _places(np.isfinite(squares), voyage, scenario)])


def covered(motion, voyage, scenario) -> np.ndarray:
    """(3, 4) rows with the truth in the 95 % interval of SOG, COG and course rate, and rows: the same places."""
    error = np.abs(errors(motion.sog, motion.cog, motion.course_rate, voyage))
    held = error < NORMAL_95 * np.stack([motion.sog_std, motion.cog_std, motion.course_rate_std])
    masks = _places(np.isfinite(motion.cog), voyage, scenario)
    return np.array([[*held[:, mask].sum(axis=1), mask.sum()] for mask in masks])


def _places(known, voyage: TrueMotion, scenario: LimitsScenario):
    straight, turning = straight_and_turning(scenario, voyage)
    return [known & rows for rows in (straight, turning, voyage.time >= scenario.settling)]


def report_nees(results: Results, key: str, who: str, runs, judged: bool) -> None:
    """NEES of `runs` (runs, 3, 2) by place, against its targets if it is `judged`."""
    for k, (where, place) in enumerate(PLACES.items()):
        value = over_runs(runs[:, k, 0], runs[:, k, 1], root=False)
        target, met = f"{STATES} in its 95 % interval", value.low <= STATES <= value.high
        if where == "turn":
            target, met = f"≤ {NEES_TURN * STATES:g}", value.value <= NEES_TURN * STATES
        results.compare(
            f"{key}_nees_{where}",
            value.value,
            f"{who}: mean NEES of (U, χ, ω), {place}",
            "",
            f"{STATES}",
            target if judged else "",
            met if judged else None,
            value[1:],
        )


def coverage_row(results: Results, key: str, runs) -> list[str]:
    """Numbers, and the texts of a table's row, of `runs` (runs, 3, 4) of `covered`: SOG, COG, rate, place by place."""
    shares = 100.0 * runs[..., :3].sum(axis=0) / runs[..., 3:].sum(axis=0)
    for k, where in enumerate(PLACES):
        for i, what in enumerate(WHAT):
            results.numbers[f"{key}_{what}_{where}_coverage_pct"] = float(shares[k, i])
    return [" / ".join(f"{share:.1f}" for share in shares[:, i]) for i in range(len(WHAT))]
