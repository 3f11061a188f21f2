"""The commands: each does one job and leaves the work to the library. The user's mistakes end in one sentence and 2."""

import json
import math
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from steerway.errors import InputError

profile_app = typer.Typer(no_args_is_help=True, help="List, show and make profiles: what the filter knows of a vessel.")
app = typer.Typer(
    name="steerway",
    help="Speed over ground, course over ground and course rate from GNSS positions alone, and steering by them.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
)


app.add_typer(profile_app, name="profile")


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


def main() -> None:
    """Run the command line."""
    try:
        app(standalone_mode=False)
    except InputError as error:
        print(f"steerway: {error}", file=sys.stderr)
        sys.exit(2)
    except typer.Exit as leaving:
        sys.exit(leaving.exit_code)
    except typer.Abort:
        print("steerway: interrupted", file=sys.stderr)
        sys.exit(130)
    except Exception as error:
        if hasattr(error, "format_message"):  # click's own words for a wrong option
            if error.format_message():  # empty where the help has been shown instead
                print(f"steerway: {error.format_message()}", file=sys.stderr)
            sys.exit(2)
        raise


@app.command()
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
    from steerway.formats.writing import write, writer
    from steerway.report.summary import summarise

    if out is not None:
        writer(out)
        _refuse_overwriting(out, logs)
    if report is not None:
        _refuse_overwriting(report, logs)
        if report.suffix.lower() not in (".html", ".png"):
            raise InputError(f"report {report} ends in {report.suffix or 'nothing'!r}, expected .html or .png")
    aids = _aids(aid)
    fixes = _read(logs, source, start, stop)
    chosen = choose_profile(fixes, profile)
    estimator = FiveStateFilter(chosen, aids)
    motion = estimator.smooth(fixes, rate) if smooth else estimator.filter(fixes, rate)
    summary = summarise(fixes, motion, chosen.name)
    if out is not None:
        write(motion, out)
    if report is not None:
        from steerway.report.motion_page import write_report

        write_report(report, f"Estimate of {', '.join(Path(log).name for log in logs)}", fixes, motion, summary)
    if as_json:
        _print_json(summary)
        return
    _print_summary(summary)
    for written in (out, report):
        if written is not None:
            print(f"wrote {written}")
    if out is None and report is None:
        print("write the estimate with -o track.csv (or .parquet .geojson .gpx), a page with --report page.html")


@app.command()
def info(logs: Logs, as_json: AsJson = False) -> None:
    """Tell what logs hold: sources, sentences, rates, gaps, time span, and what is usable.

    Example:

        steerway info sortie.nmea plotter.n2k
    """
    from steerway.formats.reading import survey

    with _progress("reading") as step:
        found = survey(*logs, progress=lambda done, total: step(done / total if total else 0.0))
    if as_json:
        _print_json([_log_as_dict(log) for log in found])
        return
    for log in found:
        _print_log(log)


@app.command()
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
        _refuse_overwriting(out, logs)
        _expect_toml(out)
    fixes = _read(logs, source, start, stop)
    with _progress("fitting") as step:
        tuned = fit(fixes, name=out.stem if out else "tuned", progress=step)
    if out is not None:
        tuned.profile.save(out)
    if as_json:
        _print_json(tuned.as_dict())
        return
    _print_pairs(tuned.sentences())
    print(f"wrote {out}" if out else "write the profile with -o mine.toml, use it with --profile mine.toml")


@app.command()
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
    from steerway.estimation.comparison import compare as agreement

    fixes = _read(logs, source, start, stop)
    motion = run(fixes, profile, smooth=smooth)
    found = agreement(fixes, motion)
    if as_json:
        _print_json(found.as_dict())
    else:
        _print_pairs(found.sentences())


