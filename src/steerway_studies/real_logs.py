"""Study real-logs: every recorded log, defaults only, against the receiver's own SOG and COG and independent truth.

The receiver's own values are filtered and late: agreement with them is shown, not aimed at. Independent are the yaw
rate of a compass on the boat whose GNSS positions sail a figure of eight, and the inertial system of a ship (for its
other receivers; for its own positions it is at least another instrument).
"""

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import polars as pl

from steerway import read
from steerway.core import OK, REJECTED, Fixes, InputError, Motion, rms, wrap_array
from steerway.estimation import InferredProfile, Profile, choose_profile, estimate, tune
from steerway.estimation.course import Agreement, compare
from steerway_studies.recorded import logs_folder
from steerway_studies.study import Results, Study

LOGS = (
    "ais_misc/*.txt",
    "anemomind_corrupt/*.nmea",
    "furuno_scx20_n2k/*.raw",
    "gpsd_logs/*.log",
    "palmer_seapath_truth/NBP1406_*",
    "rob_atlantic_1hz/*.nmea",
    "signalk_samples/*.log",
    "signalk_samples/*.data",
    "solent_ais/*.csv",
)
FEWEST = 100
"""Rows with way from which agreement is worth a number."""
FIGURE8 = "furuno_scx20_n2k/furuno-130842-figure8-fast"
WIDE = "furuno_scx20_n2k/furuno-130842-wide-turn"
GYRO = "furuno_scx20_n2k/derived/{}_scx20.csv"
SHIP = "palmer_seapath_truth/NBP1406_{}-2014-08-01"
MOORED = {"gps": "signalk_samples/gps.log", "ac42": "furuno_scx20_n2k/ac42-commissioning.raw"}
MIRRORED = math.radians(135.0)


@dataclass(frozen=True)
class EstimatedLog:
    """Fixes, and what the default and tuning make of them, each found once."""

    fixes: Fixes

    @cached_property
    def profile(self) -> Profile | InferredProfile:
        """What the default finds."""
        return choose_profile(self.fixes)

    @cached_property
    def tuned(self) -> Profile | InferredProfile:
        """What tuning finds."""
        return tune(self.fixes).profile

    @cached_property
    def _motions(self) -> dict[tuple[bool, bool], Motion]:
        return {}

    def estimate(self, smooth: bool = False, tuned: bool = False) -> Motion:
        """By the profile of the default, or by the tuned one."""
        if (smooth, tuned) not in self._motions:
            self._motions[smooth, tuned] = estimate(self.fixes, self.tuned if tuned else self.profile, smooth=smooth)
        return self._motions[smooth, tuned]


def run(seeds=None, first_seed=0, progress=None) -> Results:
    """The study; there is nothing random in it."""
    return judged(logs(logs_folder()), progress)


def logs(folder: Path) -> dict[str, EstimatedLog]:
    """The logs with positions, by their names in the folder."""
    found = {}
    for path in [path for pattern in LOGS for path in sorted(folder.glob(pattern))]:
        try:
            found[path.relative_to(folder).as_posix()] = EstimatedLog(read(path))
        except InputError:
            continue  # instruments without positions
    return found


def judged(seen: dict[str, EstimatedLog], progress=None) -> Results:
    """The study of these logs."""
    results = Results("Recorded logs, defaults only")
    for k, (name, log) in enumerate(seen.items()):
        if progress:
            progress(0.7 * k / len(seen), name)
        add_log(results, name, log)
    for share, words, part in ((0.7, "turns", _turns), (0.8, "ship", _ship), (0.95, "moored", _moored)):
        if progress:
            progress(share, words)
        part(results, seen)
    return results


def _stem(name):
    return name.split("/")[-1].split(".")[0].replace("-", "_").lower()


def add_log(results: Results, name: str, log: EstimatedLog) -> None:
    """What the default makes of one log."""
    both = [log.estimate(smooth) for smooth in (False, True)]
    found = [compare(log.fixes, motion) for motion in both]
    if found[0].compared < FEWEST:
        return
    stem = _stem(name)
    title = f"{name.split('/')[-1]} ({log.profile.name})"
    judged = both[0].rows(np.isin(both[0].status, (OK, REJECTED)) & np.isfinite(both[0].nis))
    nis = float(np.median(judged.nis))
    results.compare(
        f"{stem}_nis_median", nis, f"{title}: median NIS", "", target="0.2 to 3 (1.39)", met=0.2 <= nis <= 3.0
    )
    results.numbers[f"{stem}_rejected_pct"] = 100.0 * float(np.mean(judged.status == REJECTED))
    for suffix, each in zip(("", "_smoothed"), found, strict=True):
        for key, value in _agreement(each).items():
            results.numbers[f"{stem}{suffix}_{key}"] = value
    words = "causal, to the receiver's own, aligned"
    results.compare(f"{stem}_sog_rms_aligned_mps", found[0].sog_rms_aligned, f"{title}: SOG {words}", "m/s")
    results.compare(f"{stem}_cog_rms_aligned_deg", math.degrees(found[0].cog_rms_aligned), f"{title}: COG {words}", "°")
    if log.fixes.mmsi is None:
        results.compare(
            f"{stem}_mirrored_pct",
            100.0 * _mirrored(log.fixes, both[0]),
            f"{title}: course more than 135° from the receiver's for ten seconds",
            "% of rows",
        )


