"""Study unseen-logs: recorded logs that were not used in development, judged by Doppler or better instruments.

Every log is estimated with the defaults, causal and smoothed, and by a plain EKF fitted to the same log. Half of the
logs may be used in development (develop); the other half is used for judging only (report).
"""

import math
import os
import time
from dataclasses import asdict, dataclass

import steerway
from steerway_studies.study import Results, Study, over_cases
from steerway_studies.unseen_logs import rounded
from steerway_studies.unseen_logs.catalogue import DEVELOP, KNOWN, REPORT, KnownLog, PublicLog, public_logs
from steerway_studies.unseen_logs.judging import (
    DEFAULT,
    EKF,
    SMOOTHED,
    Verdict,
    contestants,
    judged_rows,
    verdict,
)
from steerway_studies.unseen_logs.recordings import FOLDER, opened, path_of


@dataclass(frozen=True)
class Judged:
    """A log with the verdict on every contestant; lags and processor time (`cpu`) in s."""

    log: PublicLog | KnownLog
    verdicts: dict[str, Verdict]
    lag: float
    course_lag: float
    fixes: int
    minutes: float
    cpu: float


def judge(log) -> Judged | str:
    """The result of one log, or a sentence that says why it cannot be judged."""
    began = time.process_time()
    try:
        recording = opened(log)
        estimates = contestants(recording)
    except steerway.InputError as error:
        return f"{log.name} was left out: {error}"
    rows = judged_rows(recording, estimates)
    reference, times = recording.reference, recording.fixes.time
    return Judged(
        log=log,
        verdicts={name: verdict(recording, each, rows) for name, each in estimates.items()},
        lag=reference.lag,
        course_lag=reference.course_lag,
        fixes=len(times),
        minutes=float(times[-1] - times[0]) / 60.0,
        cpu=time.process_time() - began,
    )


def run(seeds=None, first_seed=0, progress=None) -> Results:
    """See Study. Only the noise of rounded positions is random (`first_seed`). Logs are judged in parallel."""
    results = Results("Recorded logs that were not used in development", lead=LEAD)
    known = [*public_logs(), *KNOWN]
    logs = [log for log in known if path_of(log)]
    found = over_cases(judge, logs, progress=progress and (lambda share: progress(share, "")))
    judged = [each for each in found if isinstance(each, Judged)]
    results.remarks += [each for each in found if isinstance(each, str)]
    results.remarks += missing(known, logs)
    for half in (REPORT, DEVELOP):
        summarise(results, [each for each in judged if each.log.half == half], half)
    for each in judged:
        stem = each.log.name.replace("-", "_")
        for name, one in each.verdicts.items():
            results.numbers |= {f"{stem}_{name}_{key}": float(value) for key, value in asdict(one).items()}
        results.numbers |= {f"{stem}_lag_s": each.lag, f"{stem}_course_lag_s": each.course_lag}
    for half in (REPORT, DEVELOP):
        if rows := [_summary(each) for each in judged if each.log.half == half]:
            results.tables.append((f"Every log of the {half} half", _SUMMARY, rows))
    results.remarks.append(_FILES)
    rounded.add_to(results, first_seed)
    return results


def missing(known, logs) -> list[str]:
    """Remarks that name the logs which are not on this machine."""
    gone = [log for log in known if log not in logs]
    public = [log.name for log in gone if isinstance(log, PublicLog)]
    remarks = []
    if public:
        where = os.environ.get(FOLDER)
        reason = f"not in the folder {where}" if where else f"{FOLDER} names no folder"
        remarks.append(f"Left out, {reason}: {', '.join(public)}.")
    if len(gone) > len(public):
        remarks.append(f"Left out, not in STEERWAY_DATA: {', '.join(x.name for x in gone if isinstance(x, KnownLog))}.")
    return remarks


