"""A generated AIS archive (540 ships, three days): CPU time per row, its ratio to that of polars alone, and memory."""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import polars as pl
from tests.fleet import day_path, generate

from benchmarks.support.harness import Result, interleaved
from steerway.archive import run as run_archive
from steerway.archive.association import Reports, associate, empty_fleet, empty_found
from steerway.archive.filters import empty_states
from steerway.archive.levels import filters as filters_of_levels
from steerway.archive.levels import levels
from steerway.archive.smoothing import smoothed
from steerway.core.records import Fixes
from steerway.estimation.vessel.aids import NO_AIDS

_SHIPS, _DAYS, _SEED = 540, 3, 7
_FEW = 50  # ships in the slow measurements


def run():
    with tempfile.TemporaryDirectory(prefix="steerway-archive-") as place:
        place = Path(place)
        rows = generate(place / "all", _SHIPS, _DAYS, _SEED)
        generate(place / "few", _FEW, _DAYS, _SEED + 1)
        yield from _filter(place / "few")
        yield from _throughput(place, rows)
        yield from _memory(place)


def _reports(directory):
    truth = pl.read_parquet(directory / "truth.parquet").filter(pl.col("ship") >= 0, pl.col("lat_deg") < 91.0)
    truth = truth.sort("ship", "time_s").unique(["ship", "time_s"], keep="first", maintain_order=True)
    angles = np.radians(truth["lat_deg"].to_numpy()), np.radians(truth["lon_deg"].to_numpy())
    return Fixes(truth["time_s"].to_numpy(), *angles, mmsi=truth["ship"].to_numpy().astype(np.int64))


def _filter(directory):
    """Association with filters, and the smoother, without reading and writing."""
    fixes = _reports(directory).in_order()
    filters = filters_of_levels([[each.model_dump() for each in some] for some in levels(None)], ())
    n, bounds = len(fixes), np.r_[0, np.flatnonzero(np.diff(fixes.mmsi)) + 1, len(fixes)]
    class_a, none = np.ones(n, np.int64), np.zeros(n, np.int64)
    reports = Reports(fixes.time, fixes.latitude, fixes.longitude, np.zeros(len(fixes)), NO_AIDS, none, class_a, none)
    found, kept, spare = empty_found(n, 0, filters), empty_found(n, n, filters), empty_states((2,), filters)

    def run(into):
        associate(bounds, reports, filters, empty_fleet(len(bounds) - 1, filters), into, spare)

    taken = interleaved({"filter": lambda: run(found)}, 3)["filter"]
    yield Result("association and filter, mean interval 35 s", 1e9 * taken / n, "ns a fix")
    yield Result("… fixes a second of a core", n / taken, "1/s", at_least=1.1e6)
    run(kept)
    back = np.arange(n), bounds, kept.which, fixes.time, filters, (kept.kept,), kept.estimate
    taken = interleaved({"smoother": lambda: smoothed(*back)}, 3)["smoother"]
    yield Result("smoothing", 1e6 * taken / n, "µs a fix", at_most=10.0)


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
    """What a table library alone can do: sort the rows, and subtract from each the vessel's row before it."""
    vessel = pl.col("MMSI")
    named = ("# Timestamp", "Latitude", "Longitude", "SOG", "COG")
    frame = pl.scan_parquet(path).select("MMSI", *named).sort("MMSI", "# Timestamp")
    before = {f"{name} before": pl.col(name).shift().over(vessel) for name in named[:3]}
    moved = [(pl.col(name) - pl.col(f"{name} before")).alias(f"{name} moved") for name in named[:3]]
    frame.with_columns(**before).with_columns(moved).collect().write_parquet(out)


def _memory(place):
    """Largest memory of a run in one process."""
    inputs = [str(day_path(place / "all", day)) for day in range(_DAYS)]
    code = "import sys; from steerway.commands.cli import main; sys.argv[0] = 'steerway'; main()"
    command = [sys.executable, "-c", code, "archive", "run", *inputs, "-o", str(place / "one"), "--workers", "1"]
    started = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, code, used = os.wait4(started.pid, 0)
    if code:
        raise RuntimeError(f"steerway archive run ended with {code}")
    yield Result("largest memory, one worker", used.ru_maxrss / 1e6, "GB", at_most=1.5)
