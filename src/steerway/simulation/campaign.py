"""Monte Carlo: one function over many seeds, on all cores of this machine."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context


def over_seeds(
    run: Callable[[int], object],
    seeds: Iterable[int],
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> list:
    """`run(seed)` for every seed, in the order of the seeds.

    `run` is a module-level function or a functools.partial of one. Every seed is one's own generator: the results do
    not depend on the number of workers.
    """
    seeds = list(seeds)
    workers = min(workers or os.cpu_count() or 1, len(seeds))
    if workers <= 1:
        return [_counted(run, seed, i, len(seeds), progress) for i, seed in enumerate(seeds)]
    results = {}
    # A fresh interpreter a worker: forking a process that runs threads can deadlock.
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        futures = {pool.submit(run, seed): seed for seed in seeds}
        for done, future in enumerate(as_completed(futures), 1):
            results[futures[future]] = future.result()
            if progress:
                progress(done / len(seeds))
    return [results[seed] for seed in seeds]


def _counted(run, seed, i, n, progress):
    result = run(seed)
    if progress:
        progress((i + 1) / n)
    return result
