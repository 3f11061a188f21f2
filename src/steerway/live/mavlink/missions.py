"""MAVLink with a ground station, which uploads and downloads the route, changes leg and speed, pauses and continues.

To the ground station this program appears as an ArduPilot boat that has a mission only. Item 0 is the home position, as
in ArduPilot. Source: mavlink.io, mission protocol, MAV_CMD.
"""

import asyncio
import time
from typing import TYPE_CHECKING, Any

from steerway.core.errors import InputError
from steerway.live.autopilot.mission_items import SPEED, MissionItem
from steerway.live.mavlink.link import MavlinkLink, RoverMode
from steerway.live.uri import LOG, Uri

if TYPE_CHECKING:
    from steerway.live.autopilot.supervisor import Supervisor
    from steerway.live.controls import Controls

_MOST = 1000
"""Largest number of items of a mission."""
_AGAIN, _TRIES = 1.0, 5
"""Time until a missing item is requested again (s), and largest number of requests."""
_PERIOD = 0.2  # time between two checks for messages to send, s
_DEGREES = 1e-7  # degrees per unit of MISSION_ITEM_INT
_UNCHANGED, _AS_PLANNED = -1.0, -2.0
"""Values of the speed in MAV_CMD_DO_CHANGE_SPEED: keep the present speed; return to the mission's own speed."""


