"""The commands for logs: estimate, info, tune, compare, predict."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from steerway.commands.terminal import print_json, print_pairs, print_table, progress_line
from steerway.core.errors import InputError


def _hertz(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"--rate {text!r} is no number, expected Hz") from None


Logs = Annotated[list[str], typer.Argument(metavar="LOG...", help="Logs of any known format, also .gz; - is stdin.")]
Source = Annotated[str | None, typer.Option("--source", metavar="NAME", help="Take positions from this source.")]
From = Annotated[str | None, typer.Option("--from", metavar="TIME", help="Begin here: ISO 8601 (UTC) or Unix s.")]
Until = Annotated[str | None, typer.Option("--until", metavar="TIME", help="End before: ISO 8601 (UTC) or Unix s.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print for machines.")]
ProfileName = Annotated[
    str | None, typer.Option("--profile", metavar="NAME|FILE.toml", help="Tuning; by default found from the log.")
]
Aids = Annotated[
    str | None,
    typer.Option("--aid", metavar="LIST", help="Use also, of: sog, cog, heading, water-speed, yaw-rate."),
]


def estimate(
    logs: Logs,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="OUT", help="Write .csv, .parquet, .geojson or .gpx.")
    ] = None,
    report: Annotated[Path | None, typer.Option(metavar="PAGE", help="Write a page (.html) or picture (.png).")] = None,
    rate: Annotated[
        float | None, typer.Option(metavar="HZ", parser=_hertz, help="Rows a second; by default a row a fix.")
    ] = None,
    smooth: Annotated[bool, typer.Option("--smooth", help="Let every row know the whole record.")] = False,
    profile: ProfileName = None,
    source: Source = None,
    aid: Aids = None,
    no_accuracy: Annotated[
        bool, typer.Option("--no-accuracy", help="Take all fixes alike, whatever the receiver says of their accuracy.")
    ] = False,
    latency: Annotated[
        float, typer.Option("--latency", metavar="S", help="How late the log's times of position, SOG and COG are.")
    ] = 0.0,
    start: From = None,
    stop: Until = None,
    as_json: AsJson = False,
) -> None:
    """Estimate SOG, COG and course rate from the positions in logs.

    Examples:

        steerway estimate sortie.nmea -o track.csv --report page.html

        steerway estimate day1.ubx.gz day2.ubx.gz --smooth --rate 10 -o track.parquet

        cat ais.txt | steerway estimate - -o vessels.parquet
    """
    from steerway.estimation import FiveStateFilter, choose_profile
    from steerway.estimation.course.latency import lateness, on_time
    from steerway.estimation.course.replay import variance_scales
    from steerway.formats.writing import write, writer
    from steerway.report.summary import summarise

    if out is not None:
        writer(out)
        refuse_overwriting(out, logs)
    if report is not None:
        refuse_overwriting(report, logs)
        if report.suffix.lower() not in (".html", ".png"):
            raise InputError(f"report {report} ends in {report.suffix or 'nothing'!r}, expected .html or .png")
    aids = _aids(aid)
    fixes = on_time(read_logs(logs, source, start, stop), latency)
    if no_accuracy:
        fixes = replace(fixes, position_std=None)
    chosen = choose_profile(fixes, profile, aids)
    estimator = FiveStateFilter(chosen, aids)
    motion = estimator.smooth(fixes, rate) if smooth else estimator.filter(fixes, rate)
    late = lateness(fixes, chosen)
    summary = summarise(fixes, motion, chosen.name, int((variance_scales(fixes) > 1.0).sum()), late.sog, late.cog)
    if out is not None:
        write(motion, out)
    if report is not None:
        from steerway.report.motion_page import write_report

        write_report(report, f"Estimate of {', '.join(Path(log).name for log in logs)}", fixes, motion, summary)
    if as_json:
        print_json(summary)
        return
    _print_summary(summary)
    for written in (out, report):
        if written is not None:
            print(f"wrote {written}")
    if out is None and report is None:
        print("write the estimate with -o track.csv (or .parquet .geojson .gpx), a page with --report page.html")


def info(logs: Logs, as_json: AsJson = False) -> None:
    """Tell what logs hold: sources, sentences, rates, gaps, time span, and what is usable.

    Example:

        steerway info sortie.nmea plotter.n2k
    """
    from steerway.formats.reading import survey

    with progress_line("reading") as step:
        found = survey(*logs, progress=lambda done, total: step(done / total if total else 0.0))
    if as_json:
        print_json([_log_as_dict(log) for log in found])
        return
    for log in found:
        _print_log(log)


def tune(
    logs: Logs,
    out: Annotated[Path | None, typer.Option("-o", "--out", metavar="PROFILE.toml", help="Write the profile.")] = None,
    source: Source = None,
    start: From = None,
    stop: Until = None,
    as_json: AsJson = False,
) -> None:
    """Fit a profile to logs by maximum likelihood, and tell how consistent it is.

    Example:

        steerway tune sortie.nmea -o mine.toml && steerway estimate sortie.nmea --profile mine.toml -o track.csv
    """
    from steerway.estimation import tune as fit

    if out is not None:
        refuse_overwriting(out, logs)
        expect_toml(out)
    fixes = read_logs(logs, source, start, stop)
    with progress_line("fitting") as step:
        tuned = fit(fixes, name=out.stem if out else "tuned", progress=step)
    if out is not None:
        tuned.profile.save(out)
    if as_json:
        print_json(tuned.as_dict())
        return
    print_pairs(tuned.sentences())
    print(f"wrote {out}" if out else "write the profile with -o mine.toml, use it with --profile mine.toml")


def compare(
    logs: Logs,
    smooth: Annotated[bool, typer.Option("--smooth", help="Compare the smoothed estimate.")] = False,
    profile: ProfileName = None,
    source: Source = None,
    start: From = None,
    stop: Until = None,
    as_json: AsJson = False,
) -> None:
    """Set our estimate beside the receiver's own SOG and COG (which are filtered and late: no truth).

    Example:

        steerway compare sortie.nmea --smooth
    """
    from steerway.estimation import estimate as run
    from steerway.estimation.course.comparison import compare as agreement

    fixes = read_logs(logs, source, start, stop)
    motion = run(fixes, profile, smooth=smooth)
    found = agreement(fixes, motion)
    if as_json:
        print_json(found.as_dict())
    else:
        print_pairs(found.sentences())


def predict(
    logs: Logs,
    horizon: Annotated[
        list[float] | None, typer.Option("--horizon", metavar="S", help="Seconds ahead; may be given more than once.")
    ] = None,
    out: Annotated[Path | None, typer.Option("-o", "--out", metavar="OUT", help="Write .csv or .parquet.")] = None,
    profile: ProfileName = None,
    source: Source = None,
    aid: Aids = None,
    start: From = None,
    stop: Until = None,
    as_json: AsJson = False,
) -> None:
    """Predict where vessels will be after the end of logs, with the ellipse that holds them in 95 of 100 cases.

    AIS reports are used with the SOG and COG that they transmit, other logs with positions alone unless --aid is given.

    Examples:

        steerway predict ais.txt --horizon 600

        steerway predict sortie.nmea --horizon 60 --horizon 120 -o where.csv
    """
    from steerway.estimation.prediction import predict as forecast

    if out is not None:
        refuse_overwriting(out, logs)
        if out.suffix.lower() not in (".csv", ".parquet"):
            raise InputError(f"{out} ends in {out.suffix or 'nothing'!r}, expected .csv or .parquet")
    horizons = horizon or [600.0]
    frame = forecast(
        read_logs(logs, source, start, stop), horizons, profile, None if aid is None else _aids(aid)
    ).to_frame()
    if out is not None:
        frame.write_csv(out) if out.suffix.lower() == ".csv" else frame.write_parquet(out)
    if as_json:
        print_json(frame.to_dicts())
    elif out is not None:
        print(f"wrote {out}")
    else:
        _print_predictions(frame)


def _print_predictions(frame):
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
    print_table("", (*vessel, "time", "ahead", "latitude", "longitude", "95 % ellipse", "along"), rows)


def expect_toml(path: Path) -> None:
    """Raises InputError for a profile's path that does not end in .toml."""
    if path.suffix != ".toml":
        raise InputError(f"profile {path} ends in {path.suffix or 'nothing'!r}, expected .toml")


