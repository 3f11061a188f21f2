"""A generated archive of AIS, 500 ships in three days: CPU a row, memory, equal digests, ships and jumps found."""

import contextlib
import importlib.util
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import polars as pl

from benchmarks.support.fleet import day_path, generate
from benchmarks.support.harness import Result
from benchmarks.support.seconds import by_seconds
from steerway.archive import run as run_archive
from steerway.archive import scan
from steerway.archive.verifying import digest
from steerway.core.records import Fixes
from steerway.estimation import FiveStateFilter
from steerway.estimation.course.replay import run_rows

_SHIPS, _DAYS, _SEED = 540, 3, 7
_FEW = 50  # ships for what takes long
_COMPARED = 20_000  # rows given to movingpandas


def run():
    with tempfile.TemporaryDirectory(prefix="steerway-archive-") as place:
        place = Path(place)
        rows = generate(place / "all", _SHIPS, _DAYS, _SEED)
        generate(place / "few", _FEW, _DAYS, _SEED + 1)
        yield from _filter(place / "few")
        yield from _movingpandas(place / "few")
        yield from _throughput(place, rows)
        yield from _memory(place)
        yield from _digests(place)
        yield from _found(place / "all", place / "csv")


def _reports(directory):
    truth = pl.read_parquet(directory / "truth.parquet").filter(pl.col("ship") >= 0, pl.col("lat_deg") < 91.0)
    truth = truth.sort("ship", "time_s").unique(["ship", "time_s"], keep="first", maintain_order=True)
    angles = np.radians(truth["lat_deg"].to_numpy()), np.radians(truth["lon_deg"].to_numpy())
    return Fixes(truth["time_s"].to_numpy(), *angles, mmsi=truth["ship"].to_numpy().astype(np.int64))


def _taken(work):
    work()
    best = np.inf
    for _ in range(3):
        start = time.process_time()
        found = work()
        best = min(best, time.process_time() - start)
    return best, found


def _filter(directory):
    """The filter on its own, against steps of a second."""
    fixes, estimator = _reports(directory), FiveStateFilter("ais")
    parameters = estimator.profile.parameters()
    ours, found = _taken(lambda: run_rows(parameters, (), fixes))
    steps, (estimate, status) = _taken(lambda: by_seconds(fixes, parameters))
    yield Result("filter, mean interval 35 s", 1e9 * ours / len(fixes), "ns a fix")
    yield Result("… fixes a second of a core", len(fixes) / ours, "1/s", at_least=1.1e6)
    yield Result("… steps of 1 s / few steps", steps / ours, "times", note="with step terms kept in both")
    alike = found.status == status
    yield Result("… the same status", 100.0 * alike.mean(), "%", at_least=99.99)
    both = alike & np.isfinite(estimate[:, 3])
    away = np.abs(estimate[both, 2] - found.estimate[both, 2]) / found.estimate[both, 5]
    turned = np.abs(np.angle(np.exp(1j * (estimate[both, 3] - found.estimate[both, 3])))) / found.estimate[both, 6]
    yield Result("… SOG and COG within 0.01 σ", 100.0 * (np.maximum(away, turned) < 0.01).mean(), "%", at_least=99.99)
    some = fixes.rows(fixes.mmsi < 10)
    smoothing, _ = _taken(lambda: estimator.smooth(some))
    yield Result("smoothing", 1e6 * smoothing / len(some), "µs a fix", at_most=10.0)


def _movingpandas(directory):
    """The same 20,000 rows through `add_speed` and `add_direction`."""
    if importlib.util.find_spec("movingpandas") is None:
        yield Result("movingpandas / ours, 20,000 rows", None, note="movingpandas is not installed")
        return
    import geopandas
    import movingpandas
    import pandas

    fixes = _reports(directory).rows(slice(0, _COMPARED))
    degrees = np.degrees(fixes.longitude), np.degrees(fixes.latitude)
    frame = geopandas.GeoDataFrame(
        {"t": pandas.to_datetime(fixes.time, unit="s"), "mmsi": fixes.mmsi},
        geometry=geopandas.points_from_xy(*degrees),
        crs=4326,
    )

    def theirs():
        tracks = movingpandas.TrajectoryCollection(frame, "mmsi", t="t")
        tracks.add_speed(overwrite=True)
        tracks.add_direction(overwrite=True)

    ours, _ = _taken(lambda: FiveStateFilter("ais").filter(fixes))
    start = time.process_time()
    theirs()
    yield Result("movingpandas / ours, 20,000 rows", (time.process_time() - start) / ours, "times")


def _throughput(place, rows):
    """CSV and Parquet to an archive, in one process."""
    csv = [day_path(place / "all", day) for day in range(_DAYS)]
    warm = [day_path(place / "few", 0)]
    run_archive(warm, place / "warm", workers=1)
    start = time.process_time()
    run_archive(csv, place / "csv", workers=1)
    yield Result("Danish CSV to archive", 1e6 * (time.process_time() - start) / rows, "µs a row", at_most=4.0)
    parquet = [place / f"{path.stem}.parquet" for path in csv]
    for source, target in zip(csv, parquet, strict=True):
        table = pl.scan_csv(source, infer_schema_length=10_000)
        stamp = pl.col("# Timestamp").str.to_datetime("%d/%m/%Y %H:%M:%S")
        table.with_columns(stamp).sink_parquet(target)
    start = time.process_time()
    run_archive(parquet, place / "parquet", workers=1)
    ours = time.process_time() - start
    yield Result("Parquet to archive", 1e6 * ours / rows, "µs a row")
    start = time.process_time()
    for path in parquet:
        _plain_difference(path, place / "plain.parquet")
    yield Result("… / plain differences by polars", ours / (time.process_time() - start), "times", at_most=2.0)


