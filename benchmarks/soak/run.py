"""The soak: runs the command as a user starts it, its consumers, its receiver and the idle loop."""

import asyncio
import contextlib
import re
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import polars as pl

from benchmarks.soak.consumers import Consumer, consumers
from benchmarks.soak.receiver import Receiver
from benchmarks.support.harness import Result

SETTLED = 60.0
"""Memory may not grow after this time (s), or after half of the time from the first row on if that ends before."""
_NUMBER = r"([\d.e+-]+)"
_SPREAD = rf"{_NUMBER} ms \(99\.9 %: {_NUMBER}, at most {_NUMBER}\)"
_PULSE = re.compile(
    rf"{_NUMBER} ticks, processor time {_SPREAD}, from tick to tick {_SPREAD}, lateness {_SPREAD}, {_NUMBER} later than"
)
_USED = re.compile(rf"{_NUMBER} used")


class Rhythm(NamedTuple):
    """The statistics of ticks in the log, ms."""

    ticks: float
    own: float  # processor time in a tick
    own_999: float
    own_most: float
    compute: float  # processor time of the thread from tick to tick
    compute_999: float
    compute_most: float
    late: float
    late_999: float
    late_most: float
    missed: float


class Soak(NamedTuple):
    """Result of a run; s and bytes."""

    first_row: float  # s from the start
    boat: Rhythm
    idle: Rhythm
    memory: list[tuple[float, int]]  # s since the start, resident bytes
    rows: int
    states: pl.DataFrame  # of the autopilot, from the table
    used: int
    reported: int
    consumers: list[Consumer]
    code: int
    log: str

    @property
    def steered(self) -> float:
        """Fraction of rows in which the autopilot was running."""
        return float((self.states["state"] == "running").mean()) if self.states.height else 0.0

    @property
    def growth(self) -> float:
        """Growth of memory after start-up (see `SETTLED`), bytes."""
        end = self.memory[-1][0]
        settled = min(SETTLED, 0.5 * (self.first_row + end))
        after = [size for when, size in self.memory if when >= settled]
        return float(after[-1] - after[0])


async def soak(seconds: float) -> Soak:
    """Run for `seconds` s."""
    receiver = Receiver()
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "run.parquet"
        route = Path(folder) / "route.toml"
        route.write_text(receiver.route(), encoding="utf-8")
        listeners = consumers(str(table), str(route))
        async with contextlib.AsyncExitStack() as stack:
            for each in listeners:
                await stack.enter_async_context(each.listening())
            arguments = [argument for each in listeners for argument in each.arguments]
            boat, begun = await _started(receiver, arguments), time.monotonic()
            try:
                await asyncio.wait_for(listeners[0].connected.wait(), 120.0)  # the serial port is open by then
                sending = asyncio.create_task(receiver.send())
                stack.callback(sending.cancel)
                idle = await _process("-m", "benchmarks.soak.idle", str(seconds))
                stack.callback(_end, idle)
                first_row, rows, memory = await _watched(boat, begun, seconds)
                sending.cancel()
                await asyncio.sleep(0.5)
            except EOFError:
                log = (await boat.stderr.read()).decode()
                raise SystemExit(f"the service ended with exit code {await boat.wait()}:\n{log}") from None
            finally:
                _end(boat)
            rest, log = await boat.communicate()
            output, _ = await idle.communicate()
        log = log.decode()
        rows += rest.count(b"\n")
        states = pl.read_parquet(table, columns=["state", "reason"]) if table.exists() else pl.DataFrame()
    used = _USED.search(log)
    account = int(used[1]) if used else 0, receiver.positions()
    receiver.close()
    rhythms = _rhythm(log), _rhythm(output.decode())
    return Soak(first_row, *rhythms, memory, rows, states, *account, listeners, boat.returncode, log)


async def _started(receiver, arguments):
    code = "from steerway.commands.cli import main; main()"
    source = ["--from", f"serial:{receiver.path}?baud=38400", "--source", "GP", "--rate", "50", "--to", "stdout:"]
    return await _process("-c", code, "live", *source, *arguments)


async def _process(*arguments):
    pipe = asyncio.subprocess.PIPE
    return await asyncio.create_subprocess_exec(sys.executable, *arguments, stdout=pipe, stderr=pipe, limit=1 << 24)


def _end(process):
    with contextlib.suppress(ProcessLookupError):
        process.terminate()


async def _watched(boat, begun, seconds):
    """Time of the first row, number of rows, and memory over time. Raises EOFError if the command ends early."""

    async def row():
        if not await boat.stdout.readline():
            raise EOFError
        return 1

    await asyncio.wait_for(row(), 120.0)
    first_row, rows, memory = time.monotonic() - begun, 1, []
    while (now := time.monotonic() - begun) < seconds:
        memory.append((now, _resident(boat.pid)))
        until = now + min(1.0, seconds - now)
        while (left := until - (time.monotonic() - begun)) > 0.0:
            with contextlib.suppress(TimeoutError):
                rows += await asyncio.wait_for(row(), left)
    memory.append((now, _resident(boat.pid)))
    return first_row, rows, memory


def _resident(pid):
    """Resident memory of a process, bytes. Raises EOFError if the process has ended."""
    found = re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{pid}/status").read_text(encoding="utf-8"))
    if found is None:
        raise EOFError
    return 1024 * int(found[1])


def _rhythm(text):
    found = _PULSE.search(text)
    return Rhythm(*map(float, found.groups())) if found else Rhythm(*[float("nan")] * len(Rhythm._fields))


def results(done: Soak):
    """The table of a run."""
    boat, idle = done.boat, done.idle
    received = ", ".join(f"{each.name} {each.received:,} bytes" for each in done.consumers if each.received)
    yield Result("outputs", float(len(done.consumers)), note=", ".join(each.name for each in done.consumers))
    yield Result("ticks", boat.ticks, note=received)
    yield Result("start to the first row", done.first_row, "s", at_most=3.0)
    for what, name, limit in (
        ("processor time in a tick, median", "own", None),
        ("processor time in a tick, 99.9 %", "own_999", 2.0),
        ("processor time in a tick, most", "own_most", None),
        ("processor time from tick to tick, median", "compute", None),
        ("processor time from tick to tick, 99.9 %", "compute_999", 5.0),
        ("processor time from tick to tick, most", "compute_most", None),
        ("lateness, 99.9 %", "late_999", None),
        ("lateness, most", "late_most", max(50.0, idle.late_most)),
    ):
        note = "" if name.startswith("own") else f"idle loop {getattr(idle, name):.3g}"
        yield Result(what, getattr(boat, name), "ms", at_most=limit, note=note)
    yield Result("ticks later than 50 ms", boat.missed, at_most=idle.missed, note=f"idle loop {idle.missed:.0f}")
    yield Result("memory at the end", done.memory[-1][1] / 1e6, "MB")
    yield Result("… growth after start-up", done.growth / 1e6, "MB", at_most=5.0)
    unused, unwritten = abs(done.reported - done.used), abs(done.rows - done.states.height)
    yield Result("valid fixes sent but not used", unused, at_most=1.0, note=f"of {done.reported}")
    yield Result("rows output but not in the table", unwritten, at_most=0.0, note=f"of {done.rows}")
    last = done.states.row(-1) if done.states.height else ("", "")
    yield Result("autopilot running", 100.0 * done.steered, "%", at_least=50.0, note=" ".join(map(str, last)))
    yield Result("exit code", float(done.code), at_most=0.0)
