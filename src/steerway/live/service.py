"""The service: what listeners hear goes through the navigator, and what it says goes to the outputs, at a rate.

Live, the tick of the event loop's clock, a monotonic one, asks for the present. In replay the log's own times tick, so
that the same log gives the same rows at any speed.
"""

import asyncio
import logging
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from steerway.core.checks import positive
from steerway.estimation.course.motion.layout import LONGEST_GAP
from steerway.formats.nmea0183.writing import Leg
from steerway.live.autopilot.route import Guide
from steerway.live.autopilot.states import Autopilot, Order, State
from steerway.live.clock import FixClock
from steerway.live.heard import Heard, Row, lost
from steerway.live.links.listeners import Listener
from steerway.live.links.speakers import Speaker
from steerway.live.navigator import MEETS, Navigator
from steerway.live.outputs.output import Output
from steerway.live.outputs.rhythm import SLACK
from steerway.live.pulse import Pulse

LOG = logging.getLogger("steerway.live")
RATE = 50.0  # Hz
_BEHIND = 1.0  # s by which ticks may be late before they are left out
_BREATH = 256  # rows of a replay without a pause after which others get their turn


class Latest(NamedTuple):
    """What the newest tick said, for those who look in at their own pace; None where there is none."""

    row: Row
    leg: Leg | None
    order: Order | None
    counts: Mapping[str, int]  # of rows, as of `Navigator`


class Service:
    """The estimate aboard as a running thing.

    rate:    ticks a second, Hz.
    latency: s by which fixes are heard late at the least; see FixClock.
    guide:   follows a route.
    autopilot: is told every fix and steps every tick; the service never starts it.

    `latest` is what the newest tick said.
    """

    def __init__(
        self,
        navigator: Navigator,
        outputs: Sequence[Output],
        rate: float = RATE,
        latency: float = 0.0,
        guide: Guide | None = None,
        autopilot: Autopilot | None = None,
    ):
        self.navigator, self.outputs, self.guide, self.autopilot = navigator, tuple(outputs), guide, autopilot
        self.latest = Latest(lost(math.nan), None, None, navigator.counts)
        self.rate = positive("rate", rate)
        self.clock = FixClock(latency)
        self.pulse = Pulse()
        self._said_until = -math.inf
        self._ticked = math.nan  # when the last tick was, by the clock that times the autopilot

    def hear(self, rows: Iterable[Heard], arrived: float | None = None) -> None:
        """Rows from a live link, that arrived at a time of the event loop's clock; just now if it is not said."""
        now = _now() if arrived is None else arrived
        for heard in rows:
            steps = self.navigator.counts["clock steps"]
            said = self._heard(heard, self.clock.now(now) - self.clock.latency)
            if self.navigator.counts["clock steps"] != steps:
                self.clock.forget()
            for row in said:
                self.clock.hear(row.time, now)
                self._fix(row)

    async def listen(self, listeners: Sequence[Listener], speakers: Sequence[Speaker] = ()) -> None:
        """Run until cancelled."""
        try:
            async with asyncio.TaskGroup() as tasks:
                for speaker in speakers:
                    tasks.create_task(speaker.run())
                for listener in listeners:
                    tasks.create_task(listener.run(self.hear))
                tasks.create_task(self._tick_for_ever())
        finally:
            self.close()

    async def replay(self, rows: Iterable[Heard], speed: float = math.inf, speakers: Sequence[Speaker] = ()) -> None:
        """Play rows in time order at a multiple of their own pace, then close."""
        tasks = [asyncio.create_task(speaker.run()) for speaker in speakers]
        try:
            await self._play(rows, speed)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            self.close()

    def close(self) -> None:
        """Close the outputs and say what became of the rows."""
        for output in self.outputs:
            output.close()
        counts = ", ".join(f"{count} {what}" for what, count in self.navigator.counts.items())
        LOG.info("rows: %s; source %s", counts or "none", self.navigator.choice.present or "none")
        if self.pulse.beats:
            LOG.info("%s", self.pulse)

    def _heard(self, heard, present=math.nan):
        """The rows that are new by what was heard; the autopilot learns of times that do not follow."""
        strayed = self.navigator.strayed
        rows = self.navigator.hear(heard, present)
        if self.autopilot is not None and self.navigator.strayed > strayed:
            self.autopilot.astray()
        return rows

    def _fix(self, row):
        if self.autopilot is not None:
            self.autopilot.fix(row)
        for output in self.outputs:
            output.fix(row)

    def _tick(self, moment, now):
        """Say a moment; `now` is the clock that times the autopilot."""
        row = self.navigator.at(moment)
        if self.guide is not None and self.autopilot is not None and self.autopilot.begins:
            self.guide.restart()
        leg = None if self.guide is None else self.guide.step(row)
        order = None if self.autopilot is None else self._order(row, leg, now)
        self.latest = Latest(row, leg, order, self.navigator.counts)
        for output in self.outputs:
            output.tick(row, leg, order)

    def _order(self, row, leg, now):
        dt = now - self._ticked if math.isfinite(self._ticked) else 0.0
        self._ticked = now
        order = self.autopilot.step(row, leg, dt)
        before = self.latest.order
        if before is None or order.state is not before.state:
            tell = LOG.warning if order.state is State.STOPPED else LOG.info
            tell("autopilot %s%s", order.state, f": {order.reason}" if order.reason else "")
        return order

    async def _tick_for_ever(self):
        beat, self.pulse = _now(), Pulse()
        while True:
            beat += 1.0 / self.rate
            now = _now()
            if beat < now - _BEHIND:
                beat = now
            await asyncio.sleep(max(beat - now, 0.0))
            woken = _now()
            self.pulse.begin()
            present = self.clock.now(woken)
            if math.isfinite(present):
                self._tick_once(math.floor(present * self.rate + SLACK) / self.rate)
            self.pulse.beat(woken - beat)

    def _tick_once(self, moment):
        """Tick, unless this was said already; a clock that stepped back is followed, one that wavers is waited for."""
        if moment > self._said_until or moment < self._said_until - _BEHIND:
            self._said_until = moment
            self._tick(moment, _now())

    async def _play(self, rows, speed):
        next_tick, before, origin = math.nan, math.nan, math.nan
        for k, heard in enumerate(rows):
            if not heard.time - before <= LONGEST_GAP:
                next_tick = math.ceil(heard.time * self.rate)
                origin = _now() - heard.time / speed
            while next_tick / self.rate < heard.time - MEETS:
                await self._until(origin, next_tick / self.rate, speed)
                self._tick(next_tick / self.rate, next_tick / self.rate)
                next_tick += 1
            await self._until(origin, heard.time, speed)
            before = heard.time
            for row in self._heard(heard):
                self._fix(row)
            if k % _BREATH == 0:
                await asyncio.sleep(0)
        for row in self.navigator.finish():
            self._fix(row)
        if next_tick / self.rate <= before + MEETS:
            self._tick(next_tick / self.rate, next_tick / self.rate)

    async def _until(self, origin, moment, speed):
        """Wait for a moment of the log."""
        if math.isfinite(speed):
            left = origin + moment / speed - _now()
            if left > 0.0:
                await asyncio.sleep(left)


def _now():
    """The loop's own clock, so that whoever hastens the loop hastens the service."""
    return asyncio.get_running_loop().time()
