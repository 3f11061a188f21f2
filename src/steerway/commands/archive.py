"""The commands for archives: archive run, status, verify, export; encounters."""

import re
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from steerway.commands.options import AIDS_OF_ARCHIVES, ARCHIVE_AIDS, FROM, aid_names, moment
from steerway.commands.terminal import (
    argument,
    flag,
    option,
    print_json,
    print_notes,
    print_pairs,
    print_table,
    progress_line,
)
from steerway.core.errors import InputError, printable

if TYPE_CHECKING:
    import polars as pl

    from steerway.archive.running import Report


app = typer.Typer(
    help="Estimate archives of many vessels and days, such as the AIS of a country or the logs of a fleet.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
INCOMPLETE, DISK_FULL = 3, 4
"""Exit codes: INCOMPLETE if an input or a unit was left out, DISK_FULL if the disk is full."""
DIRECTORY = argument("DIR", "Directory of the archive.")


@app.command()
def run(
    inputs: list[str] = argument(
        "IN...", "Files, folders or patterns: AIS tables (CSV, Parquet, GeoParquet; also compressed), raw AIS, logs."
    ),
    out: Path = option("DIR", "Directory of the archive.", ..., "-o", "--out"),
    buckets: int | None = option(
        "N", "Number of groups of vessels; by default chosen from the size of the inputs and --memory."
    ),
    memory: str = option("SIZE", "Total memory of all processes, such as 4GB.", "4GB"),
    workers: int | None = option("N", "Number of processes; by default one per core."),
    scheduler: str | None = option("URL", "Scheduler of a Dask cluster to run on."),
    smooth: bool = flag("--smooth", "Smooth: each row also uses later fixes, up to one hour into the next day."),
    rate: float | None = option("HZ", "Output rate in Hz; by default one row per report."),
    aid: str | None = ARCHIVE_AIDS,
    profile: str | None = option("NAME|FILE.toml", "Filter profile; by default chosen by the vessel's AIS class."),
    vessel_column: str | None = option("NAME", "Table column with the vessel ID, used in place of the MMSI."),
    strict: bool = flag("--strict", "Stop at an input that cannot be read."),
    as_json: bool = flag("--json", "JSON output."),
) -> None:
    """Estimate all vessels of an archive. The same command resumes an interrupted run, and adds new inputs.

    Exit code 3: an input, or a unit (the vessels of one group on one day), was left out; 4: the disk is full.

    Example:

        steerway archive run aisdk-2024-03-*.zip -o march
    """
    from steerway.archive.running import DiskFull
    from steerway.archive.running import run as run_archive
    from steerway.commands import interruption
    from steerway.estimation.vessel.profile import profile_of

    interruption.note = "finished work is kept, the same command continues"
    try:
        with progress_line("archive") as step:
            report = run_archive(
                inputs,
                out,
                buckets=buckets,
                memory=_bytes(memory),
                workers=workers,
                scheduler=scheduler,
                smooth=smooth,
                rate=rate,
                aid=aid_names(aid, AIDS_OF_ARCHIVES),
                profile=None if profile is None else profile_of(profile),
                vessel_column=vessel_column,
                strict=strict,
                progress=step,
            )
    except DiskFull as error:
        typer.echo(f"steerway: {error}", err=True)
        raise typer.Exit(DISK_FULL) from None
    if as_json:
        print_json(vars(report) | {"directory": str(report.directory)})
    else:
        _print_report(report)
        print(f"wrote {out / 'index.html'}")
    for path, why in report.failed.items():
        typer.echo(printable(f"steerway: {path}: left out, {why}"), err=True)
    for unit in report.given_up:
        typer.echo(f"steerway: {unit}: left out, its worker was killed three times (is memory short?)", err=True)
    if not report.complete:
        raise typer.Exit(INCOMPLETE)


def _print_report(report: "Report") -> None:
    print_pairs(
        [
            ("inputs read", f"{report.inputs:,}"),
            ("units run", f"{report.units:,}, {report.units_before:,} were already done"),
            ("rows", f"{report.rows:,}"),
            *((f"left out: {reason}", f"{count:,}") for reason, count in sorted(report.left_out.items())),
        ]
    )
    print_notes(report.notes)


@app.command()
def status(directory: Path = DIRECTORY, as_json: bool = flag("--json", "JSON output.")) -> None:
    """Show the inputs and settings of an archive, what is done and what is still to be done.

    Example:

        steerway archive status march
    """
    from steerway.archive.reading import status as status_of

    found = status_of(directory)
    if as_json:
        print_json(found)
        return
    print_pairs([(name, found[name]) for name in ("settings", "inputs", "days", "units", "rows", "reports")])
    columns = ("input", "rows", "last digit of positions", "rows left out")
    rows = [
        (
            each["input"],
            f"{each['rows']:,}",
            f"{each['digit_deg']:.2g}°, coarse" if each["digit_deg"] else "fine",
            ", ".join(f"{n:,} × {why}" for why, n in each["left_out"].items()),
        )
        for each in found["files"]
    ]
    print_table("", columns, rows)
    named = {(name, number) for each in found["files"] for name, number in each["vessels"].items()}
    if named:
        print_table("Vessels identified by name", ("name", "number in the column mmsi"), sorted(named))


@app.command()
def verify(directory: Path = DIRECTORY) -> None:
    """Read all results and print one digest of them. Archives with equal results have equal digests.

    Example:

        steerway archive verify march
    """
    from steerway.archive.reading import digest

    with progress_line("verifying") as step:
        found, rows = digest(directory, step)
    print(f"{found}  {rows:,} rows")


@app.command()
def export(
    directory: Path = DIRECTORY,
    out: Path = argument("FILE", "Output file: .parquet (GeoParquet), .geojson or .csv."),
    mmsi: list[int] | None = option("N", "MMSI of a vessel; can be repeated."),
    bbox: str | None = option("W,S,E,N", "Bounding box: west, south, east and north limit, in degrees."),
    start: str | None = FROM,
    stop: str | None = option("TIME", "End of the interval (excluded): ISO 8601 or Unix s.", None, "--to", "--until"),
) -> None:
    """Write the estimates of selected vessels, of a box or of a time interval to a file.

    Example:

        steerway archive export march ferry.geojson --mmsi 219000001 --from 2024-03-02T06:00:00Z
    """
    from steerway.archive.reading import export as export_rows

    count = export_rows(directory, out, mmsi or (), _box(bbox), moment("--from", start), moment("--to", stop))
    print(f"wrote {out}: {count:,} rows")


def encounters(
    directory: Path = DIRECTORY,
    distance: float = option("M", "Largest CPA to report, m.", 1852.0),
    out: Path | None = option("OUT", "Output file: .csv or .parquet.", None, "-o", "--out"),
    as_json: bool = flag("--json", "JSON output."),
) -> None:
    """Find encounters in an archive: the closest points of approach (CPA) of pairs of vessels, with their 1σ.

    Example:

        steerway encounters march --distance 500 -o encounters.csv
    """
    from steerway.archive.encounters import encounters as find
    from steerway.core.files import complete_or_absent

    if out is not None and out.suffix not in (".csv", ".parquet"):
        raise InputError(f"{str(out)!r} has an unknown ending, expected .csv or .parquet")
    with progress_line("encounters") as step:
        found = find(directory, distance, step)
    if out is not None:
        with complete_or_absent(out) as file:
            found.write_csv(file) if out.suffix == ".csv" else found.write_parquet(file)
        print(f"wrote {out}: {len(found):,} encounters")
    elif as_json:
        print_json(found.to_dicts())
    else:
        _print_encounters(found)


def _print_encounters(found: "pl.DataFrame") -> None:
    from steerway.core.timestamps import iso

    rows = [
        (
            row["mmsi_a"],
            row["mmsi_b"],
            iso(round(row["cpa_time_s"])),
            f"{row['cpa_m']:.0f} ± {row['cpa_std_m']:.0f} m",
            f"{row['tcpa_s']:.0f} s",
            f"{row['relative_speed_mps']:.1f} m/s",
        )
        for row in found.sort("cpa_m").head(50).iter_rows(named=True)
    ]
    print_table(
        f"{len(found):,} encounters", ("vessel", "vessel", "time of CPA", "CPA", "TCPA", "relative speed"), rows
    )


def _bytes(text: str) -> float:
    match = re.fullmatch(r"\s*([0-9]+(?:\.[0-9]+)?)\s*([kMGT]?)i?B?\s*", text, re.IGNORECASE)
    if match is None:
        raise InputError(f"--memory is {text!r}, expected a size such as 4GB")
    return float(match[1]) * {"": 1.0, "K": 1e3, "M": 1e6, "G": 1e9, "T": 1e12}[match[2].upper()]


def _box(text: str | None) -> tuple[float, float, float, float] | None:
    if text is None:
        return None
    try:
        west, south, east, north = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--bbox is {text!r}, expected west,south,east,north in degrees") from None
    return west, south, east, north
