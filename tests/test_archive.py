"""Archives: results independent of how they are made, every layout, faults, ships under one MMSI, events."""

import json
import re
import sys
import textwrap
import zipfile
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import polars as pl
import pytest

import steerway.archive
from steerway.archive.testing import Store, digest, export, page, running, status, unit
from steerway.commands.testing import interruption
from steerway.core import Fixes, InputError
from steerway.core.testing import KNOT, in_workers
from steerway.estimation import FiveStateFilter
from steerway.formats.testing import ais_tables, class_b
from tests.command_line import run
from tests.fleet import day_path, generate
from tests.fuzz import seeds
from tests.golden import missed, no_worse
from tests.messages import sentences, tagged
from tests.scenes import straight

DAYS = 2
START = 1_709_251_200.0
NOON = 1_719_835_200.0  # 2024-07-01


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    """Two days of generated reports in the Danish layout, and the truth."""
    directory = tmp_path_factory.mktemp("fleet")
    generate(directory, count=26, days=DAYS, seed=11)
    return directory


@pytest.fixture(scope="module")
def files(fleet):
    return [day_path(fleet, day) for day in range(DAYS)]


@pytest.fixture(scope="module")
def whole(files, tmp_path_factory):
    """The archive in one bucket, by one process."""
    directory = tmp_path_factory.mktemp("archive")
    steerway.archive.run(files, directory, buckets=1, workers=1)
    return directory


@pytest.fixture(autouse=True)
def without_a_page(monkeypatch):
    """Do not draw the page, which takes longer than a small archive; `whole` has its page from before."""
    monkeypatch.setattr(page, "write", lambda store, manifest: None)


def rows_of(directory, table="estimate"):
    return steerway.archive.scan(directory, table).collect()


def test_days_that_are_added_later_by_processes_and_in_more_buckets_give_the_same(files, whole, tmp_path):
    steerway.archive.run(files[1:], tmp_path, buckets=2, workers=2)
    report = steerway.archive.run(files[:1], tmp_path, buckets=2, workers=2)
    assert report.units == 4 and "are run again" in report.notes[0]
    assert digest(tmp_path) == digest(whole)
    again = steerway.archive.run(files, tmp_path, workers=1)
    assert again.units == 0 and again.inputs == 0


def test_a_run_goes_on_after_a_full_disk_and_after_it_was_killed(files, whole, tmp_path, monkeypatch):
    from steerway.core.testing import files as core_files

    real, writes = core_files.complete_or_absent, []

    def full(path):
        writes.append(path)
        if len(writes) > 7:
            raise core_files.cannot_write(path, OSError(28, "No space left on device"))
        return real(path)

    monkeypatch.setattr(unit, "complete_or_absent", full)
    with pytest.raises(running.DiskFull, match="the same command continues"):
        steerway.archive.run(files, tmp_path, buckets=2, workers=1)
    store = Store(tmp_path)
    (kept, lost) = sorted(store.done())
    monkeypatch.setattr(unit, "complete_or_absent", real)
    # Killed: a lock is left, half of a file, and the tables of a unit without its state.
    (tmp_path / ".lock").write_text("process 1 on a machine since long\n")
    beside = store.path("estimate", *lost).with_name(".bucket=01.parquet.123.part")
    beside.write_bytes(b"half")
    store.path("state", *lost).unlink()
    assert set(store.done()) == {kept}
    report = steerway.archive.run(files, tmp_path, workers=1)
    assert report.units == 3 and not beside.exists() and not (tmp_path / ".lock").exists()
    assert digest(tmp_path) == digest(whole)


def test_a_lost_worker_is_replaced_and_a_unit_that_loses_three_is_given_up(files, tmp_path, monkeypatch):
    class Lost(Mock):
        """A worker that is killed in bucket 0 and works in the others."""

        def result(self):
            (item,) = self.begin.call_args.args
            if item.bucket == 0:
                raise ChildProcessError("killed")
            return unit.run_unit(item)

    workers = sys.modules[in_workers.__module__]
    monkeypatch.setattr(workers, "Worker", lambda function: Lost())
    monkeypatch.setattr(workers, "wait", lambda pipes: pipes)
    report = steerway.archive.run(files, tmp_path, buckets=2, workers=2)
    assert report.given_up == ["2024-03-01 bucket 00"] and not report.complete
    assert {bucket for _, bucket in Store(tmp_path).done()} == {1}


