"""Work on several cores, in processes that end with the one that started them.

A worker is a fresh interpreter with one pipe: forking a process that runs threads can deadlock, and there are neither
semaphores nor shared memory that could be left behind. It ends when its parent ends, whatever ended that.
"""

import contextlib
import os
import pickle
import signal
import threading
import time
import traceback
from collections.abc import Callable, Generator, Iterable
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, TypeVar

from steerway.core import files

Item = TypeVar("Item")
Result = TypeVar("Result")
GRACE = 0.7
"""s that a worker has to remove its unfinished files when it is stopped."""


def in_workers(
    function: Callable[[Item], Result], items: Iterable[Item], workers: int | None = None
) -> Generator[tuple[int, Result], None, None]:
    """(index, function(item)) of every item, in the order in which they are finished.

    `function` is a module-level function or a functools.partial of one; `items` are taken one by one, when a worker
    becomes free. As many workers as cores by default; with one the work is done in this process. Use it in
    `contextlib.closing`, so that the workers end with the block. An exception of `function` is raised here, with the
    worker's traceback as a note. Raises ChildProcessError when a worker is killed.
    """
    numbered = enumerate(items)
    count = workers or os.cpu_count() or 1
    if count <= 1:
        for index, item in numbered:
            yield index, function(item)
        return
    team: list[Worker] = []
    busy: dict[Any, Worker] = {}
    try:
        for index, item in numbered:
            if len(team) < count:
                worker = Worker(function)
                team.append(worker)
            else:
                worker = _first_of(busy)
                yield worker.result()
            worker.begin(index, item)
            busy[worker.pipe] = worker
        while busy:
            yield _first_of(busy).result()
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


class Worker:
    """A process and the item it is at."""

    def __init__(self, function: Callable[[Any], Any]) -> None:
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.index, self.item = -1, None
        self.process: BaseProcess = context.Process(target=_work, args=(theirs, function), daemon=True)
        with _interrupts_blocked():
            self.process.start()
        theirs.close()

    def begin(self, index: int, item: Any) -> None:
        """Send it an item. Raises ChildProcessError when it was killed."""
        self.index, self.item = index, item
        try:
            self.pipe.send(item)
        except BrokenPipeError:
            raise self._killed() from None

    def result(self) -> tuple[int, Any]:
        """(index, result), when it has one. Raises what the function raised, ChildProcessError when it was killed."""
        try:
            succeeded, outcome = self.pipe.recv()
        except (EOFError, ConnectionResetError):
            raise self._killed() from None
        if not succeeded:
            raise outcome
        return self.index, outcome

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


def _first_of(busy: dict[Any, Worker]) -> Worker:
    return busy.pop(wait(list(busy))[0])


@contextlib.contextmanager
def _interrupts_blocked() -> Generator[None, None, None]:
    """A process that is started meanwhile never sees Ctrl-C: the one that started it decides."""
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
    """The exception, or one with its text where it cannot be packed."""
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
    """Without unwinding: an exception in a callback of compiled code would be printed and forgotten."""
    files.remove_unfinished()
    os._exit(1)
