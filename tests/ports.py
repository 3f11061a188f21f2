"""Free ports of this machine, and waiting for what comes over them."""

import asyncio
import os
import random
import socket

_PORTS = iter(random.Random(os.getpid()).sample(range(20_000, 32_000), 12_000))
"""Below those that the system gives to sockets by itself, none twice in a process."""


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
    """Wait for something to become true."""
    for _ in range(int(patience / 0.01)):
        if condition():
            return
        await asyncio.sleep(0.01)
    raise AssertionError("it never came true")
