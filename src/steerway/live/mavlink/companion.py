"""The companion computer on a MAVLink link: it reads the vehicle's fixes and sends the autopilot's orders."""

import asyncio
import math
import time
from typing import TYPE_CHECKING, Any

from steerway.core.checks import positive
from steerway.core.leg import Leg
from steerway.live.links.link import Deliver
from steerway.live.mavlink.decoding import MavlinkDecoder
from steerway.live.mavlink.guided import SILENCE, SYSTEM, Guided
from steerway.live.mavlink.link import MavlinkLink
from steerway.live.outputs.output import Output
from steerway.live.rows import Order, Row, State
from steerway.live.uri import LOG, Uri

if TYPE_CHECKING:
    from steerway.live.autopilot.supervisor import Supervisor

CARRIERS = ("udpin", "udpout", "tcp")
"""Carriers of MAVLink in addition to a serial line."""
_PERIOD = 0.05  # time between two checks for messages to send, s
_STALE = 0.5  # age above which an order is no longer carried out, s
_LATE = 0.2  # delay (s) above which another sleep lets messages and a tick be handled before link and order are checked
_ONBOARD_COMPUTER = 191  # MAV_COMP_ID_ONBOARD_COMPUTER


class Companion(Output):
    """An input and an output on one link. Options of its address: `silence` and `system` of `Guided`, and `baud`.

    It reports the state of the link, and a refusal by the vehicle, to the supervisor.
    """

    def __init__(self, uri: Uri, place: str = ""):
        silence = positive(f"{uri.text}: silence", uri.number("silence", SILENCE))
        system = int(uri.number("system", 0))
        self.link = MavlinkLink(uri, self._receive, system or SYSTEM, _ONBOARD_COMPUTER)
        self.guided = Guided(self.link.messages, silence, system)
        self._place = place
        self.decoder = MavlinkDecoder(place)
        self.supervisor: Supervisor | None = None
        self._deliver: Deliver | None = None
        self._order: Order | None = None
        self._ordered = 0.0
        self._was_alive: bool | None = None
        self._runs = False

    async def run(self, deliver: Deliver | None = None) -> None:
        """Keep the link open until cancelled: as an input with `deliver`, else as an output. Both share one link."""
        self._deliver = deliver or self._deliver
        if self._runs:
            await asyncio.Event().wait()
        self._runs = True
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self.link.run())
            tasks.create_task(self._send())
            try:
                await asyncio.Event().wait()
            finally:
                self.link.send(self.guided.last_messages(self.supervisor is not None and self.supervisor.hands_back))

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """See Output."""
        self._order, self._ordered = order, time.monotonic()
        if order is not None and order.engaged:
            self.link.send(self.guided.targets_due(self._ordered, order))

    def unreachable(self) -> str:
        """The reason why no order reaches the vehicle; "" if orders reach it."""
        return "" if self.guided.alive(time.monotonic()) else f"link {self.link.uri.text} is lost"

    def _receive(self, message: Any) -> bool:
        now, before = time.monotonic(), self.guided.vehicle
        is_heartbeat = message.get_type() == "HEARTBEAT"
        if is_heartbeat and message.type == self.link.messages.MAV_TYPE_GCS and self.supervisor is not None:
            self.supervisor.operator_heard()
        if not self.guided.receive(message, now):
            return False
        system, _ = self.guided.vehicle or (SYSTEM, 0)
        if before not in (None, self.guided.vehicle):
            LOG.warning("%s: the vehicle is now system %d", self.link.uri.text, system)
            self.decoder = MavlinkDecoder(self._place)
        self.link.system = system
        if message.get_type() == "PARAM_VALUE" and self.supervisor is not None:
            self.supervisor.turns(self.guided.turn_limit)
        if message.get_type() == "STATUSTEXT" and message.severity <= self.link.messages.MAV_SEVERITY_WARNING:
            LOG.warning("vehicle: %s", message.text)
        if self._deliver is not None:
            for row in self.decoder.message(message, now):
                if self.supervisor is None and math.isfinite(row.throttle):
                    continue  # the motors of a vehicle that is only read may idle while others drive the boat
                self._deliver([row], now - self.decoder.age(row, now))
        return True

    async def _send(self) -> None:
        while True:
            before = time.monotonic()
            self._send_now(before)
            await asyncio.sleep(_PERIOD)
            if time.monotonic() - before > _LATE:
                await asyncio.sleep(_PERIOD)

    def _send_now(self, now: float) -> None:
        if self.supervisor is not None:
            alive = self.guided.alive(now)
            if alive != self._was_alive:
                self._was_alive = alive
                self.supervisor.link(self.link.uri.text, alive)
            self.supervisor.vehicle(self.guided.obstacle(now))
        order = self._order
        if order is not None and order.engaged and now - self._ordered > _STALE:
            order = Order(State.STOPPED, "no orders come", engaged=True)
        self.link.send(self.guided.due(now, order))
        if self.guided.refusal and self.supervisor is not None:
            end = self.supervisor.refused if self.guided.is_refused else self.supervisor.stop
            end(self.guided.refusal)
