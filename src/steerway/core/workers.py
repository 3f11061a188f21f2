"""Run work on several cores, in processes that end with their parent, or on a Dask cluster.

A worker is a fresh interpreter with one pipe: forking a process that runs threads can deadlock, and a pipe leaves no
semaphores or shared memory behind. A worker ends when its parent ends, even if the parent was killed.
"""

import contextlib
import os
import pickle
import signal
import threading
import time
import traceback
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, TypeVar

from steerway.core import files
from steerway.core.errors import InputError
from steerway.core.extras import require

Item = TypeVar("Item")
Result = TypeVar("Result")
Place = tuple[int, int]
CONNECTING = 10.0
"""Longest wait for a cluster's scheduler, s."""
GRACE = 0.7
"""Time, s, in which a stopped worker removes its unfinished files."""


def in_workers(
    function: Callable[[Item], Result],
    items: Iterable[Item],
    workers: int | None = None,
    cluster: str | None = None,
) -> Generator[tuple[int, Result], None, None]:
    """(index, function(item)) of every item, in the order in which they are finished; see `run_chains`.

    `items` are taken one by one, when a worker becomes free.
    """
    chains = ([item] for item in items)
    with contextlib.closing(run_chains(function, chains, workers, cluster)) as done:
        for (index, _), result in done:
            yield index, result


def run_chains(
    function: Callable[[Item], Result],
    chains: Iterable[list[Item]],
    workers: int | None = None,
    cluster: str | None = None,
    option: str = "--dask",
    most_losses: int | None = None,
) -> Generator[tuple[Place, Any], None, None]:
    """((chain, place), function(item)) of every item; the items of a chain are done in order.

    `function` is a module-level function or a functools.partial of one. By default there are as many workers as cores;
    with one, the work is done in this process. `cluster`: address of a Dask scheduler to use instead; `option`: the
    option that gave it, for messages. In `contextlib.closing`, the workers end with the block. An exception of
    `function` is raised here, with the worker's traceback as a note. An item whose worker is killed is repeated; after
    `most_losses` losses its result is None and the rest of its chain is left out. Without `most_losses`, raises
    ChildProcessError.
    """
    if cluster is not None:
        yield from _on_cluster(function, chains, cluster, option, most_losses is not None)
        return
    count = workers or os.cpu_count() or 1
    if count <= 1:
        for number, chain in enumerate(chains):
            for k, item in enumerate(chain):
                yield (number, k), function(item)
        return
    waiting: deque[tuple[Place, list[Item]]] = deque()  # the rest of the chains that are begun
    new = (((number, 0), chain) for number, chain in enumerate(chains) if chain)
    team: list[Worker] = []
    idle: list[Worker] = []
    busy: dict[Any, tuple[Worker, Place, list[Item]]] = {}
    losses: Counter[Place] = Counter()
    try:
        while True:
            while len(busy) < count:
                task = waiting.popleft() if waiting else next(new, None)
                if task is None:
                    break
                place, chain = task
                worker = idle.pop() if idle else Worker(function)
                if worker not in team:
                    team.append(worker)
                busy[worker.pipe] = worker, place, chain
                with contextlib.suppress(ChildProcessError):  # a lost worker shows when its result is read
                    worker.begin(chain[0])
            if not busy:
                break
            worker, place, chain = busy.pop(wait(list(busy))[0])
            try:
                result = worker.result()
            except ChildProcessError:
                if most_losses is None:
                    raise
                team.remove(worker)
                worker.end()
                losses[place] += 1
                if losses[place] < most_losses:
                    waiting.append((place, chain))
                else:
                    yield place, None
                continue
            idle.append(worker)
            if chain[1:]:
                waiting.appendleft(((place[0], place[1] + 1), chain[1:]))
            yield place, result
        for each in team:
            each.pipe.close()  # a worker that waits for its next item ends
    except BaseException:
        for each in team:
            each.process.terminate()
        raise
    finally:
        until = time.monotonic() + GRACE
        for each in team:
            each.process.join(max(until - time.monotonic(), 0.0))
        for each in team:
            each.end()


