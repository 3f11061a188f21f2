"""Free ports on this machine, waiting for a condition, and tasks and processes that end with a block."""

import asyncio
import os
import random
import signal
import socket
import subprocess
import time
from contextlib import asynccontextmanager, contextmanager

_PORTS = iter(random.Random(os.getpid()).sample(range(20_000, 32_000), 12_000))
"""Below the system's ephemeral ports; no port is given twice in a process."""


def free_port(kind=socket.SOCK_STREAM):
    for port in _PORTS:
        with socket.socket(socket.AF_INET, kind) as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
    raise OSError("no free port is left")


async def until(condition, patience=5.0):
    """Wait until a condition is true."""
    for _ in range(int(patience / 0.01)):
        if condition():
            return
        await asyncio.sleep(0.01)
    raise AssertionError(f"the condition was not true within {patience:g} s")


def wait_until(condition, patience=5.0, every=0.01):
    """The same for other processes and threads; returns the condition's value."""
    end = time.monotonic() + patience
    while not (found := condition()):
        assert time.monotonic() < end, f"the condition was not true within {patience:g} s"
        time.sleep(every)
    return found


@asynccontextmanager
async def under_way(*jobs):
    """Tasks of these coroutines, which are cancelled at the end of the block."""
    tasks = [asyncio.create_task(job) for job in jobs]
    try:
        yield tasks
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


@contextmanager
def running(*command, ends=signal.SIGTERM, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, **options):
    """A process of this command; it gets the signal `ends` at the end of the block."""
    process = subprocess.Popen([*map(str, command)], stdout=stdout, stderr=stderr, **options)
    try:
        yield process
    finally:
        process.send_signal(ends)
        try:
            process.wait(10.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
