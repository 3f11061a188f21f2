"""Simulation by command, its log as input of the estimator; many seeds, also on a cluster that loses a worker."""

import json
import math
import os
import re
import signal
import sys
import time
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from steerway.commands.testing import SCENARIO, simulate_demo
from steerway.core import InputError
from steerway.core.testing import in_workers, only_writer
from steerway.estimation import FiveStateFilter
from steerway.formats.testing import nmea0183
from steerway.simulation import load_scenario, over_seeds, parse_scenario, sail_scenario
from steerway.simulation.testing import COLUMNS, assembly, begins, write
from tests.command_line import run

SHORT = """
duration = 60.0
[gnss]
white = 0.1
markov = []
velocity_std = 0.05
[compass]
[route]
waypoints = [{ north = 0, east = 0 }, { north = 30, east = 20 }, { north = 200, east = 20 }]
"""
HUNTING = SHORT.replace("60", "40") + "[autopilot]\nbandwidth = 2.0\n"


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    path = tmp_path_factory.mktemp("scenario") / "short.toml"
    path.write_text(SHORT.replace("60", "40"), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    sailed = sail_scenario(parse_scenario(SHORT))
    return sailed, write(sailed, tmp_path_factory.mktemp("out"), nmea=True)


def test_the_table_holds_the_run_with_units_in_its_names(written):
    sailed, (table, *_) = written
    frame, run = pl.read_parquet(table), sailed.run
    assert len(frame) == len(run) == 3000 and len(frame.columns) == len(set(frame.columns))
    assert len(frame.columns) == 2 + len(COLUMNS) + 7 + 2
    np.testing.assert_allclose(frame["time_s"] - frame["elapsed_s"], begins(sailed.scenario))
    assert np.array_equal(frame["true_north_m"], run["true_north"])
    assert frame["true_heading_deg"].min() >= 0.0 and frame["true_heading_deg"].max() < 360.0
    assert frame["estimated_cog_deg"].null_count() == np.isnan(run["estimated_cog"]).sum() > 0
    assert np.allclose(np.degrees(run["true_yaw_rate"]), frame["true_yaw_rate_dps"])
    assert np.array_equal(frame["command_left_propeller_speed_radps"], run.command[:, 0])
    # One degree of latitude is 111.5 km at 63.44°.
    north = (frame["true_lat_deg"].to_numpy() - 63.44) * 111_500.0
    assert np.max(np.abs(north - run["true_north"])) < 0.1


def test_the_log_is_what_the_receiver_read_and_the_estimate_comes_back_from_it(written):
    sailed, (_, _, log, _) = written
    run, scenario = sailed.run, sailed.scenario
    (fixes,) = nmea0183.read(log.read_bytes()).sources.values()
    read = np.isfinite(run["read_north"])
    placed = fixes.rows(fixes.has_position)
    assert len(placed) == read.sum() == 300
    assert np.allclose(placed.time, begins(scenario) + run.time[read], atol=1e-3)
    north = (placed.latitude - scenario.origin.place[0]) * 6_388_000.0
    assert np.allclose(north, run["read_north"][read], rtol=1e-3, atol=0.01)
    assert np.allclose(placed.sog, run["read_sog"][read], atol=3e-4)
    assert np.allclose(placed.heading, run["read_heading"][read], atol=2e-4)
    again = FiveStateFilter(assembly.profile(scenario)).filter(placed)
    # The same filter on the log gives the estimate of the loop, which runs at 50 Hz.
    there = run["estimated_sog"][read]
    known = np.isfinite(there) & np.isfinite(again.sog)
    assert known.sum() > 280 and np.max(np.abs(again.sog - there)[known][10:]) < 0.01


def test_simulate_prints_writes_and_warns_of_an_autopilot_that_will_hunt(tmp_path):
    path = tmp_path / "hunting.toml"
    path.write_text(HUNTING, encoding="utf-8")
    code, out, err = run("simulate", path, "-o", tmp_path / "run")
    assert code == 0 and "course over ground" in out and "wrote" in out, err
    assert "warning: An autopilot of 2 rad/s will hunt" in err
    assert run("advise", path)[0] == 0
    for words in (("simulate", path, "-o", tmp_path / "not", "--strict"), ("advise", path, "--strict")):
        code, _, err = run(*words)
        assert code == 2 and "will hunt" in err
    assert not (tmp_path / "not").exists()
    page = (tmp_path / "run" / "index.html").read_text(encoding="utf-8")
    assert page.count("<figure>") == 4 and "Estimated against true" in page and "Waypoints" in page
    written = sorted(each.name for each in (tmp_path / "run").iterdir())
    assert written == ["index.html", "results.json", "run.parquet"]


def test_many_seeds_are_a_row_each(short, tmp_path):
    code, _, err = run("simulate", short, "-o", tmp_path, "--seeds", 2, "--first-seed", 7)
    assert code == 0, err
    frame = pl.read_parquet(tmp_path / "campaign.parquet")
    assert frame["seed"].to_list() == [7, 8]
    assert frame["cog_rms_deg"][0] == sail_scenario(load_scenario(short), 7).numbers["cog_rms_deg"]
    assert frame["cog_rms_deg"][0] != frame["cog_rms_deg"][1]
    medians = json.loads((tmp_path / "results.json").read_text())
    assert medians["seeds"] == 2 and medians["sog_rms_mps"] == pytest.approx(frame["sog_rms_mps"].mean())


def test_advise_by_profile():
    _, out, _ = run("advise", "otter", "--speed", 1.2, "--bandwidth", 0.3, "--position-std", 0.5)
    assert "An autopilot of 0.3 rad/s fits: the bandwidth of the course estimate is 0.81 rad/s" in out
    _, out, _ = run("advise", "otter", "--speed", 1.2, "--nomoto-time", 1.0)
    assert "is 0.81 rad/s" in out and "autopilots up to 0.5" in out


def test_the_demo_writes_its_log_and_its_pages(tmp_path, monkeypatch):
    shortened = SCENARIO.replace("duration = 900.0", "duration = 20.0")
    monkeypatch.setattr(sys.modules[simulate_demo.__module__], "SCENARIO", shortened)
    rows, files = simulate_demo(tmp_path)
    assert dict(rows)["waypoints"].startswith("0 reached")
    assert {path.name for path in files} == {"run.parquet", "run.nmea", "index.html", "details.html", "results.json"}
    assert len(json.loads((tmp_path / "results.json").read_text())) > 5


@pytest.mark.study
def test_the_demo_sails_its_mission_and_tells_the_estimate_from_the_truth(tmp_path):
    rows, files = simulate_demo(tmp_path)
    result = dict(rows)
    assert result["waypoints"] == "5 reached, 0 missed"
    assert float(result["speed over ground, estimated against true"].split()[0]) < 0.25
    assert float(result["course over ground, estimated against true"].split("°")[0]) < 15.0
    *large, results = files
    assert all(path.stat().st_size > 10_000 for path in large) and len(large) == 4
    found = json.loads(results.read_text())
    assert found["sog_rms_positions_mps"] < 0.08 and found["cog_rms_velocity_deg"] < 1.5
    assert found["leg_rms_m"] <= 0.5 and found["leg_rms_true_m"] <= 2.0
    assert found["cog_bound_positions_deg"] < found["cog_rms_positions_deg"] <= 3.0
    assert found["cog_rms_velocity_deg"] <= 1.5 and found["sog_rms_positions_mps"] <= 0.06
    assert math.isfinite(begins(parse_scenario(SCENARIO)))


ROOT = Path(__file__).parent.parent


def test_no_seed_is_lost_or_counted_twice_when_a_worker_is_killed_and_no_error_is_hidden(tmp_path):
    distributed = pytest.importorskip("distributed")
    progress = []

    def slowly(seed):
        """Leaves a trace of who began it, and takes its time."""
        (tmp_path / f"{seed}-{os.getpid()}").touch()
        time.sleep(0.02)
        return 1000 // (seed - 200)

    def pids():
        return [int(path.name.split("-")[1]) for path in tmp_path.iterdir()]

    def kill_one(part):
        progress.append(part)
        if len(progress) == 11:
            os.kill(pids()[0], signal.SIGKILL)

    seeds = range(100, 140)
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        dask = cluster.scheduler_address
        results = over_seeds(slowly, seeds, dask=dask, progress=kill_one)
        with pytest.raises(ZeroDivisionError):
            over_seeds(slowly, [200, 201], dask=dask)
    assert results == [1000 // (seed - 200) for seed in seeds]
    assert progress == [k / 40 for k in range(1, 41)]  # each once
    assert len(set(pids())) >= 2 and len(pids()) > len(seeds)  # what the dead one was at was begun anew


def test_a_cluster_that_is_not_there(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(sys.modules[in_workers.__module__], "CONNECTING", 0.5)
    for address in ("127.0.0.1:9", "nonsense"):
        with pytest.raises(InputError, match=f"no Dask scheduler responds at '{address}'"):
            over_seeds(abs, [1], dask=address)


@pytest.mark.parametrize(
    "command",
    [
        ("simulate", ROOT / "examples" / "otter-mission.toml"),
        ("simulate", ROOT / "examples" / "otter-mission.toml", "--seeds", 2),
        ("simulate", ROOT / "examples" / "otter-square.toml", "--live", "--to", "stdout:"),
        ("study", "mariner-los"),
        ("demo",),
        ("archive", "run", ROOT / "pyproject.toml"),
    ],
    ids=lambda command: " ".join(each for each in map(str, command) if "/" not in each),
)
def test_a_second_command_into_the_directory_is_refused_while_the_first_one_lasts(command, tmp_path):
    with only_writer(tmp_path / "out", "a test"):
        code, _, said = run(*command, "-o", tmp_path / "out")
        assert code == 2 and re.search(r"out is being written by process \d+ on \S+ since 20\d\d-", said), said
    assert not any((tmp_path / "out").iterdir())
