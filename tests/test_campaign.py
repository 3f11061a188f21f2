"""Many seeds: the same on one core, on several, and on a cluster of which a worker is killed."""

import os
import signal
import time
from functools import partial
from pathlib import Path

import pytest

from steerway.core import InputError
from steerway.simulation import numbers_of_seed, over_seeds, parse_scenario

SHORT = parse_scenario(
    'duration = 15\n[route]\nat_end = "stop"\nwaypoints = [{ north = 0, east = 0 }, { north = 200, east = 0 }]'
)


def slowly(folder: Path, seed: int) -> tuple[int, int]:
    """A seed that leaves a trace of who began it, and takes its time."""
    (folder / f"{seed}-{os.getpid()}").touch()
    time.sleep(0.05)
    return seed, seed * seed


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        yield cluster


def pids(cluster) -> list[int]:
    return [worker.pid for worker in cluster.workers.values()]


def test_a_seed_is_the_same_run_wherever_it_is_sailed(cluster):
    run = partial(numbers_of_seed, SHORT)
    here = over_seeds(run, range(3), workers=1)
    assert over_seeds(run, range(3), workers=2) == here
    progress = []
    assert over_seeds(run, range(3), dask=cluster.scheduler_address, progress=progress.append) == here
    assert progress == [1 / 3, 2 / 3, 1.0]
    assert here[0] != here[1]


def test_a_seed_that_fails_is_not_hidden(cluster):
    with pytest.raises(ZeroDivisionError):
        over_seeds(divide, [1, 0], dask=cluster.scheduler_address)


def test_no_seed_is_lost_or_counted_twice_when_a_worker_is_killed(cluster, tmp_path):
    victim = pids(cluster)[0]
    killed = []

    def kill_one(part):
        if part > 0.25 and not killed:
            os.kill(victim, signal.SIGKILL)
            killed.append(victim)

    seeds = range(100, 140)
    progress = []
    results = over_seeds(
        partial(slowly, tmp_path),
        seeds,
        dask=cluster.scheduler_address,
        progress=lambda part: (progress.append(part), kill_one(part)),
    )
    assert killed and results == [(seed, seed * seed) for seed in seeds]
    assert progress == [k / 40 for k in range(1, 41)]  # each once
    begun = [int(path.name.split("-")[1]) for path in tmp_path.iterdir()]
    assert victim in begun and len(set(begun)) >= 2  # the dead one had really worked
    assert len(begun) > len(seeds)  # and what it was at was begun anew


def divide(seed):
    return 1 // seed


def test_a_cluster_that_is_not_there(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("steerway.core.cluster.CONNECTING", 0.5)
    for address in ("127.0.0.1:9", "nonsense"):
        with pytest.raises(InputError, match=f"no Dask scheduler responds at '{address}'"):
            over_seeds(divide, [1], dask=address)
