"""Propeller commands as the autopilot says them: datagrams of JSON, `port` and `starboard` −1 to 1 of full speed."""

import asyncio
import json
import math
import time
from collections.abc import Sequence

from steerway.core.errors import InputError
from steerway.live.links.listening import kept_open
from steerway.live.uri import Uri
from steerway.vessels.actuators import Actuator

SILENCE = 1.0
"""s without a command after which a motor driver stops its propellers."""


class Propellers:
    """Listens for commands and keeps the newest. Raises InputError for a vessel without two propellers."""

    def __init__(self, uri: Uri, actuators: Sequence[Actuator]):
        if len(actuators) != 2:
            raise InputError(f"{uri.text}: commands two propellers, expected a vessel of kind otter")
        self.uri, self._actuators = uri, actuators
        self._newest = (0.0, 0.0)
        self._heard = -math.inf

    async def run(self) -> None:
        """Listen until cancelled."""
        await kept_open(self.uri.text, self._listen)

    @property
    def obeyed(self) -> bool:
        """Whether there was ever a command."""
        return self._heard > -math.inf

    def command(self) -> tuple[float, ...] | None:
        """Propeller speeds, rad/s; None when nobody commands."""
        if time.monotonic() - self._heard > SILENCE:
            return None
        return tuple(
            part * (each.high if part > 0.0 else -each.low)
            for part, each in zip(self._newest, self._actuators, strict=True)
        )

    def hear(self, line: bytes) -> None:
        """A datagram; what is no command is passed over."""
        try:
            said = json.loads(line)
            newest = float(said["port"]), float(said["starboard"])
        except (ValueError, TypeError, KeyError):
            return
        if all(map(math.isfinite, newest)):
            self._newest, self._heard = newest, time.monotonic()

    async def _listen(self):
        hear = self.hear

        class Datagrams(asyncio.DatagramProtocol):
            def datagram_received(self, data, addr):
                hear(data)

        here = (self.uri.host or "127.0.0.1", self.uri.port)
        transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(Datagrams, local_addr=here)
        try:
            await asyncio.Event().wait()
        finally:
            transport.close()