def summarise(results: Results, judged: list[Judged], half: str) -> None:
    """Numbers of a half of the logs; those of the report half have targets and keys without a prefix."""
    prefix = "" if half == REPORT else f"{half}_"
    results.section = f"{half} half, {len(judged)} logs"
    for key, words in (("sog", "SOG"), ("cog", "COG"), ("rate", "course rate")):
        ratios = ratios_of(judged, key)
        if not ratios:
            continue
        worst = max(ratios, key=ratios.get)
        mean = math.exp(sum(map(math.log, ratios.values())) / len(ratios))
        for suffix, value, limit, what in (
            ("ratio", mean, 0.85, f"geometric mean of {len(ratios)} logs"),
            ("ratio_worst", ratios[worst], 1.05, f"worst log, {worst}"),
        ):
            _compare(
                results, half, f"{prefix}{key}_{suffix}", value, f"{words} error over the plain EKF's: {what}", limit
            )
    default = [each.verdicts[DEFAULT] for each in judged]
    asked = sum(one.refused_judged for one in default)
    right = sum(one.refused_right for one in default)
    fixes = sum(each.fixes for each in judged)
    if fixes:
        pct = 100.0 * right / asked if asked else 0.0
        what = f"rejected fixes that were right by the reference ({right} of {asked} that it can judge)"
        _compare(results, half, f"{prefix}right_refused_pct", pct, what, 5.0, "% of rejected")
        _compare(results, half, f"{prefix}right_refused_of_all_pct", 100.0 * right / fixes, what, 0.05, "% of all")
    covers = {
        f"{each.log.name}, {words}": 100.0 * cover
        for each in judged
        for key, words in (("sog_cover", "SOG"), ("cog_cover", "COG"))
        if math.isfinite(cover := getattr(each.verdicts[DEFAULT], key))
    }
    if covers:
        least = min(covers, key=covers.get)
        what = f"coverage of the 95 % interval, least: {least}"
        _compare(results, half, f"{prefix}coverage_min_pct", covers[least], what, 90.0, "%", least=True)


def ratios_of(judged: list[Judged], key: str) -> dict[str, float]:
    """By log, error of the default over that of the plain EKF; logs without either error are left out."""
    ratios = {each.log.name: getattr(each.verdicts[DEFAULT], key) / getattr(each.verdicts[EKF], key) for each in judged}
    return {name: ratio for name, ratio in ratios.items() if math.isfinite(ratio)}


def _compare(results, half, key, value, what, limit, unit="", least=False):
    """Add a line to the table; only the report half has targets."""
    met = value >= limit if least else value <= limit
    target = {"target": f"{'≥' if least else '≤'} {limit:g}", "met": met} if half == REPORT else {}
    results.compare(key, value, what, unit, **target)


_SUMMARY = (
    *("log", "fixes", "min", "lag s", "SOG m/s: default", "plain EKF", "ratio", "smoothed"),
    *("COG °: default", "plain EKF", "ratio", "smoothed", "rate °/s: default", "plain EKF", "ratio"),
    *("cover % s/c/r", "rejected", "right, of judged", "CPU s"),
)


def _summary(each) -> tuple:
    verdicts = each.verdicts
    cells = []
    for key, factor, is_smoothed in (("sog", 1.0, True), ("cog", 180 / math.pi, True), ("rate", 180 / math.pi, False)):
        ours, ekf, smoothed = (factor * getattr(verdicts[name], key) for name in (DEFAULT, EKF, SMOOTHED))
        cells += [_number(each) for each in (ours, ekf, ours / ekf, *([smoothed] if is_smoothed else []))]
    one = verdicts[DEFAULT]
    about = (each.log.name, each.fixes, f"{each.minutes:.0f}", f"{each.lag:.2f}")
    return *about, *cells, _covers(one), one.refused, f"{one.refused_right} of {one.refused_judged}", f"{each.cpu:.0f}"


def _covers(one) -> str:
    return "/".join(_percent(cover) or "–" for cover in (one.sog_cover, one.cog_cover, one.rate_cover))


def _number(value) -> str:
    return f"{value:.3g}" if math.isfinite(value) else ""


def _percent(share) -> str:
    return f"{100.0 * share:.0f}" if math.isfinite(share) else ""


LEAD = (
    "Logs from public repositories, judged by the receiver's Doppler velocity or by a better instrument. The develop "
    "half may be used for tuning; the report half is used for judging only, and the numbers without a prefix belong to "
    "it. The reference's lag is found without any filter: with this lag the integral of its velocity is closest to the "
    "displacements of the positions over 5 s. It is corrected for all contestants alike. If distances and directions "
    "show that the reference's course has another lag than its speed, because instruments damp them differently, this "
    "lag is corrected too. Spikes of the reference (above 30 m/s², or a stated accuracy above 1.5 m/s) are left out, "
    "without regard to the estimates. Coverage includes the reference's white noise, from its third differences. COG "
    "and rate are judged above 0.6 m/s. A receiver's velocity is that of its antenna, which swings on a boat in waves; "
    "the default estimate leaves this swing out."
)
_FILES = (
    "Each log is in the folder STEERWAY_LOGS as NAME/NAME.csv, with the columns time_s, lat_deg and lon_deg; accuracy "
    "(hacc_m, hdop); the receiver's own velocity (sog_mps, cog_deg) if the reference is another instrument; and those "
    "columns of the reference that exist: ref_sog_mps, ref_cog_deg, ref_rate_dps, ref_heading_deg, ref_sog_std_mps. A "
    "speed of 0 that means unknown is empty. Minutes are those of the file that are used."
)
STUDY = Study("unseen-logs", "public logs with Doppler or better instruments, against a fitted plain EKF", run)