@profile_app.command("list")
def list_profiles(as_json: AsJson = False) -> None:
    """List the profiles that come with the program.

    Example:

        steerway profile list
    """
    from steerway.estimation.profiles import BUILT_IN

    if as_json:
        _print_json([each.model_dump() for each in BUILT_IN.values()])
    else:
        _print_pairs([(each.name, each.description) for each in BUILT_IN.values()])


@profile_app.command("show")
def show_profile(
    name: Annotated[str, typer.Argument(metavar="NAME|FILE.toml", help="A built-in profile or one of your own.")],
    as_json: AsJson = False,
) -> None:
    """Show a profile as TOML, to be changed and saved as one of your own.

    Example:

        steerway profile show small-usv > mine.toml
    """
    from steerway.estimation.profiles import Profile

    profile = Profile.load(name) if name.endswith(".toml") else Profile.named(name)
    if as_json:
        _print_json(profile.model_dump())
    else:
        print(profile.toml(), end="")


@profile_app.command("make")
def make_profile(
    logs: Logs,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="PROFILE.toml", help="Where to write the profile.")],
    tuned: Annotated[bool, typer.Option("--tune", help="Fit it to the whole log, as `steerway tune` does.")] = False,
    source: Source = None,
    start: From = None,
    stop: Until = None,
) -> None:
    """Make a profile of a vessel and her receiver from logs: the one that `estimate` finds by itself, or a tuned one.

    Examples:

        steerway profile make sortie.nmea -o mine.toml

        steerway profile make sortie.nmea --tune -o mine.toml
    """
    from steerway.estimation import choose_profile
    from steerway.estimation import tune as fit

    _refuse_overwriting(out, logs)
    _expect_toml(out)
    fixes = _read(logs, source, start, stop)
    if tuned:
        with _progress("fitting") as step:
            found = fit(fixes, name=out.stem, progress=step)
        profile = found.profile
        _print_pairs(found.sentences())
    else:
        profile = choose_profile(fixes)
        profile = profile.model_copy(update={"description": profile.name, "name": out.stem})
        _print_pairs([("found", profile.description)])
    profile.save(out)
    print(f"wrote {out}")


@app.command()
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
        _refuse_overwriting(out, logs)
        if out.suffix.lower() not in (".csv", ".parquet"):
            raise InputError(f"{out} ends in {out.suffix or 'nothing'!r}, expected .csv or .parquet")
    horizons = horizon or [600.0]
    frame = forecast(
        _read(logs, source, start, stop), horizons, profile, None if aid is None else _aids(aid)
    ).to_frame()
    if out is not None:
        frame.write_csv(out) if out.suffix.lower() == ".csv" else frame.write_parquet(out)
    if as_json:
        _print_json(frame.to_dicts())
    elif out is not None:
        print(f"wrote {out}")
    else:
        _print_predictions(frame)


@app.command()
def study(
    name: Annotated[str | None, typer.Argument(help="The study; without a name they are listed.")] = None,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Where to write.")] = Path("study"),
    seeds: Annotated[int | None, typer.Option(min=1, help="Repetitions; by default those the study names.")] = None,
    first_seed: Annotated[int, typer.Option(min=0, help="The first of the seeds.")] = 0,
) -> None:
    """Run a study: published numbers beside measured ones, with figures.

    Example:

        steerway study otter-course -o otter
    """
    from steerway import studies
    from steerway.studies.study import write_results

    if name is None:
        _print_pairs([(each, studies.named(each).summary) for each in studies.MODULES])
        return
    chosen = studies.named(name)
    with _progress(name) as step:
        results = chosen.run(seeds, first_seed, lambda share, what="": step(share, what))
    page = write_results(results, out)
    rows = [(each.what, f"{results.numbers[each.key]:.4g} {each.unit}".strip()) for each in results.comparisons]
    _print_pairs(rows)
    for remark in results.remarks:
        print(f"· {remark}")
    print(f"wrote {page}")


