"""Monte Carlo: one function over many seeds, on all cores of this machine or on a Dask cluster."""

import os
from collections.abc import Callable, Iterable
from contextlib import closing
from typing import Any

from steerway.core.workers import in_workers


def over_seeds(
    run: Callable[[int], object],
    seeds: Iterable[int],
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
    dask: str | None = None,
    finished: Callable[[int, object], None] | None = None,
) -> list[Any]:
    """`run(seed)` for every seed, in the order of the seeds.

    `run` is a module-level function or a functools.partial of one. Every seed is one's own generator: the results do
    not depend on the number of workers. `dask` is the address of a cluster's scheduler, whose workers have this
    package; a seed whose worker dies is repeated by another. `finished(seed, result)` is called for every seed as soon
    as it is done. Raises InputError for a cluster that cannot be reached.
    """
    seeds = list(seeds)
    done: dict[int, object] = {}
    with closing(in_workers(run, seeds, min(workers or os.cpu_count() or 1, len(seeds)), dask)) as finished_runs:
        for index, result in finished_runs:
            done[index] = result
            if finished:
                finished(seeds[index], result)
            if progress:
                progress(len(done) / len(seeds))
    return [done[index] for index in range(len(seeds))]
