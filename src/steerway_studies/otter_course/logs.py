"""P0 sections 6–7 on real logs: estimates compared with the receiver, drawn like figures 7–11.

The paper's own logs are not public. Three logs of other boats replace them: a motor boat that turns at 4 m/s with 5 Hz
fixes (for the Mariner USV), a sailing boat and a kayak at the Otter's speed. A receiver's SOG and COG are filtered and
late, so they are not the truth, as the paper notes.
"""

import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from steerway import read
from steerway.core import OK, Fixes, Motion, wrap
from steerway.estimation import choose_profile, compare, estimate
from steerway.report import BAD, THEIRS, Curve, Panel, broken, series, track_figure
from steerway_studies.papers.ekf_5states import Ekf5States

STEP = 0.02
LONGEST = 1500.0
"""Length (s) of the shown part of a log."""


@dataclass(frozen=True)
class PublishedLog:
    """A recorded log, the figures of P0 that it replaces, and the paper's tuning for the printed filter."""

    name: str
    path: str
    boat: str
    track_stem: str
    signals_stem: str
    instead_of: str
    source: str | None
    process_noise: tuple[float, float]
    start: float = 0.0  # s, time in the log at which the shown part begins


LOGS = (
    PublishedLog(
        "motor_boat",
        "furuno_scx20_n2k/furuno-130842-figure8-fast.raw",
        "motor boat, figures of eight at 4 m/s, 5 Hz",
        "figure_7_track",
        "figure_8_signals",
        "7 and 8 (Mariner USV)",
        "src 52",
        (1e7, 1e3),
    ),
    PublishedLog(
        "sailing_boat",
        "rob_atlantic_1hz/gx_to_gavres.nmea",
        "sailing boat, coastal passage at 2.7 m/s, u-blox at 1 Hz",
        "figure_9_upper_track",
        "figure_10_signals",
        "9 and 10 (Otter in the fjord)",
        None,
        (5e5, 5e5),
        600.0,
    ),
    PublishedLog(
        "kayak",
        "rob_atlantic_1hz/tomales_kayak.nmea",
        "kayak at 0.8 m/s with stops, 1 Hz",
        "figure_9_lower_track",
        "figure_11_signals",
        "9 and 11 (Otter in the harbour)",
        None,
        (5e5, 5e5),
        300.0,
    ),
)


def add_logs(results) -> None:
    """Numbers and figures of every log on this machine; a remark for each log that is missing."""
    folder = os.environ.get("STEERWAY_DATA")
    if not folder:
        results.remarks.append(
            "P0 §6–7 on real logs was left out: STEERWAY_DATA names no folder of recorded logs on this machine."
        )
        return
    for log in LOGS:
        path = Path(folder) / "data" / log.path
        if path.is_file():
            _add(results, log, _opened(path, log))
        else:
            results.remarks.append(f"{log.path} is not among the recorded logs on this machine and was left out.")


def _opened(path, log) -> Fixes:
    fixes = read(path, source=log.source)
    began = fixes.time[fixes.has_position][0] + log.start
    return fixes.between(began, began + LONGEST)


def _add(results, log, fixes):
    profile = choose_profile(fixes)
    ours, printed = estimate(fixes, profile, causal=True), as_printed(fixes, log.process_noise)
    for who, name, motion in (("product", "Steerway's", ours), ("printed", "printed", printed)):
        agreement = compare(fixes, motion)
        stem, where = f"log_{log.name}_{who}", f"{log.boat}: {name} filter against the receiver above 1 m/s"
        for key, value, what, unit in (
            ("sog_rms_mps", agreement.sog_rms_aligned, f"SOG, RMS after a lag of {agreement.sog_lag:.1f} s", "m/s"),
            ("cog_rms_deg", agreement.cog_rms_aligned, f"COG, RMS after a lag of {agreement.cog_lag:.1f} s", "°"),
        ):
            value = math.degrees(value) if unit == "°" else value
            results.compare(f"{stem}_{key}", value, f"{where}: {what}", unit)
    caption = f"In place of P0 figures {log.instead_of}: {log.boat}. "
    results.figures[log.track_stem] = (
        track_figure(ours),
        caption + "Track of Steerway's filter; grey where course is not defined.",
    )
    results.figures[log.signals_stem] = (
        _signals(fixes, ours, printed),
        caption + f"Speed and course over ground of Steerway's filter (profile {profile.name}), of the printed "
        "filter with the paper's tuning, and of the receiver. At rest course is undefined: Steerway outputs none.",
    )


def as_printed(fixes: Fixes, process_noise) -> Motion:
    """P0 Appendix A in latitude and longitude, predicting at 50 Hz, over a log; one row per fix.

    For the comparison, U < 0 is replaced by −U and χ + π: the mirrored solution of the filter is the same motion.
    """
    fixes = fixes.rows(fixes.has_position)
    ekf = Ekf5States(STEP, None, "LL", process_noise, [1e-8, 1e-8])
    rows, moment = [], fixes.time[0]
    for time, latitude, longitude in zip(fixes.time, fixes.latitude, fixes.longitude, strict=True):
        for _ in range(round((time - moment) / STEP) - 1):
            ekf.step()
        moment = time
        rows.append(ekf.step(latitude, longitude))
    latitude, longitude, speed, course, rate = np.array(rows).T
    course = np.array([wrap(each) for each in course + np.where(speed < 0.0, math.pi, 0.0)])
    unknown = np.full(len(fixes), np.nan)
    return Motion(
        time=fixes.time,
        latitude=latitude,
        longitude=longitude,
        sog=np.abs(speed),
        cog=course,
        course_rate=rate,
        sog_std=unknown,
        cog_std=unknown,
        course_rate_std=unknown,
        nis=unknown,
        status=np.full(len(fixes), OK, np.uint8),
        position_std=unknown,
    )


def _signals(fixes, ours, printed):
    """Figures 8, 10 and 11: SOG and COG over time."""
    began = ours.time[0]
    reports = fixes.rows(np.isfinite(fixes.sog) | np.isfinite(fixes.cog))
    time, course = reports.time - began, np.degrees(np.mod(reports.cog, 2 * np.pi))
    sog = [Curve(time, reports.sog, "receiver", THEIRS, ".")]
    cog = [Curve(time, course, "", THEIRS, ".")]
    for motion, name, *look in ((printed, "printed filter", BAD, "-", 0.8), (ours, "Steerway's filter")):
        sog.append(Curve(motion.time - began, motion.sog, name, *look))
        course = broken(np.degrees(np.mod(motion.cog, 2 * np.pi)))
        cog.append(Curve(motion.time - began, course, "", *look))
    most = 1.5 * np.nanquantile(ours.sog, 0.99)
    return series([Panel("SOG (m/s)", sog, ylim=(0.0, most)), Panel("COG (°)", cog, ylim=(0.0, 360.0))])
