"""A WebSocket server for Foxglove: the position for its map, and the whole estimate for its plots.

The server has native threads of its own; a message costs the service some microseconds. It offers its clients no
capability, so they cannot send anything.
"""

import asyncio
import json
import math
import socket
from typing import Any

from steerway.core.leg import Leg
from steerway.core.records import MOTION_COLUMNS
from steerway.live.links.link import kept_open
from steerway.live.outputs.lines import json_line
from steerway.live.outputs.output import Output, Rhythm
from steerway.live.rows import Order, Row
from steerway.live.uri import Uri

POSITION, ESTIMATE = "/position", "/estimate"
"""Topics."""
_TEXTS = ("status", "state", "reason")
_SCHEMA = {
    "type": "object",
    "title": "steerway.Estimate",
    "properties": {name: {"type": ["number", "null"]} for name in MOTION_COLUMNS}
    | {name: {"type": ["string", "null"]} for name in _TEXTS},
}


class FoxgloveServer(Output):
    """Output and link in one. Sends a `foxglove.LocationFix` and the JSON message of `stdout:` once a period (s)."""

    def __init__(self, uri: Uri, period: float = 0.1):
        import foxglove
        from foxglove.channels import LocationFixChannel

        self.uri = uri
        self._rhythm = Rhythm(period)
        self._context = foxglove.Context()
        self._position = LocationFixChannel(POSITION, context=self._context)
        schema = foxglove.Schema(name="steerway.Estimate", encoding="jsonschema", data=json.dumps(_SCHEMA).encode())
        self._estimate = foxglove.Channel(ESTIMATE, schema=schema, message_encoding="json", context=self._context)

    async def run(self) -> None:
        """Keep the server open until cancelled."""
        await kept_open(self.uri.text, self._serve)

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """See Output."""
        if not self._rhythm.is_due(row.time):
            return
        moment = round(row.time * 1e9)
        if row.valid:
            self._position.log(_location(row, moment), log_time=moment)
        self._estimate.log(json_line(row, order), log_time=moment)

    async def _serve(self) -> None:
        import foxglove

        host, port = self.uri.host or "127.0.0.1", self.uri.port
        socket.create_server((host, port)).close()  # Foxglove's own error does not say that the port is in use
        try:
            server = foxglove.start_server(
                name="steerway", host=host, port=port, capabilities=[], context=self._context
            )
        except RuntimeError as error:
            raise OSError(str(error)) from None
        try:
            await asyncio.Event().wait()
        finally:
            server.stop()


def _location(row: Row, moment: int) -> Any:
    """The position as a Foxglove message; its height is unknown."""
    from foxglove.messages import LocationFix, LocationFixPositionCovarianceType, Timestamp, Vector3

    variance = row.position_std**2
    velocity = None
    if not math.isnan(row.cog):
        velocity = Vector3(x=row.sog * math.sin(row.cog), y=row.sog * math.cos(row.cog), z=0.0)
    return LocationFix(
        timestamp=Timestamp(*divmod(moment, 1_000_000_000)),
        frame_id="boat",
        latitude=math.degrees(row.latitude),
        longitude=math.degrees(row.longitude),
        altitude=math.nan,
        position_covariance=[variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, math.nan],
        position_covariance_type=LocationFixPositionCovarianceType.Approximated,
        velocity=velocity,
    )