class MissionServer:
    """The protocol with one ground station: messages in, answers out; times (s) are arguments."""

    def __init__(self, messages: Any, routed: "Supervisor", controls: "Controls"):
        self._messages, self._routed, self._controls = messages, routed, controls
        self._peer = (0, 0)
        self._expected = 0  # items of the upload under way, 0 for none
        self._items: list[MissionItem] = []
        self._asked, self._tries = 0.0, 0
        self._heartbeat = -1.0

    def receive(self, message: Any, now: float) -> list[Any]:
        """The answers to a message."""
        handler = _HANDLERS.get(message.get_type())
        if message.get_type() == "HEARTBEAT" and message.type == self._messages.MAV_TYPE_GCS:
            self._routed.operator_heard()
        if handler is None or getattr(message, "mission_type", 0) != self._messages.MAV_MISSION_TYPE_MISSION:
            return self._of_another_kind(message) if handler is not None else []
        self._peer = message.get_srcSystem(), message.get_srcComponent()
        return handler(self, message, now)

    def due(self, now: float) -> list[Any]:
        """Heartbeat and the item under way once a second, and the request of a missing item."""
        due = []
        m = self._messages
        if now - self._heartbeat >= 1.0:
            self._heartbeat = now
            kind = m.MAV_TYPE_SURFACE_BOAT, m.MAV_AUTOPILOT_ARDUPILOTMEGA, m.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
            due.append(m.MAVLink_heartbeat_message(*kind, int(RoverMode.GUIDED), m.MAV_STATE_ACTIVE, 3))
            due.append(m.MAVLink_mission_current_message(self._routed.guide.item_under_way))
        if self._expected and now - self._asked >= _AGAIN:
            if self._tries >= _TRIES:
                self._expected = 0
                return [*due, self._ack(m.MAV_MISSION_OPERATION_CANCELLED)]
            due += self._request(now)
        return due

    def _of_another_kind(self, message: Any) -> list[Any]:
        """The answer to requests about fences and rally points: none. They are set in the mission file only."""
        self._peer = message.get_srcSystem(), message.get_srcComponent()
        m, kind = self._messages, message.mission_type
        if message.get_type() == "MISSION_REQUEST_LIST":
            return [m.MAVLink_mission_count_message(*self._peer, 0, kind)]
        return [m.MAVLink_mission_ack_message(*self._peer, m.MAV_MISSION_UNSUPPORTED, kind)]

    def _on_count(self, message: Any, now: float) -> list[Any]:
        if not 0 < message.count <= _MOST:
            m = self._messages
            return [self._ack(m.MAV_MISSION_NO_SPACE if message.count else m.MAV_MISSION_DENIED)]
        self._expected, self._items, self._tries = message.count, [], 0
        return self._request(now)

    def _on_item(self, message: Any, now: float) -> list[Any]:
        if not self._expected or message.seq != len(self._items):
            return self._request(now) if self._expected else []
        scale = _DEGREES if message.get_type() == "MISSION_ITEM_INT" else 1.0
        parameters = message.param1, message.param2, message.param3, message.param4
        place = message.x * scale, message.y * scale, message.z
        self._items.append(MissionItem(message.command, message.frame, parameters, *place))
        self._tries = 0
        if len(self._items) < self._expected:
            return self._request(now)
        self._expected = 0
        return self._take()

    def _take(self) -> list[Any]:
        m = self._messages
        try:
            self._routed.take_mission(self._items)
        except InputError as error:
            LOG.warning("mission refused: %s", error)
            return [self._ack(m.MAV_MISSION_INVALID), m.MAVLink_statustext_message(4, str(error).encode()[:50])]
        LOG.info("mission of %d items taken from system %d", len(self._items), self._peer[0])
        return [self._ack(m.MAV_MISSION_ACCEPTED)]

    def _on_list(self, message: Any, now: float) -> list[Any]:
        count = len(self._routed.guide.items)
        return [self._messages.MAVLink_mission_count_message(*self._peer, count)]

    def _on_request(self, message: Any, now: float) -> list[Any]:
        items, m = self._routed.guide.items, self._messages
        if message.seq >= len(items):
            return [self._ack(m.MAV_MISSION_INVALID_SEQUENCE)]
        item = items[message.seq]
        place = round(item.latitude / _DEGREES), round(item.longitude / _DEGREES), item.altitude
        current = int(message.seq == self._routed.guide.item_under_way)
        values = message.seq, item.frame, item.command, current, 1, *item.parameters, *place
        return [m.MAVLink_mission_item_int_message(*self._peer, *values)]

    def _on_current(self, message: Any, now: float) -> list[Any]:
        try:
            self._routed.guide.go_to_item(message.seq)
        except InputError as error:
            LOG.warning("%s", error)
        return [self._messages.MAVLink_mission_current_message(self._routed.guide.item_under_way)]

    def _on_clear(self, message: Any, now: float) -> list[Any]:
        """Refuse to clear the mission: the boat keeps it."""
        return [self._ack(self._messages.MAV_MISSION_DENIED)]

    def _on_command(self, message: Any, now: float) -> list[Any]:
        """Carry out a command: change the speed, pause (hold the position) or continue the route."""
        m, what = self._messages, message.command
        if what not in (SPEED, m.MAV_CMD_DO_PAUSE_CONTINUE):
            return [m.MAVLink_command_ack_message(what, m.MAV_RESULT_UNSUPPORTED)]
        try:
            if what != SPEED:
                self._do("route" if message.param1 == 1.0 else "hold-position")
            elif message.param3 >= 0.0:
                raise InputError("a throttle is asked for, expected a speed")
            elif message.param2 != _UNCHANGED:
                guide = self._routed.guide
                by = message.param2 - float(guide.route.speed[guide.target]) - guide.faster
                self._do("faster", None if message.param2 == _AS_PLANNED else by)
        except InputError as error:
            text = m.MAVLink_statustext_message(4, str(error).encode()[:50])
            return [m.MAVLink_command_ack_message(what, m.MAV_RESULT_DENIED), text]
        return [m.MAVLink_command_ack_message(what, m.MAV_RESULT_ACCEPTED)]

    def _do(self, what: str, value: float | None = None) -> None:
        self._controls.do(what, value, f"MAVLink system {self._peer[0]}")

    def _request(self, now: float) -> list[Any]:
        self._asked, self._tries = now, self._tries + 1
        return [self._messages.MAVLink_mission_request_int_message(*self._peer, len(self._items))]

    def _ack(self, result: int) -> Any:
        return self._messages.MAVLink_mission_ack_message(*self._peer, result)


_HANDLERS = {
    "MISSION_COUNT": MissionServer._on_count,
    "MISSION_ITEM_INT": MissionServer._on_item,
    "MISSION_ITEM": MissionServer._on_item,
    "MISSION_REQUEST_LIST": MissionServer._on_list,
    "MISSION_REQUEST_INT": MissionServer._on_request,
    "MISSION_REQUEST": MissionServer._on_request,
    "MISSION_SET_CURRENT": MissionServer._on_current,
    "MISSION_CLEAR_ALL": MissionServer._on_clear,
    "COMMAND_LONG": MissionServer._on_command,
    "COMMAND_INT": MissionServer._on_command,
}


class MissionLink:
    """A link on which ground stations upload missions; runs beside the service."""

    def __init__(self, uri: Uri, routed: "Supervisor", controls: "Controls"):
        self.link = MavlinkLink(uri, self._receive)
        self.server = MissionServer(self.link.messages, routed, controls)

    async def run(self) -> None:
        """Keep the link open until cancelled."""
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self.link.run())
            while True:
                self.link.send(self.server.due(time.monotonic()))
                await asyncio.sleep(_PERIOD)

    def _receive(self, message: Any) -> bool:
        self.link.send(self.server.receive(message, time.monotonic()))
        return True
