"""Long work: many seeds on one core, on several and on a cluster that loses a worker; and work that was interrupted."""

import os
import re
import signal
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from steerway.core import InputError
from steerway.core.testing import in_workers, only_writer
from steerway.simulation import numbers_of_seed, over_seeds, parse_scenario
from tests.command_line import run

ROOT = Path(__file__).parent.parent
SHORT = parse_scenario(
    'duration = 15\n[route]\nat_end = "stop"\nwaypoints = [{ north = 0, east = 0 }, { north = 200, east = 0 }]'
)


def slowly(folder: Path, seed: int) -> tuple[int, int]:
    """A seed that leaves a trace of who began it, and takes its time."""
    (folder / f"{seed}-{os.getpid()}").touch()
    time.sleep(0.02)
    return seed, seed * seed


def divide(seed):
    return 1 // seed


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        yield cluster


def test_a_seed_is_the_same_run_in_a_cluster_and_its_error_is_not_hidden(cluster):
    assert over_seeds(partial(numbers_of_seed, SHORT), [1], dask=cluster.scheduler_address) == [
        numbers_of_seed(SHORT, 1)
    ]
    with pytest.raises(ZeroDivisionError):
        over_seeds(divide, [1, 0], dask=cluster.scheduler_address)


def test_no_seed_is_lost_or_counted_twice_when_a_worker_is_killed(cluster, tmp_path):
    progress = []

    def pids():
        return [int(path.name.split("-")[1]) for path in tmp_path.iterdir()]

    def kill_one(part):
        progress.append(part)
        if len(progress) == 11:
            os.kill(pids()[0], signal.SIGKILL)

    seeds = range(100, 140)
    results = over_seeds(partial(slowly, tmp_path), seeds, dask=cluster.scheduler_address, progress=kill_one)
    assert results == [(seed, seed * seed) for seed in seeds]
    assert progress == [k / 40 for k in range(1, 41)]  # each once
    assert len(set(pids())) >= 2 and len(pids()) > len(seeds)  # what the dead one was at was begun anew


def test_a_cluster_that_is_not_there(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(sys.modules[in_workers.__module__], "CONNECTING", 0.5)
    for address in ("127.0.0.1:9", "nonsense"):
        with pytest.raises(InputError, match=f"no Dask scheduler responds at '{address}'"):
            over_seeds(divide, [1], dask=address)


@pytest.mark.parametrize(
    "command",
    [
        ("simulate", ROOT / "examples" / "otter-mission.toml"),
        ("simulate", ROOT / "examples" / "otter-mission.toml", "--seeds", 2),
        ("simulate", ROOT / "examples" / "otter-square.toml", "--live", "--to", "stdout:"),
        ("study", "mariner-los"),
        ("demo",),
    ],
    ids=lambda command: " ".join(each for each in map(str, command) if "/" not in each),
)
def test_a_second_command_into_the_directory_is_refused_while_the_first_one_lasts(command, tmp_path):
    with only_writer(tmp_path / "out", "a test"):
        code, _, said = run(*command, "-o", tmp_path / "out")
        assert code == 2 and re.search(r"out is being written by process \d+ on \S+ since 20\d\d-", said), said
    assert not any((tmp_path / "out").iterdir())
