"""Propeller commands of the autopilot as received: datagrams of JSON, `port` and `starboard` −1 to 1 of full speed."""

import json
import math
import time
from collections.abc import Sequence

from steerway.core.errors import InputError
from steerway.live.links.link import kept_open
from steerway.live.links.transport import Transport
from steerway.live.uri import Uri
from steerway.vessels.vessel import Actuator

SILENCE = 1.0
"""s without a command after which a motor driver stops its propellers."""


class PropellerReceiver:
    """Receives commands and keeps the newest. Raises InputError for a vessel without two propellers."""

    def __init__(self, uri: Uri, actuators: Sequence[Actuator]):
        if len(actuators) != 2:
            raise InputError(f"{uri.text}: commands two propellers, expected a vessel of kind otter")
        self.uri, self._actuators = uri, actuators
        self._newest = (0.0, 0.0)
        self._received = -math.inf

    async def run(self) -> None:
        """Receive until cancelled."""
        link = Transport(self.uri, "udp", lambda data, _: self.receive(data))
        await kept_open(self.uri.text, link.open)

    @property
    def obeyed(self) -> bool:
        """Whether there was ever a command."""
        return self._received > -math.inf

    def command(self) -> tuple[float, ...] | None:
        """Propeller speeds, rad/s; None without a recent command."""
        if time.monotonic() - self._received > SILENCE:
            return None
        return tuple(
            part * (each.high if part > 0.0 else -each.low)
            for part, each in zip(self._newest, self._actuators, strict=True)
        )

    def receive(self, line: bytes) -> None:
        """A datagram; what is no command is ignored."""
        try:
            command = json.loads(line)
            newest = float(command["port"]), float(command["starboard"])
        except (ValueError, TypeError, KeyError, RecursionError):
            return
        if all(map(math.isfinite, newest)):
            self._newest, self._received = newest, time.monotonic()
