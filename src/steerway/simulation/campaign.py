"""Monte Carlo: one function over many seeds, on all cores of this machine or on a Dask cluster."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context

from steerway.core.errors import InputError

CONNECTING = 10.0
"""s to wait for a cluster's scheduler."""


def over_seeds(
    run: Callable[[int], object],
    seeds: Iterable[int],
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
    dask: str | None = None,
) -> list:
    """`run(seed)` for every seed, in the order of the seeds.

    `run` is a module-level function or a functools.partial of one. Every seed is one's own generator: the results do
    not depend on the number of workers. `dask` is the address of a cluster's scheduler, whose workers have this
    package; a seed whose worker dies is repeated by another. Raises InputError for a cluster that cannot be reached.
    """
    seeds = list(seeds)
    if dask is not None:
        return _on_cluster(run, seeds, dask, progress)
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


def _on_cluster(run, seeds, address, progress):
    try:
        from dask import distributed
    except ImportError:
        raise InputError("--dask needs the optional extra: pip install 'steerway[dask]'") from None
    try:
        client = distributed.Client(address, timeout=CONNECTING, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(f"no Dask scheduler responds at {address!r}, expected host:port ({error})") from None
    results = {}
    with client:
        # Not pure: a result is keyed by its seed, not by a hash of the function.
        futures = client.map(run, seeds, pure=False, key="seed")
        of_key = {future.key: seed for future, seed in zip(futures, seeds, strict=True)}
        for future in distributed.as_completed(futures, loop=client.loop):
            results[of_key[future.key]] = future.result()
            if progress:
                progress(len(results) / len(seeds))
    return [results[seed] for seed in seeds]