def test_what_cannot_be_run_is_refused_in_one_sentence(files, whole, tmp_path):
    with pytest.raises(InputError, match=r"was made with smooth False, not True: expected the same settings"):
        steerway.archive.run(files, whole, smooth=True)
    manifest = re.sub('"kernels": "[0-9a-f]+"', '"kernels": "of before"', (whole / "manifest.json").read_text())
    (tmp_path / "older").mkdir()
    (tmp_path / "older" / "manifest.json").write_text(manifest)
    with pytest.raises(InputError, match=r"older was made by another version of steerway, .* expected another dir"):
        steerway.archive.run(files[:1], tmp_path / "older")
    wrong = {"rate": 11.0, "buckets": 0, "memory": 1e6, "aid": ("sog", "yaw_rate")}
    for (name, value), words in zip(wrong.items(), ("11.0", "0", "0.001 GB", "'yaw_rate' is unknown"), strict=True):
        with pytest.raises(InputError, match=f"{name} .*{words}"):
            steerway.archive.run(files, tmp_path, **{name: value})
    with pytest.raises(InputError, match="no such file"):
        steerway.archive.run([tmp_path / "none*.csv"], tmp_path / "out")
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match="is not empty and holds no archive"):
        steerway.archive.run(files, tmp_path)


def test_rows_left_out_are_counted_by_reason_and_file(files, whole):
    found = status(whole)
    table = pl.concat([pl.read_csv(each, infer_schema=False) for each in files])
    left_out = [each["left_out"] for each in found["files"]]
    count = {reason: sum(each.get(reason, 0) for each in left_out) for reason in left_out[0]}
    assert count["base station"] == (table["Type of mobile"] == "Base Station").sum()
    assert count["aid to navigation"] == (table["Type of mobile"] == "AtoN").sum()
    assert count["aircraft or search and rescue"] == (table["Type of mobile"] == "SAR Airborne").sum()
    assert sum(each["rows"] for each in found["files"]) + sum(count.values()) == len(table)
    assert found["rows"] == len(rows_of(whole)) and found["to_do"] == 0


def test_every_layout_says_the_same(tmp_path):
    found = []
    for data in seeds.ais_tables():
        (tmp_path / "day").write_bytes(data)
        with ais_tables.reports(tmp_path / "day", tmp_path) as frame:
            found.append(frame.collect())
    row = found[0].row(3, named=True)
    assert (row["mmsi"], row["time_s"], row["heading_deg"], row["mobile"], row["reason"]) == (
        211000001,
        NOON + 3,
        None,
        1,
        0,
    )
    assert (row["lat_deg"], row["lon_deg"], row["sog_mps"], row["cog_deg"]) == pytest.approx(
        (54.003, 10.5, 5.5 * KNOT, 90.0)
    )
    assert len(found) == 7 and [each for each in found if not each.equals(found[0])] == []


def sailed(speed):
    """A table of a boat that goes north for ten minutes."""
    return straight(speed, 0.0, 595.0, 0.2).fixes(0.0, 0).to_frame()


def test_logs_are_of_the_vessel_of_their_file_or_of_the_one_that_a_column_names(tmp_path):
    for name, speed in (("one.csv", 2.0), ("two.csv", 3.0)):
        sailed(speed).write_csv(tmp_path / name)
    steerway.archive.run([tmp_path / "one.csv", tmp_path / "two.csv"], tmp_path / "files", workers=1)
    speeds = rows_of(tmp_path / "files").group_by("mmsi").agg(pl.col("sog_mps").last())["sog_mps"].sort()
    np.testing.assert_allclose(speeds, [2.0, 3.0], atol=0.05)
    boats = (("Alma", 2.0), ("7", 3.0), ("", 1.0))
    table = pl.concat(sailed(speed).with_columns(boat=pl.lit(name)) for name, speed in boats).sort("time_s")
    table.write_csv(tmp_path / "fleet.csv", separator=";", quote_style="always")
    table.filter(pl.col("boat") == "7").cast({"boat": pl.Float64}).write_parquet(tmp_path / "seven.parquet")
    (tmp_path / "no.gpx").write_text("<gpx></gpx>")
    inputs = [tmp_path / name for name in ("fleet.csv", "seven.parquet", "no.gpx")]
    report = steerway.archive.run(inputs, tmp_path / "out", workers=1, vessel_column="boat")
    assert report.left_out == {"no vessel": 120} and report.rows == 240  # seven came twice
    assert report.failed == {str(inputs[2]): "not a table, expected CSV or Parquet with the column 'boat'"}
    names = Store(tmp_path / "out").names()
    assert sorted(names.values()) == ["7", "Alma"] and names[7] == "7" and min(names) == 7 < 1 << 52 < max(names)
    speeds = {
        names[row[0]]: row[1] for row in rows_of(tmp_path / "out").group_by("mmsi").agg(pl.last("sog_mps")).rows()
    }
    assert speeds == pytest.approx({"Alma": 2.0, "7": 3.0}, abs=0.05)
    with pytest.raises(InputError, match=r"fleet\.csv: the table has no column 'ship', expected .*'lon_deg', 'boat'"):
        steerway.archive.run(inputs[:1], tmp_path / "other", vessel_column="ship", strict=True)


