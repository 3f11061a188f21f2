"""Measures a fault in a running service: sentences over UDP in, sentences over UDP and rows at 50 Hz out."""

import asyncio
import math
import socket
from contextlib import closing
from functools import cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from steerway.core import displacement, wrap
from steerway.core.testing import PREDICTED, STATUSES
from tests import hastened
from tests.faults.sorties import BEGIN, COURSE, FAULTS, SPEED
from tests.faults.table import Table
from tests.kept_outputs import Kept, serving
from tests.ports import free_port

TABLE = Table(
    "service.md", "faults", "| what happens | status | RMC | COG | no position | position | SOG | COG | recovers in |"
)
BOUNDS = 1.0, 0.3, math.radians(10.0)
"""Errors of position, SOG and COG within which the boat counts as recovered: m, m/s, rad."""


class TimedRow(NamedTuple):
    """A row, and the time of its output in the sortie, s."""

    second: float
    row: tuple


class Measured(NamedTuple):
    """The output from the beginning of a fault to the end of the sortie. SI, rad; errors are NaN without output."""

    statuses: tuple[str, ...]  # in order of appearance: of fixes and, without fixes, of ticks
    rmc: str  # all letters of status in RMC
    cog: str  # whether RMC had a COG: always, gaps, never
    silence: float  # longest time between two rows
    unknown: float  # longest time without a position
    position: float  # largest errors
    sog: float
    course: float
    recovery: float  # time from the end of the fault; inf: never
    time: float  # lead of the last row's time over the receiver's clock
    astern: float  # mean distance of the positions behind the boat


class _Rows(Kept):
    """An output that records rows and their times."""

    def fix(self, row):
        super().fix(TimedRow(asyncio.get_running_loop().time(), row))

    def tick(self, row, leg=None, order=None):
        super().tick(TimedRow(asyncio.get_running_loop().time(), row))


@cache
def measured(name: str) -> Measured:
    """Run a fault through a service."""
    fault = FAULTS[name]
    return _judged(fault, *hastened.run(_sail(fault), fault.start))


def line(name: str, found: Measured) -> str:
    """One line of the table; measured numbers are rounded."""
    unknown = f"{found.unknown:.0f} s" if found.unknown > 0.5 else "never"
    recovers = "at once" if found.recovery < 0.05 else f"{found.recovery:.1f} s" if found.recovery < 60 else "not"
    errors = f"{found.position:.1f} m | {found.sog:.2f} m/s | {math.degrees(found.course):.0f}°"
    statuses = ", ".join(found.statuses)
    return f"| {name} | {statuses} | {found.rmc} | {found.cog} | {unknown} | {errors} | {recovers} |"


async def _sail(fault):
    *inputs, sink = (free_port(socket.SOCK_DGRAM) for _ in range(fault.links + 1))
    loop, kept, sentences = asyncio.get_running_loop(), _Rows(), []

    class Instrument(asyncio.DatagramProtocol):
        def datagram_received(self, data, addr):
            sentences.append((loop.time(), data))

    await loop.create_datagram_endpoint(Instrument, local_addr=("127.0.0.1", sink))
    listen = [f"udp://127.0.0.1:{port}" for port in inputs]
    async with serving(listen, [f"udp://127.0.0.1:{sink}"], fault.wanted, kept, latency=fault.latency):
        await asyncio.sleep(0.0)
        with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as receiver:
            for epoch in fault.epochs():
                await asyncio.sleep(epoch.sent - loop.time())
                for line in epoch.output().splitlines(keepends=True):
                    receiver.sendto(line, ("127.0.0.1", inputs[epoch.link]))
            await asyncio.sleep(fault.end - loop.time())
    return kept, sentences


def _judged(fault, kept, sentences):
    rows = [each for each in kept.ticks if each.second >= BEGIN]
    at_fixes = [each for each in kept.fixes if each.second >= BEGIN]
    moments = sorted(at_fixes + [each for each in rows if each.row.status != PREDICTED])
    errors = [(each.second, *_errors(fault, each)) for each in rows]
    received_lines = [data.split(b"\r\n")[0].decode().split(",") for second, data in sentences if second >= BEGIN]
    wrong = [second for second, *each in errors if not all(e <= b for e, b in zip(each, BOUNDS, strict=True))]
    recovered = max((second for second in wrong if second >= fault.until), default=fault.until)
    worst = [
        max((e for e in column if not math.isnan(e)), default=math.nan)
        for column in list(zip(*errors, strict=True))[1:]
    ]
    with_course = [fields[8] != "" for fields in received_lines]
    last = rows[-1]
    return Measured(
        tuple(dict.fromkeys(STATUSES[each.row.status] for each in moments)),
        "".join(sorted({fields[2] for fields in received_lines})),
        "always" if all(with_course) else "gaps" if any(with_course) else "never",
        _longest([BEGIN, *(each.second for each in rows), fault.end]),
        _longest([BEGIN, *(each.second for each in rows if each.row.valid), fault.end]),
        *worst,
        recovered - fault.until if recovered < fault.end - 0.05 else math.inf,
        last.row.time - fault.start - fault.stepped - last.second,
        float(np.mean([_astern(fault, each) for each in rows if each.row.valid])),
    )


def _astern(fault, timed):
    north, east = displacement(timed.row.latitude, timed.row.longitude, *fault.truth(timed.second))
    return -north * math.cos(COURSE) - east * math.sin(COURSE)


def _errors(fault, timed):
    """Errors of position, SOG and COG; NaN for unknown values."""
    row = timed.row
    apart = displacement(row.latitude, row.longitude, *fault.truth(timed.second)) if row.valid else (math.nan,) * 2
    return math.hypot(*apart), abs(row.sog - SPEED), abs(wrap(row.cog - COURSE)) if row.cog == row.cog else math.nan


def _longest(seconds):
    return max(later - earlier for earlier, later in pairwise(seconds))
