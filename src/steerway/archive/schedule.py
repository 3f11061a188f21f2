"""Units on the processes of this machine or of a Dask cluster: each after the day before it in its bucket.

A unit whose worker is lost is run again; after some losses it is given up, and only what depends on it waits.
"""

import contextlib
from collections.abc import Iterator
from multiprocessing.connection import wait
from typing import Any

from steerway.archive.unit import Work, run_unit
from steerway.core.cluster import connected
from steerway.core.workers import Worker

MOST_LOSSES = 3
Chains = list[list[Work]]
Outcome = tuple[Work, dict[str, Any] | None]
"""A unit and its numbers; None where it was given up."""


def run_chains(chains: Chains, workers: int, scheduler: str | None = None) -> Iterator[Outcome]:
    """Run the units of every chain in order; yields them as they are done. Raises what a unit raises."""
    chains = [chain for chain in chains if chain]
    if scheduler is not None:
        return _on_cluster(chains, scheduler)
    if min(workers, len(chains)) <= 1:
        return ((work, run_unit(work)) for chain in chains for work in chain)
    return _on_this_machine(chains, min(workers, len(chains)))


def _on_this_machine(chains: Chains, workers: int) -> Iterator[Outcome]:
    waiting, losses = list(chains), dict[tuple[int, int], int]()
    busy: dict[Any, tuple[Worker, list[Work]]] = {}
    idle: list[Worker] = []
    try:
        while waiting or busy:
            while waiting and len(busy) < workers:
                chain = waiting.pop(0)
                worker = idle.pop() if idle else Worker(run_unit)
                with contextlib.suppress(ChildProcessError):  # a lost worker shows when its result is read
                    worker.begin(0, chain[0])
                busy[worker.pipe] = worker, chain
            worker, chain = busy.pop(wait(list(busy))[0])
            work = chain[0]
            try:
                _, numbers = worker.result()
            except ChildProcessError:
                worker.end()
                unit = work.day, work.bucket
                losses[unit] = losses.get(unit, 0) + 1
                if losses[unit] >= MOST_LOSSES:
                    yield work, None
                else:
                    waiting.append(chain)
                continue
            idle.append(worker)
            if chain[1:]:
                waiting.insert(0, chain[1:])
            yield work, numbers
    finally:
        for each in (*idle, *(worker for worker, _ in busy.values())):
            each.process.terminate()
        for each in (*idle, *(worker for worker, _ in busy.values())):
            each.end()


def _on_cluster(chains: Chains, address: str) -> Iterator[Outcome]:
    with connected(address, "--scheduler") as client:
        from dask import distributed

        of_key = {}
        for chain in chains:
            before = None
            for work in chain:
                before = client.submit(_run_after, before, work, pure=False)
                of_key[before.key] = work, before
        futures = [future for _, future in of_key.values()]
        given_up = set()
        for future in distributed.as_completed(futures, loop=client.loop):
            work = of_key[future.key][0]
            if future.status == "error" and isinstance(future.exception(), distributed.scheduler.KilledWorker):
                if work.bucket not in given_up:  # what depends on it has the same error
                    yield work, None
                given_up.add(work.bucket)
            else:
                yield work, future.result()


def _run_after(_: Any, work: Work) -> dict[str, Any]:
    """The unit, when the one before it is done: on a cluster that is said by an argument."""
    return run_unit(work)
