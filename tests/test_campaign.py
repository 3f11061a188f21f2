"""Long work: many seeds on a cluster that loses a worker, and one command at a time in a directory."""

import os
import re
import signal
import sys
import time
from pathlib import Path

import pytest

from steerway.core import InputError
from steerway.core.testing import in_workers, only_writer
from steerway.simulation import over_seeds
from tests.command_line import run

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
    ],
    ids=lambda command: " ".join(each for each in map(str, command) if "/" not in each),
)
def test_a_second_command_into_the_directory_is_refused_while_the_first_one_lasts(command, tmp_path):
    with only_writer(tmp_path / "out", "a test"):
        code, _, said = run(*command, "-o", tmp_path / "out")
        assert code == 2 and re.search(r"out is being written by process \d+ on \S+ since 20\d\d-", said), said
    assert not any((tmp_path / "out").iterdir())
