"""The page: one table a half and one a log. Where the logs are from stands in catalogue.toml."""

import math

from steerway_studies.study import Results
from steerway_studies.unseen_logs.catalogue import DEVELOP, REPORT
from steerway_studies.unseen_logs.contestants import DEFAULT, EKF, SMOOTHED, TUNED, WORDS
from steerway_studies.unseen_logs.judging import SWING

LEAD = (
    "Logs from public repositories, judged by the receiver's Doppler velocity or by a better instrument. The develop "
    "half may be looked at and tuned on; the report half only judges, and the numbers without a prefix are its own. "
    "The reference's lag is the one that brings the integral of its velocity closest to the displacements of the "
    "positions over 5 s, without any filter's help, and is taken out for all contestants alike; that of the course "
    "besides, where ways and directions show it, as instruments damp speed and course apart. Spikes of it "
    "(above 30 m/s², or a stated accuracy above 1.5 m/s) are left out by the reference alone. Coverage counts the "
    "reference's white noise, from its third differences. COG and rate are judged above 0.6 m/s. "
    "A receiver's velocity is that of its antenna: on a boat in waves it swings, which the default takes for no motion "
    "of the boat. Therefore SOG and COG are compared with the reference's mean over 4 s besides."
)
_FILES = (
    "Each log stands in the folder STEERWAY_LOGS as NAME/NAME.csv, with the columns time_s, lat_deg, lon_deg, those of "
    "accuracy (hacc_m, hdop) and of the receiver's own velocity (sog_mps, cog_deg) where the reference is another "
    "instrument, and of the reference as far as there: ref_sog_mps, ref_cog_deg, ref_rate_dps, ref_heading_deg, "
    "ref_sog_std_mps. A speed of 0 that means unknown is empty. Minutes are those of the file that are used."
)


def add_tables(results: Results, judged) -> None:
    """All tables; `judged` as the study found them."""
    for half in (REPORT, DEVELOP):
        rows = [_summary(each) for each in judged if each.log.half == half]
        if rows:
            results.tables.append((f"Every log of the {half} half", _SUMMARY, rows))
    for each in judged:
        rows = [_row(WORDS[name], one) for name, one in each.verdicts.items()]
        rows += [_row(f"{WORDS[name]}, by the mean over {SWING:.0f} s", one) for name, one in each.of_mean.items()]
        results.tables.append((_heading(each), _COLUMNS, rows))
    results.remarks.append(_FILES)


_SUMMARY = (
    *("log", "fixes", "min", "lag s", "SOG m/s: default", "plain EKF", "ratio", "tuned", "smoothed"),
    *("COG °: default", "plain EKF", "ratio", "tuned", "smoothed", "rate °/s: default", "plain EKF", "ratio"),
    *("cover % s/c/r", "refused", "right of known", "log likelihood held back: default", "tuned", "CPU s"),
)


def _summary(each) -> tuple:
    verdicts = each.verdicts
    blank = math.nan
    cells = []
    for key, factor, others in (
        ("sog", 1.0, (TUNED, SMOOTHED)),
        ("cog", 180 / math.pi, (TUNED, SMOOTHED)),
        ("rate", 180 / math.pi, ()),
    ):
        ours, ekf = (factor * getattr(verdicts[name], key) for name in (DEFAULT, EKF))
        cells += [_number(ours), _number(ekf), _number(ours / ekf)]
        cells += [_number(factor * getattr(verdicts[name], key) if name in verdicts else blank) for name in others]
    one = verdicts[DEFAULT]
    return (
        *(each.log.name, each.fixes, f"{each.minutes:.0f}", f"{each.lag:.2f}", *cells, _covers(one), one.refused),
        *(
            f"{one.refused_right} of {one.refused_judged}",
            *(f"{likelihood:.1f}" for likelihood in each.held_back),
            f"{each.cpu:.0f}",
        ),
    )


_COLUMNS = (
    *("", "SOG m/s", "COG °", "rate °/s", "cover SOG %", "COG %", "rate %"),
    *("course above 0.6 m/s %", "refused", "right of known"),
)


def _heading(each) -> str:
    log = each.log
    sog, across, rate = each.noise
    noise = f"noise at least {sog:.3f} m/s, {across:.3f} m/s across"
    noise += f", {math.degrees(rate):.2f} °/s" if rate else ""
    late = f"late by {each.lag:.2f} s" + (f", course by {each.course_lag:.2f} s more" if each.course_lag else "")
    late += f", rate by {each.rate_lag:.2f} s" if each.rate_lag else ""
    return f"{log.name} ({log.half}): {log.boat}; {log.receiver}; reference: {log.reference}, {late}, {noise}"


def _row(name, one) -> tuple:
    return (
        name,
        *(_number(one.sog), _number(math.degrees(one.cog)), _number(math.degrees(one.rate))),
        *(_percent(cover) for cover in (one.sog_cover, one.cog_cover, one.rate_cover, one.course_defined)),
        one.refused or "",
        f"{one.refused_right} of {one.refused_judged}" if one.refused_judged else "",
    )


def _covers(one) -> str:
    return "/".join(_percent(cover) or "–" for cover in (one.sog_cover, one.cog_cover, one.rate_cover))


def _number(value) -> str:
    return f"{value:.3g}" if math.isfinite(value) else ""


def _percent(share) -> str:
    return f"{100.0 * share:.0f}" if math.isfinite(share) else ""
