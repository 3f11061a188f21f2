"""gpsd over TCP: the bytes of its receiver, or its JSON reports.

If gpsd has one receiver, and this receiver sends NMEA 0183 or UBX, its own bytes are read through gpsd. Epochs and
sources are then the same as in a log of the receiver. Otherwise gpsd's JSON reports are read.
"""

import json
import math
from collections.abc import Callable
from typing import Any

from steerway.live.links.decoding import JsonDecoder, ReceiverDecoder, angle, moment
from steerway.live.links.link import Feed, Input
from steerway.live.links.transport import Transport
from steerway.live.rows import InputRow

_JSON = b'?WATCH={"enable":true,"json":true}\n'
_READ_AS_THEY_ARE = ("NMEA0183", "Garmin NMEA", "MTK-3301", "u-blox")
"""Receiver types, by gpsd's driver names, whose own bytes are read."""


class GpsdInput(Input["GpsdDecoder"]):
    """Reads a receiver through gpsd."""

    def _decoder(self) -> "GpsdDecoder":
        return GpsdDecoder(self.place)

    async def _read(self, feed: Feed["GpsdDecoder"]) -> None:
        def receive(data: bytes, answer: Callable[[bytes], object]) -> None:
            feed.feed(data)
            if feed.decoder.request:
                answer(feed.decoder.request)
                feed.decoder.request = b""

        feed.decoder.restart()
        link = Transport(self.uri, "tcp", receive, lambda: link.write(_JSON))
        await link.open()


class GpsdDecoder(JsonDecoder):
    """Decodes gpsd's JSON, see gpsd_json(5): DEVICES, and TPV with several reports per epoch. `magtrack` is not read,
    because its sign is not reliable.

    `request` is the message to send to gpsd, b"" for none; after a request that names a receiver, gpsd sends its bytes.
    """

    def __init__(self, place: str = ""):
        super().__init__()
        self._place = place
        self.restart()

    def restart(self) -> None:
        """Begin again with JSON reports, on a new connection."""
        self.request = b""
        self._receiver: ReceiverDecoder | None = None
        self._drivers: dict[str, str] = {}

    def feed(self, data: bytes) -> list[InputRow]:
        """See Decoder."""
        return super().feed(data) if self._receiver is None else self._receiver.feed(data)

    def complete_on_silence(self) -> list[InputRow]:
        """See Decoder."""
        return super().complete_on_silence() if self._receiver is None else self._receiver.complete_on_silence()

    def _rows(self, message: dict[str, Any]) -> list[InputRow]:
        if self._receiver is not None:  # the rest of a piece that came before the receiver's bytes
            return []
        if message["class"] in ("DEVICES", "DEVICE"):
            self._devices(message.get("devices", [message]))
        if message["class"] != "TPV" or message.get("mode", 0) < 2 or "lat" not in message or "time" not in message:
            return []
        if not self._drivers.get(message.get("device", ""), "unlisted"):
            return []  # gpsd has not identified this receiver yet; its own bytes may follow
        sog = float(message.get("speed", math.nan))
        cog = angle(message["track"]) if "track" in message else math.nan
        place = math.radians(message["lat"]), angle(message["lon"])
        name = f"gpsd {message.get('device', '')}".strip()
        return [InputRow(name, moment(message["time"]), *place, _gpsd_deviation(message), sog, cog)]

    def _devices(self, devices: list[dict[str, Any]]) -> None:
        self._drivers |= {each["path"]: each.get("driver", "") for each in devices if "path" in each}
        if len(self._drivers) == 1:
            ((path, driver),) = self._drivers.items()
            if driver in _READ_AS_THEY_ARE:
                watch = {"enable": True, "json": False, "raw": 2, "device": path}
                self.request = f"?WATCH={json.dumps(watch)}\n".encode()
                self._receiver = ReceiverDecoder(self._place)


def _gpsd_deviation(message: dict[str, Any]) -> float:
    """Standard deviation (m) of north and of east from gpsd's error, whose level is undefined: taken as 1σ."""
    if "eph" in message:
        return message["eph"] / math.sqrt(2.0)
    if "epx" in message and "epy" in message:
        return math.hypot(message["epx"], message["epy"]) / math.sqrt(2.0)
    return math.nan
