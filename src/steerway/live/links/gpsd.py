"""gpsd: its JSON reports over TCP."""

import math

from steerway.live.base.rows import InputRow
from steerway.live.links.decoding import JsonDecoder, angle, moment
from steerway.live.links.tcp import TcpInput


class GpsdInput(TcpInput):
    """Reads the reports of gpsd."""

    greeting = b'?WATCH={"enable":true,"json":true}\n'

    def _decoder(self):
        return GpsdDecoder()


class GpsdDecoder(JsonDecoder):
    """gpsd's JSON: TPV reports, several an epoch. `magtrack` is never read, its sign is not reliable.

    Fields: gpsd_json(5).
    """

    def _rows(self, message):
        if message["class"] != "TPV" or message.get("mode", 0) < 2 or "lat" not in message:
            return []
        speed = {"sog": message["speed"]} if "speed" in message else {}
        course = {"cog": angle(message["track"])} if "track" in message else {}
        place = math.radians(message["lat"]), angle(message["lon"])
        name = f"gpsd {message.get('device', '')}".strip()
        return [InputRow(name, moment(message["time"]), *place, _gpsd_deviation(message), **speed, **course)]


def _gpsd_deviation(message):
    """Standard deviation of north and of east by a radius, or by its parts; gpsd does not define their probability."""
    if "eph" in message:
        return message["eph"] / math.sqrt(2.0)
    if "epx" in message and "epy" in message:
        return math.hypot(message["epx"], message["epy"]) / math.sqrt(2.0)
    return math.nan