def _plain_difference(path, out):
    """What a table library alone gives: sorted, the difference of every row to the one before of its vessel."""
    vessel = pl.col("MMSI")
    named = ("# Timestamp", "Latitude", "Longitude", "SOG", "COG")
    frame = pl.scan_parquet(path).select("MMSI", *named).sort("MMSI", "# Timestamp")
    before = {f"{name} before": pl.col(name).shift().over(vessel) for name in named[:3]}
    moved = [(pl.col(name) - pl.col(f"{name} before")).alias(f"{name} moved") for name in named[:3]]
    frame.with_columns(**before).with_columns(moved).collect().write_parquet(out)


def _memory(place):
    """Peak of all processes of a run with two workers, each page counted once."""
    if not Path("/proc/self/smaps_rollup").exists():
        yield Result("peak memory of a run", None, note="is measured on Linux only")
        return
    inputs = [str(day_path(place / "all", day)) for day in range(_DAYS)]
    code = "import sys; from steerway.commands.cli import main; sys.argv[0] = 'steerway'; main()"
    command = [sys.executable, "-c", code, "archive", "run", *inputs, "-o", str(place / "two"), "--workers", "2"]
    peak, seconds = peak_memory(command)
    yield Result("peak memory, two workers", peak / 1e9, "GB", at_most=1.5, note=f"{seconds:.0f} CPU s in all")


def peak_memory(command) -> tuple[float, float]:
    """(bytes, CPU seconds) of a command and its children."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    process, peak = subprocess.Popen(command, stdout=subprocess.DEVNULL), 0
    while process.poll() is None:
        peak = max(peak, sum(map(_proportional, _family(process.pid))))
        time.sleep(0.1)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if process.returncode:
        raise RuntimeError(f"{command[:5]} ended with {process.returncode}")
    return peak, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _family(pid):
    found = [pid]
    with contextlib.suppress(OSError):
        for thread in os.listdir(f"/proc/{pid}/task"):
            for child in Path(f"/proc/{pid}/task/{thread}/children").read_text().split():
                found += _family(int(child))
    return found


def _proportional(pid):
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines():
            if line.startswith("Pss:"):
                return 1024 * int(line.split()[1])
    return 0


def _digests(place):
    """Of the whole: one process and two; of the few ships: buckets, and days one by one."""
    whole = {digest(place / name)[0] for name in ("csv", "two")}
    few, digests = [day_path(place / "few", day) for day in range(_DAYS)], set()
    for buckets in (1, 5, 16):
        run_archive(few, place / f"buckets{buckets}", buckets=buckets, workers=1)
        digests.add(digest(place / f"buckets{buckets}")[0])
    for path in few:
        run_archive([path], place / "carried", buckets=2, workers=1)
    digests.add(digest(place / "carried")[0])
    yield Result("digests of 1 and 2 workers", len(whole), "", at_most=1)
    yield Result("digests of 1, 5, 16 buckets, and days one by one", len(digests), "", at_most=1)


def _found(source, directory):
    """Ships under one MMSI, and injected jumps."""
    truth = pl.read_parquet(source / "truth.parquet").filter(pl.col("ship") >= 0, pl.col("lat_deg") < 91.0)
    truth = truth.unique(["mmsi", "time_s", "lat_deg", "lon_deg"]).filter(pl.len().over("mmsi", "time_s") == 1)
    rows = truth.join(scan(directory).select("mmsi", "time_s", "track").collect(), on=["mmsi", "time_s"])
    shared = rows.filter(pl.col("ship").n_unique().over("mmsi") > 1)
    main = pl.col("ship").mode().first().over("mmsi", "track")
    right = shared.select((main == pl.col("ship")).mean()).item()
    yield Result(
        "rows of a shared MMSI with the right ship", 100.0 * right, "%", at_least=95.0, note=f"{len(shared):,} rows"
    )
    split = rows.filter(pl.col("ship").n_unique().over("mmsi") == 1, pl.col("track").max().over("mmsi") > 0)
    yield Result("… and ships that were taken for several", split["mmsi"].n_unique(), "")
    jumps = scan(directory, "events").filter(pl.col("event") == "jump").select("mmsi", time_s="start_s").unique()
    marked = truth.join(jumps.with_columns(found=True).collect(), on=["mmsi", "time_s"], how="left")
    marked = marked.with_columns(pl.col("found").fill_null(False))
    yield Result("injected jumps found", 100.0 * marked.filter("jump")["found"].mean(), "%", at_least=95.0)
    false = marked.filter(~pl.col("jump"))["found"].mean()
    yield Result("false jumps", 100.0 * false, "% of rows", at_most=0.1)
    shutil.rmtree(directory, ignore_errors=True)
