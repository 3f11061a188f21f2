"""The failure matrix: what becomes of the estimate, as it comes, when a log has troubles; and AIS reports far apart."""

import math
from dataclasses import replace

import numpy as np

import steerway
from steerway.core import rms, wrap_array
from steerway.sensors import Gnss
from steerway_studies.estimator_limits.cells import CELLS
from steerway_studies.estimator_limits.scenarios import FAST, sail
from steerway_studies.estimator_limits.statistics import over_runs
from steerway_studies.estimator_limits.troubles import BEGIN, LASTING, TROUBLES
from steerway_studies.parts import over_cases
from steerway_studies.study import Results, seeds_from

SEEDS = 4  # of several inferences each
AFTER = 30.0
"""s after the trouble from which the error counts as that of the voyage again."""
BACK = math.radians(3.0)
"""By so much the error may exceed that of the same moment in the log without the trouble."""
_LAST, _LOST = 60.0, math.radians(45.0)
INTERVALS = (2.0, 6.0, 10.0, 30.0, 60.0, 120.0, 180.0)
_AIS_NOISE, _AIS_VELOCITY = 5.0, 0.1


def one(seed: int) -> dict[str, np.ndarray]:
    """By trouble (6,): squares after it, their rows, largest error in it, s until back, lost, share without course.

    By AIS interval (2, 3), see `_reported`.
    """
    cell = CELLS["o05"]
    voyage, fixes = cell.sailed(seed)
    calm = steerway.estimate(fixes)
    found = {}
    for number, (name, (trouble, _, over)) in enumerate(TROUBLES.items()):
        truth, reports = trouble(voyage, fixes, np.random.default_rng([seed, number]))
        motion = steerway.estimate(reports)
        shift = truth.time[-1] - voyage.time[-1] if name == "standstill" else 0.0
        since = truth.time - shift
        usual = np.interp(since, calm.time, np.nan_to_num(np.abs(wrap_array(calm.cog - voyage.cog)), nan=math.pi))
        found[name] = _what_happened(motion, truth, over, usual, shift)
    for interval in INTERVALS:
        found[f"ais_{interval:g}"] = _reported(seed, interval)
    return found


def _what_happened(motion, truth, over, usual, at_rest) -> np.ndarray:
    error = wrap_array(motion.cog - truth.cog)
    during = (motion.time >= BEGIN) & (motion.time < over + 10.0)
    squares = error[(motion.time >= over + AFTER) & np.isfinite(error)] ** 2
    largest = np.nanmax(np.abs(error[during]), initial=0.0)
    lost = not rms(error[motion.time > motion.time[-1] - _LAST]) < _LOST
    resting = (motion.time > BEGIN + 0.1 * at_rest) & (motion.time < over)
    undefined = np.mean(np.isnan(motion.cog[resting])) if at_rest else math.nan
    back = _back(motion.time - over, np.abs(error) < usual + BACK)
    return np.array([squares.sum(), len(squares), largest, back, lost, undefined])


def _back(since, near) -> float:
    """s from which on it is near for ten seconds; ∞ for never."""
    for k in np.flatnonzero(near & (since >= 0.0)):
        if near[(since >= since[k]) & (since <= since[k] + 10.0)].all():
            return float(since[k])
    return math.inf


def _reported(seed, interval) -> np.ndarray:
    """(2, 3): squares, rows and lost; from positions alone and with the transmitted SOG and COG."""
    voyage = sail(FAST, seed)
    gnss = Gnss(rate=1.0 / interval, white=_AIS_NOISE, velocity_std=_AIS_VELOCITY)
    velocity = {"north_velocity": voyage.sog * np.cos(voyage.cog), "east_velocity": voyage.sog * np.sin(voyage.cog)}
    reports = gnss.fixes(voyage.time, voyage.north, voyage.east, seed, **velocity)
    reports = replace(reports, mmsi=np.full(len(reports), 211_000_000))
    true = np.interp(reports.time, voyage.time, np.unwrap(voyage.cog))
    found = np.empty((2, 3))
    for k, aid in enumerate(((), ("sog", "cog"))):
        motion = steerway.estimate(reports, aid=aid)
        error = wrap_array(motion.cog - true)[reports.time > FAST.settling]
        known = np.isfinite(error)
        found[k] = np.sum(error[known] ** 2), known.sum(), np.mean(np.abs(error[known]) > math.pi / 2.0) > 0.2
    return found


def measured(seeds, first_seed, progress) -> dict[str, np.ndarray]:
    """Key → (runs, …)."""
    runs = over_cases(one, seeds_from(first_seed, seeds, SEEDS), progress=progress)
    return {key: np.array([run[key] for run in runs]) for key in runs[0]}


def report(results: Results, found) -> None:
    """A row a trouble, in two tables of the page."""
    results.section = "Troubles"
    rows = []
    for name, (_, words, _) in TROUBLES.items():
        runs = found[name]
        rms, low, high = np.degrees(over_runs(runs[:, 0], runs[:, 1]))
        largest = math.degrees(np.median(runs[:, 2]))
        back, latest = np.median(runs[:, 3]), np.quantile(runs[:, 3], 0.95, method="higher")
        lost = int(runs[:, 4].sum())
        results.numbers |= {f"failure_{name}_cog_rms_deg": rms, f"failure_{name}_largest_deg": largest}
        if name not in LASTING:
            results.numbers |= {f"failure_{name}_back_s": back, f"failure_{name}_back_95_s": latest}
        results.compare(
            f"failure_{name}_lost_runs", lost, f"as it comes, {words}: runs lost", f"of {len(runs)}", "", "0", lost == 0
        )
        again = ("—", "—") if name in LASTING else (_time(back), _time(latest))
        rows.append((words, f"{rms:.1f} ({low:.1f} to {high:.1f})", f"{largest:.0f}", *again, lost))
    results.tables.append(
        (f"Troubles: boat of scenario O, fixes of 0.5 m, as it comes, {len(runs)} runs", _COLUMNS, rows)
    )
    undefined = 100.0 * np.mean(found["standstill"][:, 5])
    results.compare("failure_standstill_undefined_pct", undefined, "as it comes, at rest: time without a course", "%")
    rows = []
    for interval in INTERVALS:
        runs = found[f"ais_{interval:g}"]
        row = [f"{interval:g}"]
        for k, variant in enumerate(("", "_with_transmitted")):
            rms, low, high = np.degrees(over_runs(runs[:, k, 0], runs[:, k, 1]))
            results.numbers[f"failure_ais_{interval:g}s{variant}_cog_rms_deg"] = rms
            row += [f"{rms:.1f} ({low:.1f} to {high:.1f})", int(runs[:, k, 2].sum())]
        rows.append(row)
    results.tables.append(
        (f"AIS: ship of scenario M, positions to {_AIS_NOISE:g} m, as it comes, {len(runs)} runs", _AIS_COLUMNS, rows)
    )


def _time(seconds) -> str:
    return f"{seconds:.1f}" if math.isfinite(seconds) else "never"


_COLUMNS = (
    "trouble",
    f"RMS of COG from {AFTER:g} s after it (°)",
    "largest error of COG in it and 10 s after (median, °)",
    "as good as without it after (median, s)",
    "recovered in 95 % of runs (s)",
    "runs lost",
)
_AIS_COLUMNS = (
    "a report every (s)",
    "RMS of COG, positions alone (°)",
    "runs astray",
    "RMS of COG, with transmitted SOG and COG (°)",
    "runs astray",
)
