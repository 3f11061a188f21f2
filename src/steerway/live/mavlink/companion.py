"""The computer aboard on a MAVLink link: listens to the vehicle's fixes, and carries out the autopilot's orders."""

import asyncio
import time
from typing import Protocol

from steerway.core.checks import positive
from steerway.live.autopilot.states import Order, State
from steerway.live.heard import Row
from steerway.live.links.listening import Hear
from steerway.live.links.mavlink import MavlinkLink
from steerway.live.mavlink.decoding import MavlinkDecoder
from steerway.live.mavlink.guided import SYSTEM, Guided
from steerway.live.uri import Uri

_PERIOD = 0.05  # s between looks at what is due
_STALE = 0.5  # s after which an order is no more carried out
_ONBOARD_COMPUTER = 191  # MAV_COMP_ID_ONBOARD_COMPUTER


class Told(Protocol):
    """What is told of the link: the autopilot. `hands_back`: its safe output is to give no orders."""

    hands_back: bool

    def link(self, name: str, alive: bool) -> None: ...

    def stop(self, reason: str) -> None: ...


class Companion:
    """A listener and an output on one link. Options of its address: those of `Guided`, and `baud`.

    The autopilot is told of its link's life and of what the vehicle does against it.
    """

    def __init__(self, uri: Uri, place: str = ""):
        silence = positive(f"{uri.text}: silence", uri.number("silence", 0.8))
        system = int(uri.number("system", 0))
        self.link = MavlinkLink(uri, self._heard, system or SYSTEM, _ONBOARD_COMPUTER)
        self.guided = Guided(self.link.messages, silence, system)
        self.decoder = MavlinkDecoder(place)
        self.autopilot: Told | None = None
        self._hear: Hear | None = None
        self._order: Order | None = None
        self._ordered = 0.0
        self._was_alive: bool | None = None
        self._runs = False

    async def run(self, hear: Hear | None = None) -> None:
        """Keep the link open until cancelled; as a listener with `hear`, as a speaker without, as both only once."""
        self._hear = hear or self._hear
        if self._runs:
            await asyncio.Event().wait()
        self._runs = True
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self.link.run())
            tasks.create_task(self._speak())
            try:
                await asyncio.Event().wait()
            finally:
                self.link.send(self.guided.farewell(self.autopilot is not None and self.autopilot.hands_back))

    def fix(self, row: Row) -> None:
        """See Output."""

    def tick(self, row: Row, leg=None, order: Order | None = None) -> None:
        """See Output."""
        self._order, self._ordered = order, time.monotonic()

    def close(self) -> None:
        """See Output. The farewell was said when the link was left."""

    def _heard(self, message):
        now = time.monotonic()
        if not self.guided.hear(message, now):
            return False
        self.link.system = self.guided.vehicle[0]
        rows = self.decoder.message(message, now)
        if rows and self._hear is not None:
            self._hear(rows)
        return True

    async def _speak(self):
        while True:
            self._speak_now(time.monotonic())
            await asyncio.sleep(_PERIOD)

    def _speak_now(self, now):
        if self.autopilot is not None:
            self._tell(self.guided.alive(now))
        order = self._order
        if order is not None and order.engaged and now - self._ordered > _STALE:
            order = Order(State.STOPPED, "the orders stay away", engaged=True)
        self.link.send(self.guided.due(now, order))
        if self.guided.complaint and self.autopilot is not None:
            self.autopilot.stop(self.guided.complaint)

    def _tell(self, alive):
        if alive != self._was_alive:
            self._was_alive = alive
            self.autopilot.link(self.link.uri.text, alive)
