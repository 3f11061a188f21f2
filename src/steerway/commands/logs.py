"""The commands that estimate from logs: estimate, tune, compare, predict."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from steerway.commands.options import (
    AIDS,
    AS_JSON,
    CAUSAL,
    FROM,
    LOGS,
    MAX_SIZE,
    PROFILE,
    SMOOTH,
    SOURCE,
    UNTIL,
    aid_names,
    asks_smoothed,
    expect_output,
    expect_toml,
    read_logs,
)
from steerway.commands.terminal import flag, option, print_json, print_notes, print_pairs, print_table, progress_line
from steerway.core.errors import InputError

if TYPE_CHECKING:
    import polars as pl

    from steerway.core.records import Fixes, Motion


def estimate(
    logs: list[str] = LOGS,
    out: Path | None = option("OUT", "Output file: .csv, .parquet, .geojson or .gpx.", None, "-o", "--out"),
    report: Path | None = option("PAGE", "Report: a page (.html) or picture (.png)."),
    episodes: Path | None = option(
        "FILE",
        "Output file (.csv or .json) for episodes: refused fixes, restarts, gaps, disagreements with position "
        "differences or with the receiver's own SOG.",
    ),
    rate: float | None = option("HZ", "Output rate in Hz; by default one row per fix."),
    causal: bool = CAUSAL,
    smooth: bool = SMOOTH,
    profile: str | None = PROFILE,
    source: str | None = SOURCE,
    aid: str | None = AIDS,
    no_accuracy: bool = flag(
        "--no-accuracy", "Ignore the accuracy that the receiver reports: weight all fixes equally."
    ),
    latency: float = option("S", "Latency (s) of position, SOG and COG: the time by which their stamps are late.", 0.0),
    start: str | None = FROM,
    stop: str | None = UNTIL,
    max_size: float | None = MAX_SIZE,
    as_json: bool = AS_JSON,
) -> None:
    """Estimate SOG, COG and course rate from the positions in logs.

    Examples:

        steerway estimate sortie.nmea -o track.csv --report page.html

        steerway estimate day1.ubx.gz day2.ubx.gz --causal --rate 10 -o track.parquet

        cat ais.txt | steerway estimate - -o vessels.parquet
    """
    import numpy as np

    from steerway.estimation.fit.description import structures_of
    from steerway.estimation.log.latency import lateness, on_time
    from steerway.estimation.log.rows import expect_rate, variance_scales
    from steerway.estimation.log_estimate import LogEstimator
    from steerway.report.summary import summarise

    _expect_outputs(logs, out, report, episodes)
    aids, smoothed = aid_names(aid), asks_smoothed(logs, causal, smooth)
    expect_rate(rate)
    fixes = on_time(read_logs(logs, source, start, stop, max_size), latency)
    if no_accuracy:
        fixes = replace(fixes, position_std=np.full(len(fixes), np.nan))
    estimator = LogEstimator(fixes, profile, aids)
    motion = estimator.motion(fixes, rate, smoothed)
    late = lateness(fixes)
    down_weighted = int((variance_scales(fixes) > 1.0).sum())
    used = estimator.profile
    structures = structures_of(used, estimator.inference)
    summary = summarise(fixes, motion, estimator.profile.name, smoothed, down_weighted, late, structures, aids)
    _write_outputs(logs, out, report, episodes, fixes, motion, summary)
    if as_json:
        print_json(summary)
        return
    _print_summary(summary)
    for written in (out, report, episodes):
        if written is not None:
            print(f"wrote {written}")
    if out is None and report is None:
        if estimator.inference is not None and not aids and np.isfinite(fixes.sog).any():
            print("--aid auto uses the receiver's own SOG and COG where they are informative")
        print("-o track.csv (or .parquet .geojson .gpx) writes the estimate, --report page.html a report")


def _expect_outputs(logs: Sequence[str], out: Path | None, report: Path | None, episodes: Path | None) -> None:
    """Raises InputError for an output that cannot be written; called before anything is computed."""
    from steerway.formats.writing import writer
    from steerway.report.episodes import expect_writable
    from steerway.report.motion_page import report_writer

    checks: tuple[Callable[[Path], object], ...] = writer, report_writer, expect_writable
    for path, check in zip((out, report, episodes), checks, strict=True):
        if path is not None:
            expect_output(path, logs)
            check(path)


def _write_outputs(
    logs: Sequence[str],
    out: Path | None,
    report: Path | None,
    episodes: Path | None,
    fixes: "Fixes",
    motion: "Motion",
    summary: dict[str, Any],
) -> None:
    if out is not None:
        from steerway.formats.writing import write

        write(motion, out)
    if report is not None:
        from steerway.report.motion_page import write_report

        write_report(report, f"Estimate of {', '.join(Path(log).name for log in logs)}", fixes, motion, summary)
    if episodes is not None:
        from steerway.report.episodes import episodes_of, write_episodes

        write_episodes(episodes_of(fixes, motion), episodes)


def tune(
    logs: list[str] = LOGS,
    out: Path | None = option("PROFILE.toml", "Output file for the profile.", None, "-o", "--out"),
    source: str | None = SOURCE,
    start: str | None = FROM,
    stop: str | None = UNTIL,
    max_size: float | None = MAX_SIZE,
    as_json: bool = AS_JSON,
) -> None:
    """Fit a profile to logs by maximum likelihood, and check it on fixes that were held back.

    Example:

        steerway tune sortie.nmea -o mine.toml && steerway estimate sortie.nmea --profile mine.toml -o track.csv
    """
    from steerway.estimation import tune as fit

    if out is not None:
        expect_output(out, logs)
        expect_toml(out)
    fixes = read_logs(logs, source, start, stop, max_size)
    with progress_line("fitting") as step:
        tuned = fit(fixes, name=out.stem if out else "tuned", progress=step)
    if out is not None:
        tuned.profile.save(out)
    if as_json:
        print_json(tuned.as_dict())
        return
    print_pairs(tuned.sentences())
    print(f"wrote {out}" if out else "-o mine.toml writes the profile, --profile mine.toml uses it")


def compare(
    logs: list[str] = LOGS,
    causal: bool = CAUSAL,
    smooth: bool = SMOOTH,
    least_speed: float = option("M/S", "Compare only rows with a reported SOG above this, m/s.", 1.0, min=0.0),
    truth: str | None = option("FILE", "Compare with the motion in this run, table or log instead."),
    profile: str | None = PROFILE,
    source: str | None = SOURCE,
    start: str | None = FROM,
    stop: str | None = UNTIL,
    max_size: float | None = MAX_SIZE,
    as_json: bool = AS_JSON,
) -> None:
    """Compare the estimate with the receiver's own SOG and COG, which are filtered and delayed, or with the truth.

    If a column's name does not state its unit, the unit assumed is printed. --truth prints the errors of position, SOG,
    COG and course rate, and the share of errors within ± 2σ, which is 95 % if σ is calibrated.

    Examples:

        steerway compare sortie.nmea --causal

        steerway compare otter.csv --least-speed 0.3

        steerway compare sailed/run.nmea --truth sailed/run.parquet
    """
    import numpy as np

    from steerway.estimation.fit.description import is_of_hull, structures_of
    from steerway.estimation.log.compare import SWING
    from steerway.estimation.log.compare import compare as agreement
    from steerway.estimation.log_estimate import LogEstimator
    from steerway.report.summary import which_estimate

    smoothed = asks_smoothed(logs, causal, smooth)
    fixes = read_logs(logs, source, start, stop, max_size)
    if truth is None and not np.isfinite([fixes.sog, fixes.cog]).any():
        raise InputError(f"{', '.join(logs)}: no SOG or COG from a receiver, expected one of them, or --truth FILE")
    estimator = LogEstimator(fixes, profile)
    motion = estimator.motion(fixes, None, smoothed)
    if truth is not None:
        _compare_with_truth(truth, fixes, motion, as_json)
        return
    used = estimator.profile
    of_hull = is_of_hull(structures_of(used))
    found = agreement(fixes, motion, least_speed, SWING if of_hull else 0.0)
    if as_json:
        print_json(found.as_dict() | {"smoothed": smoothed, "of_hull": of_hull})
        return
    rolls = f"rolls: velocities are compared as {SWING:g} s means, because the estimate is that of the hull"
    how = [("antenna", rolls)] if of_hull else []
    print_pairs([("estimate", which_estimate(smoothed)), *how, *found.sentences()])
    print_notes(fixes.notes)


def _compare_with_truth(path: str, fixes: "Fixes", motion: "Motion", as_json: bool) -> None:
    """Print the errors of the estimate of one vessel as a table."""
    from steerway.commands.plot import DIFFERENCES, difference_rows
    from steerway.formats.results import NamedTrack, read_tracks
    from steerway.report.differences import statistics_table

    if fixes.mmsi is not None:
        raise InputError("--truth compares one vessel, but the log has several; expected a log of one vessel")
    table = statistics_table([read_tracks(path)[0], NamedTrack.of("estimate", motion)])
    if as_json:
        print_json(table)
        return
    print_table(f"errors against {Path(path).name}", DIFFERENCES, difference_rows(table))
    print_notes(fixes.notes)


def predict(
    logs: list[str] = LOGS,
    horizon: list[float] | None = option("S", "Prediction time in s; 600 by default; can be repeated."),
    out: Path | None = option("OUT", "Output file: .csv or .parquet.", None, "-o", "--out"),
    profile: str | None = PROFILE,
    source: str | None = SOURCE,
    aid: str | None = AIDS,
    start: str | None = FROM,
    stop: str | None = UNTIL,
    max_size: float | None = MAX_SIZE,
    as_json: bool = AS_JSON,
) -> None:
    """Predict positions after the end of logs, with 95 % confidence ellipses.

    AIS reports are used with their SOG and COG. Other logs are used with positions alone unless --aid is given.

    Examples:

        steerway predict ais.txt --horizon 600

        steerway predict sortie.nmea --horizon 60 --horizon 120 -o where.csv
    """
    from steerway.estimation.prediction import predict as forecast
    from steerway.formats.writing import write, writer

    if out is not None:
        expect_output(out, logs)
        writer(out, tracks=False)
    horizons = horizon or [600.0]
    fixes = read_logs(logs, source, start, stop, max_size)
    predictions = forecast(fixes, horizons, profile, None if aid is None else aid_names(aid))
    frame = predictions.to_frame()
    if out is not None:
        write(predictions, out)
    if as_json:
        print_json(frame.to_dicts())
    elif out is not None:
        print(f"wrote {out}")
    else:
        _print_predictions(frame)


def _print_predictions(frame: "pl.DataFrame") -> None:
    from steerway.core.timestamps import iso

    vessel = ("mmsi",) if "mmsi" in frame.columns else ()
    rows = [
        (
            *(row[name] for name in vessel),
            iso(round(row["time_s"], 3)),
            f"{row['horizon_s']:.0f} s",
            f"{row['lat_deg']:.5f}°",
            f"{row['lon_deg']:.5f}°",
            f"{row['ellipse95_longer_m']:.0f} × {row['ellipse95_shorter_m']:.0f} m",
            f"{row['ellipse95_direction_deg']:.0f}°",
        )
        for row in frame.iter_rows(named=True)
    ]
    print_table("", (*vessel, "time", "ahead", "latitude", "longitude", "95 % semi-axes", "long axis"), rows)


def _print_summary(summary: dict[str, Any]) -> None:
    from steerway.report.summary import sentences

    print_pairs(sentences(summary))
    print_notes(summary["notes"])
