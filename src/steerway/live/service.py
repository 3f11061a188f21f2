"""The service passes input rows to the navigator and sends its estimates to the outputs at a fixed rate.

A live run takes its ticks from the event loop's monotonic clock. A replay takes them from the times in the log, so that
a log gives the same rows at any replay speed.
"""

import asyncio
import logging
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

from steerway.core.checks import positive
from steerway.core.errors import InputError
from steerway.core.gaps import LONGEST_GAP
from steerway.core.leg import Leg
from steerway.live.autopilot.supervisor import Supervisor
from steerway.live.controls import Controls
from steerway.live.links.link import Reads, Runs
from steerway.live.navigator import MEETS, Navigator
from steerway.live.outputs.output import SLACK, Output
from steerway.live.recording import Recorder
from steerway.live.rows import InputRow, Order, Row, State, believable, lost
from steerway.live.startup_buffer import StartupBuffer
from steerway.live.tick_timing import FixClock, Pulse

LOG = logging.getLogger("steerway.live")
RATE = 50.0  # Hz
_BEHIND = 1.0  # largest delay of ticks before they are skipped, s
_SAID = 5.0  # shortest time between two log lines about different reasons of one state, s
_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?")  # in a reason; reasons that differ only in numbers count as the same
_YIELD = 256  # number of rows of a replay after which other tasks run


class LatestTick(NamedTuple):
    """The newest tick, for readers that poll. `leg` is None without a leg under way, `order` without an autopilot."""

    row: Row
    leg: Leg | None
    order: Order | None


