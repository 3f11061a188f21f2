"""Study unseen-logs: recorded logs that had no part in development, against Doppler or better instruments.

For every log the default, tuned and smoothed estimate, and a plain EKF fitted to the same log. Half of the logs may be
looked at (develop), the other half only judges (report).
"""

import math
import os
import time
from dataclasses import asdict, dataclass, replace

import steerway
from steerway_studies.parts import over_cases
from steerway_studies.study import Results, Study
from steerway_studies.unseen_logs import page, rounded
from steerway_studies.unseen_logs.catalogue import DEVELOP, KNOWN, REPORT, KnownLog, PublicLog, public_logs
from steerway_studies.unseen_logs.contestants import DEFAULT, EKF, SMOOTHED, contestants
from steerway_studies.unseen_logs.judging import SWING, Verdict, held_back, judged_rows, verdict, worse
from steerway_studies.unseen_logs.recordings import FOLDER, opened, path_of


@dataclass(frozen=True)
class Judged:
    """A log with all verdicts on it. `held_back` is (default, tuned); `cpu` in s.

    `of_mean`: verdicts by the reference's mean over SWING.
    """

    log: PublicLog | KnownLog
    verdicts: dict[str, Verdict]
    of_mean: dict[str, Verdict]
    held_back: tuple[float, float]
    lag: float
    rate_lag: float
    course_lag: float
    noise: tuple[float, float, float]
    fixes: int
    minutes: float
    cpu: float


def judge(log) -> Judged | str:
    """One log, or why it cannot be judged."""
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
        of_mean=by_mean(recording, estimates),
        held_back=held_back(recording),
        lag=reference.lag,
        rate_lag=reference.rate_lag,
        course_lag=reference.course_lag,
        noise=reference.noise,
        fixes=len(times),
        minutes=float(times[-1] - times[0]) / 60.0,
        cpu=time.process_time() - began,
    )


def by_mean(recording, estimates) -> dict[str, Verdict]:
    """Verdicts by the mean velocity over SWING, which the antenna's swing and the reference's noise hardly move."""
    slow = replace(recording, reference=recording.reference.averaged(SWING))
    rows = judged_rows(slow, estimates)
    return {name: verdict(slow, estimates[name], rows) for name in (DEFAULT, SMOOTHED, EKF)}


def run(seeds=None, first_seed=0, progress=None) -> Results:
    """The study; of random there are the noises of rounded positions only. Logs are judged side by side."""
    results = Results("Recorded logs that had no part in development", lead=page.LEAD)
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
        for name, likelihood in zip(("default", "tuned"), each.held_back, strict=True):
            results.numbers[f"{stem}_held_back_{name}"] = likelihood
        results.numbers |= {f"{stem}_lag_s": each.lag, f"{stem}_course_lag_s": each.course_lag}
    page.add_tables(results, judged)
    rounded.add_to(results, first_seed)
    return results


def missing(known, logs) -> list[str]:
    """What is not on this machine, by name."""
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
    """The numbers of a half: those of the report half under their plain names and with targets."""
    prefix = "" if half == REPORT else f"{half}_"
    results.section = f"{half} half, {len(judged)} logs"
    for key, words in (("sog", "SOG"), ("cog", "COG"), ("rate", "course rate")):
        ratios = ratios_of(judged, key)
        if not ratios:
            continue
        of_mean = ratios_of(judged, key, "of_mean")
        if key != "rate" and of_mean:
            worst = max(of_mean, key=of_mean.get)
            mean = math.exp(sum(map(math.log, of_mean.values())) / len(of_mean))
            what = f"{words} error over the plain EKF's, by the reference's mean over {SWING:.0f} s"
            results.numbers[f"{prefix}{key}_ratio_of_mean"] = mean
            results.numbers[f"{prefix}{key}_ratio_of_mean_worst"] = of_mean[worst]
            results.remarks.append(
                f"{half.capitalize()} half: {what}: {mean:.2f} in the mean, worst log {worst} {of_mean[worst]:.2f}."
            )
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
        what = f"refused fixes that the reference says were right ({right} of {asked} that it knows of)"
        _compare(results, half, f"{prefix}right_refused_pct", pct, what, 5.0, "% of refused")
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
    tested = [each for each in judged if math.isfinite(each.held_back[1])]
    if tested:
        lost = [each.log.name for each in tested if worse(*each.held_back)]
        what = f"logs of {len(tested)} whose last fifth tuning predicts worse{': ' if lost else ''}{', '.join(lost)}"
        _compare(results, half, f"{prefix}tuned_worse", len(lost), what, 0)


def ratios_of(judged: list[Judged], key: str, verdicts="verdicts") -> dict[str, float]:
    """Error of the default over that of the plain EKF, by log, where both are known."""
    found = {each.log.name: getattr(each, verdicts) for each in judged}
    ratios = {name: getattr(of[DEFAULT], key) / getattr(of[EKF], key) for name, of in found.items()}
    return {name: ratio for name, ratio in ratios.items() if math.isfinite(ratio)}


def _compare(results, half, key, value, what, limit, unit="", least=False):
    """Only the report half has targets."""
    met = value >= limit if least else value <= limit
    target = {"target": f"{'≥' if least else '≤'} {limit:g}", "met": met} if half == REPORT else {}
    results.compare(key, value, what, unit, **target)


STUDY = Study("unseen-logs", "public logs with Doppler or better instruments, against a fitted plain EKF", run)