def _agreement(found: Agreement) -> dict:
    chosen = ("sog_rms", "sog_rms_aligned", "sog_lag", "cog_rms", "cog_rms_aligned", "cog_lag", "cog_robust")
    return {key: value for key, value in found.as_dict().items() if key.startswith(chosen)}


def _mirrored(fixes: Fixes, motion: Motion) -> float:
    """Share of rows in runs of ten seconds and more that run against the receiver's course, where it has way."""
    reports = fixes.rows(fixes.has_position)
    wrong = (reports.sog > 1.0) & (np.abs(wrap_array(motion.cog - reports.cog)) > MIRRORED)
    edges = np.flatnonzero(np.diff(np.r_[False, wrong, False]))
    runs = [
        (i, j) for i, j in zip(edges[::2], edges[1::2], strict=True) if reports.time[j - 1] - reports.time[i] >= 10.0
    ]
    return sum(j - i for i, j in runs) / max(int((reports.sog > 1.0).sum()), 1)


def _known_rms(values) -> float:
    """RMS of the values that are known."""
    return rms(values[np.isfinite(values)])


def _turns(results: Results, seen) -> None:
    """Course rate against the compass's yaw rate over one second; the lag is the smoothed estimate's."""
    targets = {"": (0.545, 0.36), "_aligned": (0.33, 0.21)}
    panels = []
    for key, name in (("figure8", FIGURE8), ("wide_turn", WIDE)):
        log = seen[f"{name}.raw"]
        table = pl.read_csv(logs_folder() / GYRO.format(name.split("/")[-1]))
        time, rate = table["t"].to_numpy(), table["p9_rot_dps_1s"].to_numpy()

        def error(motion, lag, time=time, rate=rate):
            return _known_rms(np.degrees(motion.course_rate) - np.interp(motion.time - lag, time, rate))

        causal, smoothed = (log.estimate(smooth) for smooth in (False, True))
        if key == "figure8":  # the wide turn, by the same receiver on the same day, is too slow to tell a lag
            lags = np.arange(0.0, 5.0, 0.01)
            lag = float(lags[np.argmin([error(smoothed, each) for each in lags])])
            words = f"{key}: positions late by (smoothed estimate against the compass)"
            results.compare("figure8_receiver_lag_s", lag, words, "s")
        for suffix, moved in (("", 0.0), ("_aligned", lag)):
            for k, (words, motion) in enumerate((("", causal), ("_smoothed", smoothed))):
                value, target = error(motion, moved), targets[suffix][k] if key == "figure8" else None
                results.compare(
                    f"{key}_rate_rms{words}{suffix}_dps",
                    value,
                    f"{key}: course rate{words.replace('_', ', ')}{', lag taken out' if suffix else ''}",
                    "°/s",
                    target=f"≤ {target}" if target else "",
                    met=value <= target if target else None,
                )
        if key == "figure8":
            results.numbers["figure8_rate_rms_tuned_dps"] = error(log.estimate(tuned=True), 0.0)
            results.numbers["figure8_rate_rms_tuned_smoothed_dps"] = error(log.estimate(smooth=True, tuned=True), 0.0)
        panels.append((key, time, rate, causal, smoothed, lag))
    results.figures["turns"] = (_turns_figure(panels), _TURNS)


def _ship(results: Results, seen) -> None:
    """The ship's receivers against its inertial system, all on the clock that they state."""
    inertial = seen[SHIP.format("s330")]
    truth = inertial.fixes
    for receiver in ("s330", "seap", "gp02", "pcod"):
        log = next(each for name, each in seen.items() if receiver in _stem(name))
        for suffix in ("", "_tuned"):
            for words in ("", "_smoothed"):
                motion = log.estimate(smooth=bool(words), tuned=bool(suffix))
                sog, cog = _against(truth, motion)
                key = f"{receiver}{words}{suffix}"
                if suffix:
                    results.numbers |= {f"{key}_sog_rms_mps": sog, f"{key}_cog_rms_deg": cog}
                    continue
                aimed = receiver == "s330" and not words
                named = f"{receiver}{', smoothed' if words else ''}, against the inertial system"
                bound = {"target": "≤ 0.05", "met": sog <= 0.05} if aimed else {}
                results.compare(f"{key}_sog_rms_mps", sog, f"{named}: SOG", "m/s", **bound)
                bound = {"target": "≤ 0.42", "met": cog <= 0.42} if aimed else {}
                results.compare(f"{key}_cog_rms_deg", cog, f"{named}: COG", "°", **bound)
    results.figures["ship"] = (_ship_figure(inertial), _SHIP)


