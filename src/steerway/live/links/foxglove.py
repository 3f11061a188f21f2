"""A WebSocket server for Foxglove: where the boat is on its map, and all that is estimated for its plots.

The server has threads of its own in another language; a message costs the service some microseconds. Nothing can be
said to it: it offers no capability.
"""

import asyncio
import importlib.util
import math

from steerway.errors import InputError
from steerway.formats.nmea0183.writing import Leg
from steerway.live.autopilot import Order
from steerway.live.heard import Row
from steerway.live.links.listening import kept_open
from steerway.live.outputs import Rhythm, columns
from steerway.live.uri import Uri
from steerway.records import MOTION_COLUMNS

POSITION, ESTIMATE = "/position", "/estimate"
"""Topics."""
_TEXTS = ("status", "autopilot", "reason")
_NUMBERS = (*MOTION_COLUMNS, "cross_track_m")
_SCHEMA = {
    "type": "object",
    "title": "steerway.Estimate",
    "properties": {name: {"type": ["number", "null"]} for name in _NUMBERS}
    | {name: {"type": ["string", "null"]} for name in _TEXTS},
}


def require_foxglove(uri: Uri) -> None:
    """Raises InputError without the package that Foxglove needs."""
    if importlib.util.find_spec("foxglove") is None:
        raise InputError(f"{uri.text}: needs the package foxglove-sdk, expected pip install steerway[foxglove]")


class FoxgloveServer:
    """Output and link in one: a `foxglove.LocationFix` and a JSON message once a period (s)."""

    def __init__(self, uri: Uri, period: float = 0.1):
        import foxglove
        from foxglove.channels import LocationFixChannel

        self.uri = uri
        self._rhythm = Rhythm(period)
        self._context = foxglove.Context()
        self._position = LocationFixChannel(POSITION, context=self._context)
        self._estimate = foxglove.Channel(ESTIMATE, schema=_SCHEMA, context=self._context)

    async def run(self) -> None:
        """Keep the server open until cancelled."""
        await kept_open(self.uri.text, self._serve)

    def fix(self, row: Row) -> None:
        """See Output."""

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """See Output."""
        if not self._rhythm.strikes(row.time):
            return
        moment = round(row.time * 1e9)
        if row.valid:
            self._position.log(_location(row, moment), log_time=moment)
        self._estimate.log(_estimate(row, leg, order), log_time=moment)

    def close(self) -> None:
        """See Output; the server ends with `run`."""

    async def _serve(self):
        import foxglove

        host, port = self.uri.host or "127.0.0.1", self.uri.port
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


def _location(row, moment):
    """The position as Foxglove's map wants it; height is unknown."""
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


def _estimate(row, leg, order):
    cross_track = None if leg is None or math.isnan(leg.cross_track) else leg.cross_track
    state, reason = (None, None) if order is None else (str(order.state), order.reason)
    return columns(row) | {"cross_track_m": cross_track, "autopilot": state, "reason": reason}