@missed("98.7 % of the rows: archives follow a jump sooner")
def test_the_estimate_is_that_of_the_filter(fleet, files, tmp_path):
    """Ships that share their MMSI are left out."""
    steerway.archive.run(files, tmp_path, buckets=1, workers=1, profile=FiveStateFilter("ais").profile)
    truth = pl.read_parquet(fleet / "truth.parquet").filter(pl.col("ship") >= 0, pl.col("lat_deg") < 91.0)
    alone = truth.filter(pl.col("ship").n_unique().over("mmsi") == 1, ~pl.col("jump").any().over("mmsi"))
    alone = alone.unique(["mmsi", "time_s", "lat_deg"]).sort("mmsi", "time_s", "lat_deg")
    angles = np.radians(alone["lat_deg"].to_numpy()), np.radians(alone["lon_deg"].to_numpy())
    numbers = alone["mmsi"].to_numpy()
    tracks = [np.flatnonzero(numbers == number) for number in np.unique(numbers)]
    time = alone["time_s"].to_numpy()
    motions = [FiveStateFilter("ais").filter(Fixes(time[k], *(each[k] for each in angles))) for k in tracks]
    sog_of_filter = np.concatenate([each.sog for each in motions])
    found = rows_of(tmp_path).join(alone.select("mmsi").unique(), on="mmsi", how="semi")
    found = found.sort("mmsi", "time_s", "lat_deg")
    assert len(found) == len(sog_of_filter) > 4000
    known = np.isfinite(sog_of_filter)
    sog = found["sog_mps"].fill_null(np.nan).to_numpy()[known]
    equal = (np.abs(sog - sog_of_filter[known]) < 1e-4).mean()
    no_worse(equal >= 0.987, equal)
    assert equal > 0.99


def test_ships_under_one_number_are_separated_and_jumps_found(fleet, whole):
    truth = pl.read_parquet(fleet / "truth.parquet").filter(pl.col("ship") >= 0, pl.col("lat_deg") < 91.0)
    truth = truth.unique().filter(pl.len().over("mmsi", "time_s") == 1)
    found = truth.join(rows_of(whole).select("mmsi", "time_s", "track"), on=["mmsi", "time_s"])
    shared = found.filter(pl.col("ship").n_unique().over("mmsi") > 1)
    assert shared["mmsi"].n_unique() == 1 and len(shared) > 1000
    right = shared.with_columns(most=pl.col("ship").mode().first().over("mmsi", "track"))
    assert (right["most"] == right["ship"]).mean() > 0.99
    assert found.filter(pl.col("ship").n_unique().over("mmsi") == 1)["track"].max() == 0
    jumps = rows_of(whole, "events").filter(pl.col("event") == "jump").select("mmsi", time_s="start_s").unique()
    seen = truth.join(jumps.with_columns(found=True), on=["mmsi", "time_s"], how="left")
    seen = seen.with_columns(pl.col("found").fill_null(False))
    assert seen.filter("jump")["found"].mean() > 0.9
    assert seen.filter(~pl.col("jump"))["found"].mean() < 1e-3


def test_smoothing_looks_into_the_next_day_whatever_the_buckets(fleet, files, whole, tmp_path):
    report = steerway.archive.run(files, tmp_path / "one", buckets=1, workers=1, smooth=True)
    assert "1 h of the next" in report.notes[-1]
    steerway.archive.run(files[1:], tmp_path / "three", buckets=3, workers=1, smooth=True)
    steerway.archive.run(files, tmp_path / "three", workers=1, smooth=True)
    assert digest(tmp_path / "one") == digest(tmp_path / "three")
    truth = pl.read_parquet(fleet / "truth.parquet").filter(~pl.col("jump"), pl.col("ship") >= 0)
    truth = truth.unique(["mmsi", "time_s"]).select("mmsi", "time_s", true="sog_mps")

    def error(directory):
        both = rows_of(directory).filter(pl.col("status") == "ok").join(truth, on=["mmsi", "time_s"])
        return float(both.select((pl.col("sog_mps") - pl.col("true")).abs().median()).item())

    assert error(tmp_path / "one") < 0.85 * error(whole)