def _on_cluster(
    function: Callable[[Item], Result], chains: Iterable[list[Item]], address: str, option: str, gives_up: bool
) -> Generator[tuple[Place, Any], None, None]:
    with connected(address, option) as client:
        from dask import distributed as dask

        distributed: Any = dask
        place_of = {}
        futures = []
        for number, chain in enumerate(chains):
            before = None
            for k, item in enumerate(chain):
                before = client.submit(_after, before, function, item, pure=False)
                place_of[before.key] = number, k
                futures.append(before)
        given_up = set()
        for future in distributed.as_completed(futures, loop=client.loop):
            place = place_of[future.key]
            lost = future.status == "error" and isinstance(future.exception(), distributed.scheduler.KilledWorker)
            if not (lost and gives_up):
                yield place, future.result()
            elif place[0] not in given_up:  # the rest of the chain has the same error
                given_up.add(place[0])
                yield place, None


def _after(_: Any, function: Callable[[Item], Result], item: Item) -> Result:
    """The result of an item. The first argument makes a cluster wait for the result of the item before it."""
    return function(item)


def connected(address: str, option: str) -> Any:
    """A `distributed.Client` of a scheduler; close it by `with`.

    Raises InputError if Dask, which `option` needs, is not installed, or if no scheduler responds.
    """
    require(option, "dask")
    from dask import distributed

    client: Any = distributed.Client
    try:
        return client(address, timeout=CONNECTING, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(f"no Dask scheduler responds at {address!r}, expected host:port ({error})") from None


class Worker:
    """A worker process and its current item."""

    def __init__(self, function: Callable[[Any], Any]) -> None:
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.item: Any = None
        self.process: BaseProcess = context.Process(target=_work, args=(theirs, function), daemon=True)
        with _interrupts_blocked():
            self.process.start()
        theirs.close()

    def begin(self, item: Any) -> None:
        """Send an item. Raises ChildProcessError if the process was killed."""
        self.item = item
        try:
            self.pipe.send(item)
        except BrokenPipeError:
            raise self._killed() from None

    def result(self) -> Any:
        """Wait for the result. Raises the function's exception, or ChildProcessError if the process was killed."""
        try:
            succeeded, outcome = self.pipe.recv()
        except (EOFError, ConnectionResetError):
            raise self._killed() from None
        if not succeeded:
            raise outcome
        return outcome

    def end(self) -> None:
        """End the process."""
        self.pipe.close()
        if self.process.is_alive():
            self.process.kill()
        self.process.join()
        self.process.close()

    def _killed(self) -> ChildProcessError:
        self.process.join(GRACE)
        code = self.process.exitcode
        how = f"was ended by signal {-code}" if code is not None and code < 0 else f"ended with exit code {code}"
        return ChildProcessError(
            f"a worker process {how} at item {self.item!r:.80}, expected a result (is memory short?)"
        )


@contextlib.contextmanager
def _interrupts_blocked() -> Generator[None, None, None]:
    """Processes started in the block do not receive Ctrl-C: their parent handles it and ends them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _work(pipe: Connection, function: Callable[[Any], Any]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _end)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with contextlib.suppress(EOFError, OSError):
        while True:
            packed = pipe.recv_bytes()
            try:
                answer = pickle.dumps((True, function(pickle.loads(packed))))
            except Exception as error:
                error.add_note("In a worker process:\n" + traceback.format_exc())
                answer = pickle.dumps((False, _sendable(error)))
            pipe.send_bytes(answer)


def _sendable(error: Exception) -> Exception:
    """The exception; if it cannot be pickled, a RuntimeError with its text."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error


def _end_with_parent() -> None:
    parent = parent_process()
    assert parent is not None
    wait([parent.sentinel])
    _end()


def _end(*_: object) -> None:
    """End without unwinding: an exception in a callback of compiled code would be printed and ignored."""
    files.remove_unfinished()
    os._exit(1)
