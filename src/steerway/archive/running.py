"""`run`: make an archive of estimates from files of reports; finished units are not run again."""

import errno
import os
import shutil
from collections.abc import Callable, Iterable
from contextlib import closing
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

from steerway.archive import inputs, page
from steerway.archive.levels import levels, profile_names
from steerway.archive.store import Store, date_of, left_out_of, units_in
from steerway.archive.tables import write_unfinished_trips
from steerway.archive.unit import LOOKAHEAD, Work, run_unit
from steerway.core.errors import InputError
from steerway.core.files import made_directory
from steerway.core.kernel_cache import source_digest
from steerway.core.locks import LOCK, only_writer
from steerway.core.workers import run_chains
from steerway.estimation.vessel.profile import Profile

UNIT_ROWS = 400_000
"""Target number of rows per unit; below 200,000, reading and writing cost more than filtering."""
_BYTES_A_ROW, _BYTES_A_WORKER = 700, 250e6
"""Memory per row of a unit, and memory of an idle worker, bytes."""
Tell = Callable[[float, str], None]
"""Called with the fraction done (0 to 1) and the current step."""
_MOST_LOSSES = 3
"""Number of lost workers after which a unit is given up, together with the later days of its bucket."""
_AIDS = ("sog", "cog", "heading")
_SETTINGS = ("version", "kernels", "buckets", "profiles", "aid", "smooth", "rate")


class DiskFull(InputError):
    """The disk is full. Finished units are kept, and the next run continues."""


@dataclass
class Report:
    """Result of a run: new `inputs`, and `rows` and `units` of this run; `units_before` were done before it.

    left_out: rows left out of all inputs, by reason. failed: reasons by input. given_up: units whose workers were lost.
    """

    directory: Path
    inputs: int = 0
    rows: int = 0
    units: int = 0
    units_before: int = 0
    left_out: dict[str, int] = field(default_factory=dict)
    failed: dict[str, str] = field(default_factory=dict)
    given_up: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def complete(self) -> bool:
        """Whether every input was read and every unit run."""
        return not self.failed and not self.given_up


def run(
    paths: Iterable[str | Path],
    directory: str | Path,
    *,
    buckets: int | None = None,
    memory: float = 4e9,
    workers: int | None = None,
    scheduler: str | None = None,
    smooth: bool = False,
    rate: float | None = None,
    aid: tuple[str, ...] = (),
    profile: Profile | None = None,
    vessel_column: str | None = None,
    strict: bool = False,
    progress: Tell | None = None,
) -> Report:
    """Estimate SOG, COG and course rate of every vessel in files of reports, a day and a bucket of vessels at a time.

    Repeating a call continues where the last one ended. New files are added, and the units they affect are run again.

    Args:
        paths: files, folders and patterns: AIS tables (CSV, Parquet, GeoParquet; .gz, .zip, .zst), and any log that
            `steerway.read` reads. directory: of the archive.
        buckets: number of groups of vessels; None: chosen from the size of the inputs and `memory` (bytes).
        workers: processes; None: as many as cores and memory allow. scheduler: address of a Dask cluster instead.
        smooth: use later fixes too, up to an hour into the next day. rate: output rate (Hz); None: a row per report.
        aid: any of "sog", "cog", "heading". profile: for all vessels; None: the profile of each vessel's class.
        vessel_column: column with the vessel ID (text or number), in every table of `paths`.
        strict: stop at an input that cannot be read. progress: called with the fraction done and the current step.

    Raises InputError for wrong arguments, an archive made with other settings or being written by another process and,
    if `strict`, an input that cannot be read; DiskFull if the disk is full.
    """
    for name in aid:
        if name not in _AIDS:
            raise InputError(f"aid {name!r} is unknown, expected some of {', '.join(_AIDS)}")
    if profile is not None and profile.structures and smooth:
        raise InputError(f"profile {profile.name} has structures, expected one of flat keys to smooth an archive")
    if rate is not None and not 1e-6 <= rate <= 10.0:
        raise InputError(f"rate is {rate}, expected Hz between 1e-6 and 10")
    for name, value in (("buckets", buckets), ("workers", workers)):
        if value is not None and not 1 <= value <= 4096:
            raise InputError(f"{name} is {value}, expected 1 to 4096")
    if not memory >= 5e8:
        raise InputError(f"memory is {memory / 1e9:g} GB, expected at least 0.5 GB")
    tell = progress or (lambda part, what: None)
    files = inputs.found(paths)
    store = Store(made_directory(directory))
    workers = workers or max(1, min(os.cpu_count() or 1, int(memory / 6e8)))
    if not store.manifest_path.exists() and any(each.name != LOCK for each in store.root.iterdir()):
        raise InputError(f"{store.root} is not empty and holds no archive, expected a new or an empty directory")
    profiles = [[each.model_dump(mode="json") for each in some] for some in levels(profile)]
    wanted = {"profiles": profiles, "aid": list(aid), "smooth": smooth, "rate": rate}
    with only_writer(store.root, f"the archive {store.root}"):
        manifest = _manifest(store, wanted, buckets, lambda: _bucket_count(files, memory, workers))
        try:
            report = Report(store.root)
            store.remove_unfinished()
            _forget_orphans(store, manifest)
            _stage(store, manifest, files, vessel_column, strict, report, tell)
            _run_units(store, manifest, workers, scheduler, report, tell)
            write_unfinished_trips(store)
            page.write(store, manifest)
        except (InputError, OSError) as error:
            if isinstance(error, DiskFull) or os.strerror(errno.ENOSPC) not in str(error):
                raise
            store.remove_unfinished()
            raise DiskFull(f"{directory}: disk full; finished work is kept, the same command continues") from None
    return report