def _against(truth: Fixes, motion: Motion):
    """RMS of SOG (m/s) and COG (deg) where the truth is known."""
    there = (motion.time >= truth.time[0]) & (motion.time <= truth.time[-1]) & np.isfinite(motion.cog)
    motion = motion.rows(there)
    known = np.isfinite(truth.sog) & np.isfinite(truth.cog)
    sog = np.interp(motion.time, truth.time[known], truth.sog[known])
    cog = np.interp(motion.time, truth.time[known], np.unwrap(truth.cog[known]))
    return _known_rms(motion.sog - sog), math.degrees(_known_rms(wrap_array(motion.cog - cog)))


def _moored(results: Results, seen) -> None:
    shares = []
    for key, name in MOORED.items():
        log = seen[name]
        found = compare(log.fixes, log.estimate())
        share, sog = 100.0 * found.standstill_undefined, found.standstill_sog_median
        shares.append(share)
        results.compare(
            f"standstill_{key}_undefined_pct", share, f"{key}, moored: course undefined", "%", "", "≥ 95", share >= 95.0
        )
        results.compare(
            f"standstill_{key}_sog_median_mps", sog, f"{key}, moored: median SOG", "m/s", "", "< 0.15", sog < 0.15
        )
    results.numbers["standstill_undefined_pct"] = min(shares)


_TURNS = (
    "Course rate from positions alone beside the compass's yaw rate averaged over one second, the compass moved by "
    "the lag of the receiver. Above the figure of eight, below the wide turn."
)
_SHIP = "The ship in swell: SOG and COG from 1 Hz positions, causal, and of its inertial system, for two minutes."


def _turns_figure(panels):
    from matplotlib.figure import Figure

    from steerway.report import OURS, QUIET, THEIRS

    figure = Figure(figsize=(11.0, 7.0), layout="constrained")
    for axes, (key, time, rate, causal, smoothed, lag) in zip(figure.subplots(len(panels), 1), panels, strict=True):
        start = causal.time[0]
        axes.plot(time + lag - start, rate, color=THEIRS, linewidth=2.5, label=f"compass, {lag:.2f} s later")
        axes.plot(causal.time - start, np.degrees(causal.course_rate), color=QUIET, linewidth=1.2, label="causal")
        axes.plot(smoothed.time - start, np.degrees(smoothed.course_rate), color=OURS, linewidth=1.2, label="smoothed")
        axes.set_title(key.replace("_", " "), fontsize=10)
        axes.set_ylabel("course rate (°/s)\n+ starboard")
        axes.grid(alpha=0.25)
        axes.margins(x=0.01)
        axes.legend(loc="upper right", frameon=False, ncols=3)
    axes.set_xlabel("time (s)")
    return figure


def _ship_figure(inertial):
    from matplotlib.figure import Figure

    from steerway.report import OURS, THEIRS

    truth, motion = inertial.fixes, inertial.estimate()
    figure = Figure(figsize=(11.0, 6.0), layout="constrained")
    sog, cog = figure.subplots(2, 1, sharex=True)
    start = truth.time[0] + 300.0
    there = np.abs(motion.time - start - 60.0) < 60.0
    elapsed = motion.time[there] - start
    shown = np.abs(truth.time - start - 60.0) < 60.0
    for axes, ours, theirs in (
        (sog, motion.sog, truth.sog),
        (cog, np.mod(np.degrees(motion.cog), 360.0), np.mod(np.degrees(truth.cog), 360.0)),
    ):
        axes.plot(truth.time[shown] - start, theirs[shown], "o", color=THEIRS, markersize=4, label="inertial system")
        axes.plot(elapsed, ours[there], color=OURS, linewidth=1.3, label="from positions, causal")
        axes.grid(alpha=0.25)
    sog.set_ylabel("SOG (m/s)")
    cog.set_ylabel("COG (°)")
    cog.set_xlabel("time (s)")
    sog.legend(loc="upper right", frameon=False, ncols=2)
    return figure


STUDY = Study("real-logs", "every recorded log, defaults only, against receivers and independent truth", run)