class Service:
    """Runs navigation, guidance and supervision between inputs and outputs.

    rate:    ticks a second, Hz.
    latency: lowest latency of fixes, s; see FixClock.
    supervisor: receives every fix, and gives leg and order at every tick; the service never starts the autopilot.
    recorder: receives every input row before it is used; pass it in `outputs` too.
    """

    def __init__(
        self,
        navigator: Navigator,
        outputs: Sequence[Output],
        rate: float = RATE,
        latency: float = 0.0,
        supervisor: Supervisor | None = None,
        recorder: Recorder | None = None,
    ):
        self.navigator, self.outputs, self.supervisor = navigator, tuple(outputs), supervisor
        self.latest = LatestTick(lost(math.nan), None, None)
        self.rate = positive("rate", rate)
        self.clock = FixClock(latency)
        self.startup = StartupBuffer(navigator.choice.names)
        self._preferred = ""
        self.recorder = recorder
        self.controls = Controls(supervisor)
        self.pulse = Pulse()
        self._sent_until = -math.inf
        self._said: tuple[tuple[State, str] | None, float] = None, -math.inf  # state and reason logged last, and when
        self._ticked = math.nan  # time of the last tick, by the clock that times the supervisor

    def receive(self, rows: Iterable[InputRow], arrived: float | None = None) -> None:
        """Take rows of a live link; `arrived` is their arrival by the event loop's clock (s), by default now."""
        admitted: list[tuple[InputRow, float]] = []
        with self._dropping("rows of a link"):
            admitted = self.startup.add_rows(self._believed(rows), _now() if arrived is None else arrived)
        for row, came in admitted:
            self.use(row, came)

    def unreachable(self) -> str:
        """The reason why no order reaches the boat; "" if orders reach it."""
        if self.supervisor is None:
            return ""
        for name in ("unreachable", "leg_unreachable"):  # outputs of orders, else outputs of the leg for an autopilot
            reasons = [getattr(each, name)() for each in self.outputs if hasattr(each, name)]
            if reasons:
                return reasons[0] if all(reasons) else ""
        return "no output carries orders"

    def use(self, row: InputRow, now: float = math.nan) -> None:
        """Use a row with its final source name. `now` is its arrival (s, event loop's clock), NaN for a log."""
        with self._dropping(row):
            self._use(row, now)

    @contextmanager
    def _dropping(self, what: object) -> Iterator[None]:
        """Drop and count input that raises an exception: bad data from a link must not end the control of a boat."""
        try:
            yield
        except OSError:
            raise  # an output failed
        except Exception:
            if not self.navigator.counts["failed"]:
                LOG.exception("an input was dropped because of an error (further ones are only counted): %s", what)
            self.navigator.counts["failed"] += 1

    def _believed(self, rows: Iterable[InputRow]) -> Iterator[InputRow]:
        """The rows without impossible values (see `believable`); rows that had some are counted."""
        for given in rows:
            row = None
            with self._dropping(given):
                row = believable(given)
            if row is not given:
                self.navigator.counts["beyond all limits"] += 1
            if row is not None:
                yield row

    def _use(self, row: InputRow, now: float) -> None:
        if self.recorder is not None:
            self.recorder.input(row, now, self.startup.chosen)
        if self.startup.chosen != self._preferred:
            self._preferred = self.startup.chosen
            self.navigator.choice.prefer(self._preferred, row.time)
        steps = self.navigator.counts["clock steps"]
        present = math.nan if math.isnan(now) else self.clock.now(now) - self.clock.latency
        estimates = self._navigated(row, present)
        if self.navigator.counts["clock steps"] != steps:
            self.clock.forget()
        for estimate in estimates:
            if not math.isnan(now):
                self.clock.add(estimate.time, now)
            self._fix(estimate, now)

    async def run(self, inputs: Sequence[Reads], links: Sequence[Runs] = ()) -> None:
        """Run until cancelled; `links` are the links of the outputs."""
        try:
            async with asyncio.TaskGroup() as tasks:
                for link in links:
                    tasks.create_task(link.run())
                for each in inputs:
                    tasks.create_task(each.run(self.receive))
                tasks.create_task(self._tick_for_ever())
        finally:
            self.close()

    async def replay(self, rows: Iterable[InputRow], speed: float = math.inf, links: Sequence[Runs] = ()) -> None:
        """Play rows in time order at a multiple of their own pace, then close."""
        tasks = [asyncio.create_task(link.run()) for link in links]
        try:
            await self._play(rows, speed)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            self.close()

    def close(self) -> None:
        """Close the outputs and log the counts of rows."""
        for output in self.outputs:
            output.close()
        counts = ", ".join(f"{count} {what}" for what, count in self.navigator.counts.items())
        LOG.info("rows: %s; source %s", counts or "none", self.navigator.choice.present or "none")
        if self.pulse.beats:
            LOG.info("%s", self.pulse)

    def _navigated(self, row: InputRow, present: float = math.nan) -> list[Row]:
        """The new estimates after an input row; the supervisor is informed of a row out of time order."""
        untimely = self.navigator.untimely
        if self.supervisor is not None:
            self.supervisor.take(row)
        estimates = self.navigator.add(row, present)
        if self.supervisor is not None and self.navigator.untimely > untimely:
            self.supervisor.untimely()
        return estimates

    def _fix(self, row: Row, now: float = math.nan) -> None:
        """Pass on a new estimate; `now` is the arrival of its fix, NaN in a replay."""
        if self.supervisor is not None:
            since = now - self._ticked
            self.supervisor.fix(row, self.navigator.last_input, since if since > 0.0 else 0.0)
        for output in self.outputs:
            output.fix(row)

    def _tick(self, moment: float, now: float) -> None:
        """Output the estimate at a moment; `now` is read from the clock that times the supervisor."""
        row = self.controls.row = self.navigator.at(moment)
        leg = order = None
        if self.supervisor is not None:
            order = self._order(self.supervisor, row, now)
            leg = self.supervisor.leg
        self.latest = LatestTick(row, leg, order)
        for output in self.outputs:
            output.tick(row, leg, order)

    def _order(self, supervisor: Supervisor, row: Row, now: float) -> Order:
        dt = now - self._ticked if math.isfinite(self._ticked) else 0.0
        self._ticked = now
        order = supervisor.step(row, dt)
        self._say(order, now)
        return order

    def _say(self, order: Order, now: float) -> None:
        """Log a new state at once, and a new reason for the same state at most every `_SAID` s."""
        before, said = self._said
        words = order.state, _NUMBER.sub("", order.reason)
        if words == before or (before is not None and order.state is before[0] and now - said < _SAID):
            return
        self._said = words, now
        log = LOG.warning if order.state is State.STOPPED else LOG.info
        log("autopilot %s%s", order.state, f": {order.reason}" if order.reason else "")

    async def _tick_for_ever(self) -> None:
        beat, self.pulse = _now(), Pulse()
        while True:
            beat += 1.0 / self.rate
            now = _now()
            if beat < now - _BEHIND:
                beat = now
            await asyncio.sleep(max(beat - now, 0.0))
            woken = _now()
            self.pulse.begin()
            held: list[tuple[InputRow, float]] = []
            with self._dropping("rows of a link"):
                held = self.startup.take_ready(woken)
            for row, arrived in held:
                self.use(row, arrived)
            if self.startup.refusal:
                raise InputError(self.startup.refusal)
            present = self.clock.now(woken)
            if math.isfinite(present):
                self._tick_once(math.floor(present * self.rate + SLACK) / self.rate)
            self.pulse.beat(woken - beat)

    def _tick_once(self, moment: float) -> None:
        """Tick unless this time was output already; after a step back in time, only if it exceeds `_BEHIND`."""
        if moment > self._sent_until or moment < self._sent_until - _BEHIND:
            self._sent_until = moment
            self._tick(moment, _now())

    async def _play(self, rows: Iterable[InputRow], speed: float) -> None:
        next_tick, before, origin = math.nan, math.nan, math.nan
        for k, row in enumerate(self._believed(rows)):
            if not row.time - before <= LONGEST_GAP:
                next_tick = math.ceil(row.time * self.rate)
                origin = _now() - row.time / speed
            while next_tick / self.rate < row.time - MEETS:
                await self._until(origin, next_tick / self.rate, speed)
                self._tick(next_tick / self.rate, next_tick / self.rate)
                next_tick += 1
            await self._until(origin, row.time, speed)
            before = row.time
            self.use(row)
            if k % _YIELD == 0:
                await asyncio.sleep(0)
        for rest in self.navigator.finish():
            self._fix(rest)
        if next_tick / self.rate <= before + MEETS:
            self._tick(next_tick / self.rate, next_tick / self.rate)

    async def _until(self, origin: float, moment: float, speed: float) -> None:
        """Wait until the replay is due to reach a moment of the log."""
        if math.isfinite(speed):
            left = origin + moment / speed - _now()
            if left > 0.0:
                await asyncio.sleep(left)


def _now() -> float:
    """The event loop's clock (s), which tests run faster."""
    return asyncio.get_running_loop().time()