def _print_predictions(frame):
    from rich.console import Console
    from rich.table import Table

    from steerway.report.summary import iso

    table = Table(box=None, header_style="bold", pad_edge=False)
    vessel = "mmsi" in frame.columns
    for heading in (*(["mmsi"] if vessel else []), "time", "ahead", "latitude", "longitude", "95 % ellipse", "along"):
        table.add_column(heading, justify="right")
    for row in frame.iter_rows(named=True):
        table.add_row(
            *([str(row["mmsi"])] if vessel else []),
            iso(row["time_s"]),
            f"{row['horizon_s']:.0f} s",
            f"{row['lat_deg']:.5f}°",
            f"{row['lon_deg']:.5f}°",
            f"{row['ellipse95_longer_m']:.0f} × {row['ellipse95_shorter_m']:.0f} m",
            f"{row['ellipse95_direction_deg']:.0f}°",
        )
    Console(width=None if sys.stdout.isatty() else 160).print(table)


def _read(logs, source, start, stop):
    """The record of logs; what was left out or corrected goes to standard error."""
    from steerway.formats.reading import read

    begin, end = _moment("--from", start), _moment("--until", stop)
    with _progress("reading") as step:
        return read(
            *logs,
            source=source,
            start=begin,
            stop=end,
            progress=lambda done, total: step(done / total if total else 0.0),
        )


def _moment(option, text) -> float | None:
    from steerway.formats.timestamps import unix_times

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


def _expect_toml(out):
    if out.suffix != ".toml":
        raise InputError(f"profile {out} ends in {out.suffix or 'nothing'!r}, expected .toml")


def _refuse_overwriting(out, logs):
    from steerway.formats.writing import same_file

    for log in logs:
        if same_file(out, log):
            raise InputError(f"{out} is also an input; expected another place to write to")


@contextmanager
def _progress(what):
    """A bar on standard error while long work goes on, where somebody is looking."""
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty()) as progress:
        task = progress.add_task(what, total=1.0)
        yield lambda share, note="": progress.update(task, completed=share, description=note or what)


def _print_json(value):
    print(json.dumps(_finite(value), ensure_ascii=False, indent=2))


def _finite(value):
    """JSON knows no NaN: unknown is null."""
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _print_summary(summary):
    from steerway.report.summary import sentences

    _print_pairs(sentences(summary))
    for note in summary["notes"]:
        print(f"· {note}")


def _print_pairs(pairs):
    width = max((len(name) for name, _ in pairs), default=0)
    for name, value in pairs:
        print(f"{name:<{width}}  {value}")


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
    from rich.console import Console
    from rich.table import Table

    from steerway.report.summary import iso

    recording = log.recording
    print(f"{log.name}: {recording.format}")
    table = Table(box=None, header_style="bold", pad_edge=False)
    for heading in ("source", "fixes", "rate", "gaps", "longest", "last digit", "from", "until", "says besides"):
        table.add_column(heading)
    for name, q in sorted(log.sources.items(), key=lambda each: -each[1].score):
        table.add_row(
            name,
            str(q.fixes),
            _or_dash(q.rate, "{:.3g} Hz"),
            str(q.gaps),
            f"{q.longest_gap:.1f} s" if q.gaps else "–",
            _or_dash(q.resolution, "{:.3g} m"),
            iso(q.start),
            iso(q.stop),
            ", ".join(q.says) + (f" ({q.vessels} vessels)" if q.vessels else ""),
        )
    console = Console(width=None if sys.stdout.isatty() else 160)
    console.print(table)
    for heading, counts in (("read", recording.counts), ("skipped", recording.skipped)):
        if counts:
            ordered = sorted(counts.items(), key=lambda each: -each[1])
            print(f"  {heading}: " + ", ".join(f"{count} × {what}" for what, count in ordered))
    for note in recording.notes:
        print(f"  · {note}")


def _or_dash(value, form):
    return form.format(value) if math.isfinite(value) else "–"
