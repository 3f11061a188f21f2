"""python -m benchmarks.soak.idle SECONDS: ticks that do nothing, to measure the lateness that the machine causes."""

import asyncio
import sys

from steerway.live.tick_timing import Pulse


async def idle(seconds: float, rate: float = 50.0) -> Pulse:
    """Tick for `seconds`; return the statistics."""
    loop, pulse = asyncio.get_running_loop(), Pulse()
    beat = loop.time()
    for _ in range(round(seconds * rate)):
        beat += 1.0 / rate
        await asyncio.sleep(max(beat - loop.time(), 0.0))
        pulse.begin()
        pulse.beat(loop.time() - beat)
    return pulse


if __name__ == "__main__":
    print(asyncio.run(idle(float(sys.argv[1]))))