def _manifest(
    store: Store, wanted: dict[str, Any], buckets: int | None, choose_buckets: Callable[[], int]
) -> dict[str, Any]:
    """The manifest, read or created. Raises InputError if its settings differ from `wanted`."""
    wanted |= {"version": version("steerway"), "kernels": source_digest("steerway.archive.unit")}
    if not store.manifest_path.exists():
        wanted["buckets"] = buckets or choose_buckets()
        manifest = {name: wanted[name] for name in _SETTINGS} | {"inputs": {}}
        store.write_manifest(manifest)
        return manifest
    manifest = store.manifest()
    wanted["buckets"] = buckets or manifest.get("buckets")
    for name in _SETTINGS:
        if manifest.get(name) != wanted[name]:
            if name in ("version", "kernels"):
                raise InputError(
                    f"{store.root} was made by another version of steerway, whose results differ: expected another "
                    "directory"
                )
            shown = (manifest.get(name), wanted[name]) if name != "profiles" else (profile_names(manifest), "others")
            raise InputError(
                f"{store.root} was made with {name} {shown[0]!r}, not {shown[1]!r}: expected the same settings, or "
                "another directory"
            )
    return manifest


def _bucket_count(files: list[Path], memory: float, workers: int) -> int:
    rows = max(map(inputs.rows_in, files))
    room = max(memory / workers - _BYTES_A_WORKER, 1e8) / _BYTES_A_ROW
    return max(1, min(round(rows / UNIT_ROWS), 256), int(-(-rows // room)))


def _forget_orphans(store: Store, manifest: dict[str, Any]) -> None:
    """Remove staged reports of inputs that are not in the manifest: a run was killed before it added them."""
    known = {each["sha256"][:16] for each in manifest["inputs"].values()}
    for directory in (store.root / "staged").glob("[!.]*"):
        if directory.name not in known:
            _undo(store, manifest, units_in(directory.glob("day=*/bucket=*")))
            shutil.rmtree(directory)


def _undo(store: Store, manifest: dict[str, Any], touched: Iterable[tuple[int, int]]) -> set[tuple[int, int]]:
    """Undo the units that depend on reports in `touched` (day, bucket): same bucket, that day and later ones."""
    first: dict[int, int] = {}
    for day, bucket in touched:
        first[bucket] = min(day, first.get(bucket, day))
    looks_ahead = 1 if manifest["smooth"] or manifest["rate"] else 0
    undone = {unit for unit in store.done() if unit[1] in first and unit[0] >= first[unit[1]] - looks_ahead}
    for day, bucket in sorted(undone, reverse=True):
        store.undo(day, bucket)
    return undone


def _stage(
    store: Store,
    manifest: dict[str, Any],
    files: list[Path],
    vessel_column: str | None,
    strict: bool,
    report: Report,
    tell: Tell,
) -> None:
    """Sort the reports of every input that is new or has changed by day and bucket."""
    known = manifest["inputs"]
    for i, path in enumerate(files):
        tell(0.3 * i / len(files), f"sorting {path.name}")
        name = str(path.resolve())
        try:
            this = inputs.identity(path, known.get(name))
        except InputError as error:
            _fail(report, path, error, strict)
            continue
        this["vessel_column"] = vessel_column
        if name in known and all(known[name][each] == this[each] for each in ("sha256", "vessel_column")):
            known[name] |= this
            continue
        key = this["sha256"][:16]
        same = next((other for other, each in known.items() if each["sha256"] == this["sha256"]), None)
        if same is not None and same != name:
            report.notes.append(f"{path.name} has the same content as {Path(same).name} and is left out")
            continue
        try:
            part, entry = inputs.stage(path, store, key, manifest["buckets"], vessel_column)
        except (InputError, OSError) as error:
            shutil.rmtree(store.root / "staged" / f".{key}.part", ignore_errors=True)
            if os.strerror(errno.ENOSPC) in str(error):
                raise
            _fail(report, path, error, strict)
            continue
        touched = units_in(part.glob("day=*/bucket=*"))
        if name in known:
            old = store.staged_directory(known[name]["sha256"][:16])
            touched |= units_in(old.glob("day=*/bucket=*"))
        undone = _undo(store, manifest, touched)
        if undone:
            days = sorted({day for day, _ in undone})
            verb = "has changed" if name in known else "is new"
            report.notes.append(f"{path.name} {verb}: {len(undone)} units from {date_of(days[0])} on are run again")
        if name in known:
            shutil.rmtree(old, ignore_errors=True)
        target = store.staged_directory(key)
        shutil.rmtree(target, ignore_errors=True)
        part.rename(target)
        known[name] = this | entry
        store.write_manifest(manifest)
        report.inputs += 1
    store.write_manifest(manifest)
    report.left_out = dict(left_out_of(manifest))


def _fail(report: Report, path: Path, error: Exception, strict: bool) -> None:
    why = str(error).removeprefix(f"{path}: ")
    if strict:
        raise InputError(f"{path}: {why}") from None
    report.failed[str(path)] = why


def chains(store: Store, manifest: dict[str, Any]) -> list[list[Work]]:
    """The units still to be run: one list per bucket, in order of days."""
    done = store.done()
    digits = {each["sha256"][:16]: each["digit_deg"] for each in manifest["inputs"].values()}
    of_bucket: dict[int, list[int]] = {}
    for day, bucket in store.staged_units():
        of_bucket.setdefault(bucket, []).append(day)
    found = []
    for bucket, days in sorted(of_bucket.items()):
        todo = next((i for i, day in enumerate(days) if (day, bucket) not in done), len(days))
        found.append(
            [
                Work(
                    str(store.root.resolve()),
                    days[i],
                    bucket,
                    days[i - 1] if i else None,
                    digits,
                    **{name: manifest[name] for name in ("profiles", "aid", "smooth", "rate")},
                )
                for i in range(todo, len(days))
            ]
        )
    return found


def _run_units(
    store: Store, manifest: dict[str, Any], workers: int, scheduler: str | None, report: Report, tell: Tell
) -> None:
    todo = [chain for chain in chains(store, manifest) if chain]
    count = sum(map(len, todo))
    report.units_before = len(store.done())
    team = max(min(workers, len(todo)), 1)
    outcomes = run_chains(run_unit, todo, team, scheduler, "--scheduler", _MOST_LOSSES)
    with closing(outcomes):
        for (chain, place), numbers in outcomes:
            work = todo[chain][place]
            unit = f"{date_of(work.day)} bucket {work.bucket:02d}"
            if numbers is None:
                report.given_up.append(unit)
                continue
            report.units += 1
            report.rows += numbers["rows"]
            tell(0.3 + 0.7 * report.units / count, unit)
    if manifest["smooth"]:
        report.notes.append(
            f"smoothed with later fixes, up to {LOOKAHEAD / 3600:g} h of the next day; "
            "smoothing does not cross gaps above 30 min"
        )
