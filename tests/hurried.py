"""Runs steerway in a world where time runs faster: `python -m tests.hurried FACTOR ARGUMENTS…`.

Clocks and waiting are those of a program in a hurry, sockets, processes and computing are the true ones: what keeps its
time here keeps it with ease in a world of factor 1. Both ends of a link have to live in the same world.
"""

import selectors
import sys
import time


def hurry(factor: float) -> None:
    """Let the monotonic clock and the waiting of every event loop made from now on run faster."""
    clock, origin, plain = time.monotonic, time.monotonic(), selectors.SelectSelector

    class Hurried(plain):
        def select(self, timeout=None):
            return super().select(timeout / factor if timeout is not None and timeout > 0.0 else timeout)

    time.monotonic = lambda: origin + factor * (clock() - origin)
    selectors.DefaultSelector = Hurried


if __name__ == "__main__":
    hurry(float(sys.argv.pop(1)))
    from steerway.commands.testing import main

    main()