def test_raw_ais_with_tag_blocks_and_a_vessel_of_class_b_has_its_profile(tmp_path):
    lines = []
    for k in range(30):
        for each in ({"type": 18, "mmsi": 338_000_096}, {"type": 1, "mmsi": 257_000_001}):
            report = sentences(**each, speed=10.0, lat=55.0 + 0.0005 * k, lon=11.0, course=0.0, second=(10 * k) % 60)
            lines.append(tagged(START + 10 * k + 1, *report))  # received a second later
    (tmp_path / "raw.nmea").write_bytes(b"".join(lines))
    assert class_b((tmp_path / "raw.nmea").read_bytes()) == {338_000_096}
    steerway.archive.run([tmp_path / "raw.nmea"], tmp_path / "out", workers=1)
    store = Store(tmp_path / "out")
    (unit,) = store.done()
    unknown, a, b = np.reshape(store.numbers(*unit)["cells"][0], (3, -1, 2))[:, :, 1].sum(axis=1)
    assert unknown == 0 and a > 20 < b
    rows = rows_of(tmp_path / "out").filter(mmsi=257_000_001)
    assert len(rows) == 30 and (rows["time_s"].diff().drop_nulls() == 10.0).all()
    assert rows["sog_mps"][-1] == pytest.approx(0.0005 * 111_300.0 / 10.0, rel=0.05)


def test_the_commands_of_the_documentation_run_and_bad_files_are_named_and_left_out(fleet, tmp_path, monkeypatch):
    """All commands after the download, on a generated day instead of the downloaded one."""
    monkeypatch.setattr(interruption, "note", "")
    documentation = (Path(__file__).parents[1] / "docs" / "archives.md").read_text(encoding="utf-8")
    lines = [line.strip() for line in documentation.splitlines()]
    commands = [line.split()[1:] for line in lines if line.startswith("steerway ")]
    assert len(commands) == 4
    monkeypatch.chdir(tmp_path)
    with zipfile.ZipFile("aisdk-2024-03-01.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.write(day_path(fleet, 0), "aisdk-2024-03-01.csv")
    beginnings = {"bad.parquet": b"PAR1", "broken.csv.gz": b"\x1f\x8b", "cut.zip": b"PK\x03\x04"}
    for name, beginning in beginnings.items():
        Path(name).write_bytes(beginning + bytes(50))
    said = {}
    for command in commands:
        given = [*beginnings, "--workers", "1"] if command[1] == "run" else []
        said[command[1]] = run(*command, *given)
    assert [code for code, *_ in said.values()] == [3, 0, 0, 0], said
    assert "units run" in said["run"][1] and "cut.zip: left out, the ZIP archive is cut short" in said["run"][2]
    assert all(f"{name}: left out, " in said["run"][2] for name in beginnings)
    assert interruption.note == "finished work is kept, the same command continues"  # printed at Ctrl-C
    assert said["verify"][1].split()[0] == digest(Path("march"))[0]
    assert json.loads(run("archive", "status", "march", "--json")[1])["to_do"] == 0
    assert Path("map.geojson").exists() and Path("encounters.csv").exists()
    code, _, refused = run("archive", "run", "bad.parquet", "-o", "strict", "--strict")
    assert code == 2 and "bad.parquet" in refused
    code = re.search(r"In Python:\n\n((?:    .*\n|\n)+)", documentation)
    exec(compile(textwrap.dedent(code[1]), "archives.md", "exec"), {})


def test_the_page_lists_the_vessels_whose_estimate_fits_worst(whole):
    html = (whole / "index.html").read_text()
    judged = rows_of(whole).filter(pl.col("status") == "ok", pl.col("nis").is_not_null()).group_by("mmsi")
    means = judged.agg(pl.len(), pl.mean("nis")).filter(pl.col("len") >= 100).sort("nis", descending=True)
    worst = html[html.index("largest mean NIS under way") :]
    shown = [int(number) for number in re.findall(r">(\d{9})<", worst)]
    assert "<img" in html and shown[: len(means)] == means["mmsi"].to_list()[:20]


def test_export(whole, tmp_path):
    everything = rows_of(whole)
    vessel = everything["mmsi"][0]
    middle = START + 43_200.0
    wanted = everything.filter(pl.col("mmsi") == vessel, pl.col("time_s") < middle)
    assert export(whole, tmp_path / "some.csv", mmsi=[vessel], stop=middle) == len(wanted)
    assert len(pl.read_csv(tmp_path / "some.csv")) == len(wanted)
    box = (8.0, 55.0, 12.0, 57.0)
    count = export(whole, tmp_path / "box.parquet", box=box)
    inside = pl.read_parquet(tmp_path / "box.parquet")
    assert 0 < count == len(inside) < len(everything)
    assert inside["lon_deg"].is_between(8.0, 12.0).all()
    point = inside["geometry"][0]
    np.testing.assert_array_equal(np.frombuffer(point[5:], "<f8"), [inside["lon_deg"][0], inside["lat_deg"][0]])
    assert b"primary_column" in (tmp_path / "box.parquet").read_bytes()
    export(whole, tmp_path / "track.geojson", mmsi=[vessel], start=START, stop=START + 3600.0)
    features = json.loads((tmp_path / "track.geojson").read_text())["features"]
    assert features[0]["geometry"]["type"] in ("LineString", "MultiLineString")
    with pytest.raises(InputError, match="unknown ending"):
        export(whole, tmp_path / "x.shp")