def read_logs(logs, source, start, stop):
    """The record of logs; what was left out or corrected goes to standard error."""
    from steerway.formats.reading import read

    begin, end = _moment("--from", start), _moment("--until", stop)
    with progress_line("reading") as step:
        return read(
            *logs,
            source=source,
            start=begin,
            stop=end,
            progress=lambda done, total: step(done / total if total else 0.0),
        )


def _moment(option, text) -> float | None:
    from steerway.core.timestamps import unix_times

    if text is None:
        return None
    try:
        return float(text)
    except ValueError:
        moment = float(unix_times([text])[0])
    if math.isnan(moment):
        raise InputError(
            f"{option} {text!r} is no time, expected ISO 8601 such as 2024-09-23T14:26:10Z or Unix seconds"
        )
    return moment


def _aids(text) -> tuple[str, ...]:
    return tuple(name.strip().replace("-", "_") for name in text.split(",") if name.strip()) if text else ()


def refuse_overwriting(out, logs) -> None:
    """Raises InputError when an output is one of the inputs."""
    from steerway.formats.writing import same_file

    for log in logs:
        if same_file(out, log):
            raise InputError(f"{out} is also an input; expected another place to write to")


def _print_summary(summary):
    from steerway.report.summary import sentences

    print_pairs(sentences(summary))
    for note in summary["notes"]:
        print(f"· {note}")


def _log_as_dict(log):
    from dataclasses import asdict

    recording = log.recording
    return {
        "log": log.name,
        "format": recording.format,
        "sources": {name: asdict(quality) for name, quality in log.sources.items()},
        "counts": recording.counts,
        "skipped": recording.skipped,
        "notes": list(recording.notes),
    }


def _print_log(log):
    from steerway.core.timestamps import iso

    recording = log.recording
    columns = ("source", "fixes", "rate", "gaps", "longest", "last digit", "from", "until", "says besides")
    rows = []
    for name, q in sorted(log.sources.items(), key=lambda each: -each[1].score):
        vessels = f" ({q.vessels} vessels)" if q.vessels else ""
        longest = f"{q.longest_gap:.1f} s" if q.gaps else "–"
        rate, resolution = _or_dash(q.rate, "{:.3g} Hz"), _or_dash(q.resolution, "{:.3g} m")
        span = [iso(round(time, 3)) if math.isfinite(time) else "–" for time in (q.start, q.stop)]
        rows.append((name, q.fixes, rate, q.gaps, longest, resolution, *span, ", ".join(q.says) + vessels))
    print_table(f"{log.name}: {recording.format}", columns, rows)
    for heading, counts in (("read", recording.counts), ("skipped", recording.skipped)):
        if counts:
            ordered = sorted(counts.items(), key=lambda each: -each[1])
            print(f"  {heading}: " + ", ".join(f"{count} × {what}" for what, count in ordered))
    for note in recording.notes:
        print(f"  · {note}")


def _or_dash(value, form):
    return form.format(value) if math.isfinite(value) else "–"
