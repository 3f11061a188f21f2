"""A device on an NMEA 2000 bus: an input and an output on one link.

The link is SocketCAN by python-can, or the TCP port of a gateway with Yacht Devices' RAW format: received lines are
`hh:mm:ss.sss R 19F51323 01 2F …`, sent lines are `19F51323 01 2F …`. The fields of the sent messages 129026, 127251,
129283, 129284 and 127237 are from the canboat PGN database.
"""

import asyncio
import math
import struct
import time
import uuid
from collections.abc import Callable
from typing import Any

from steerway.core.leg import Leg
from steerway.formats.nmea2000.decoder import Decoder
from steerway.formats.nmea2000.fields import LARGEST, MESSAGES, TRUE
from steerway.formats.nmea2000.frames import BROADCAST, Frame, Joiner, Splitter, frame_of, identifier_of
from steerway.formats.nmea2000.text import frame_of_line
from steerway.live.links.link import Deliver, kept_open
from steerway.live.links.transport import Transport
from steerway.live.outputs.output import Output, Rhythm
from steerway.live.rows import UNDER_WAY, InputRow, Order, Row
from steerway.live.uri import Uri

_HEADING_CONTROL = 4  # steering mode of 127237


def write_course_and_speed(sid: int, cog: float, sog: float) -> bytes:
    """PGN 129026: SOG (m/s) and true COG (rad)."""
    return struct.pack("<BBHHH", sid, 0xFC | TRUE, _scaled("H", cog % math.tau, 1e-4), _scaled("H", sog, 0.01), 0xFFFF)


def write_rate_of_turn(sid: int, rate: float) -> bytes:
    """PGN 127251: rate of turn (rad/s, + to starboard)."""
    return struct.pack("<BiBH", sid, _scaled("i", rate, 3.125e-8), 0xFF, 0xFFFF)


def write_cross_track(sid: int, leg: Leg | None) -> bytes:
    """PGN 129283: cross-track error, + to starboard of the leg; "navigation terminated" without a leg."""
    ended = leg is None or math.isnan(leg.cross_track)
    error = math.nan if leg is None else leg.cross_track
    return struct.pack("<BBiH", sid, (1 if ended else 0) << 6 | 0x30, _scaled("i", error, 0.01), 0xFFFF)


def write_navigation(sid: int, leg: Leg, origin: int, destination: int) -> bytes:
    """PGN 129284: waypoint, distance, bearings (true, great circle). origin, destination: waypoint numbers."""
    flags = TRUE | int(leg.is_passed) << 2 | int(leg.is_arrived) << 4
    return struct.pack(
        "<BIBIHHHIIiih",
        sid,
        _scaled("I", leg.distance, 0.01),
        flags,
        0xFFFFFFFF,
        0xFFFF,
        _scaled("H", leg.direction % math.tau, 1e-4),
        _scaled("H", leg.bearing % math.tau, 1e-4),
        origin,
        destination,
        _scaled("i", math.degrees(leg.latitude), 1e-7),
        _scaled("i", math.degrees(leg.longitude), 1e-7),
        _scaled("h", leg.closing_speed, 0.01),
    )


def write_track_control(course: float, rate: float) -> bytes:
    """PGN 127237, in mode heading control: course to steer (rad) and ordered rate of turn (rad/s)."""
    mode = _HEADING_CONTROL | 7 << 3 | TRUE << 6
    steer = _scaled("H", course % math.tau, 1e-4)
    unknown = 0xFFFF
    turn = _scaled("h", rate, 3.125e-5)
    return struct.pack(
        "<BBBhHHHHhhhH", 0xFF, mode, 0xFF, 0x7FFF, steer, unknown, unknown, unknown, 0x7FFF, turn, 0x7FFF, unknown
    )


def _scaled(kind: str, value: float, unit: float) -> int:
    """A value in its unit as an integer of a `struct` format, within its valid range; the largest means unknown."""
    most = LARGEST[kind]
    least = 0 if kind.isupper() else -most - 1
    return max(min(round(value / unit), most - 3), least) if math.isfinite(value) else most


_PERIODS = {"motion": 0.1, "leg": 1.0, "orders": 0.25}
_CLOCK_ERROR = 2.0  # s; a smaller difference between this computer's clock and GNSS counts as delay of the message
_LONGEST = 256  # longest line of a gateway, characters


class N2kDecoder:
    """Decodes frames to rows. Their source is "src N" for sender N, and "src N GNSS" for messages with a time."""

    def __init__(self, place: str = ""):
        self._place = f" in {place}" if place else ""
        self._joiner, self._decoder = Joiner(), Decoder()
        self._clock_error = 0.0

    def frame(self, frame: Frame, arrived: float) -> list[InputRow]:
        """The rows, none or one, that a frame completes; `arrived` is its arrival (Unix, s)."""
        message = MESSAGES.get(frame.pgn)
        data = self._joiner.add(frame) if message else None
        if message is None or data is None or len(data) < message.length:
            return []
        decoded = self._decoder.values(frame.pgn, frame.source, message.raw(data), arrived)
        values: dict[str, Any] = {name: value for name, value in decoded.items() if not math.isnan(value)}
        if not values.keys() - {"time", "position_std"}:
            return []
        source = f"src {frame.source}"
        if "time" in values:
            error = values["time"] - arrived
            self._clock_error = error if abs(error) > _CLOCK_ERROR else 0.0
            source += " GNSS"
        moment = values.pop("time", arrived + self._clock_error)
        return [InputRow(f"{source}{self._place}", moment, **values)]


class N2kDevice(Output):
    """Output and link in one, and with `run(deliver)` an input; the link is opened once for both.

    Sends 129026 and 127251 ten times a second, 129283 and 129284 once a second on a route, and 127237 four times a
    second while the autopilot is engaged, never otherwise. It sends nothing before it has claimed an address.
    """

    def __init__(self, uri: Uri, place: str = "", name: int | None = None):
        self.uri = uri
        self.decoder = N2kDecoder(place)
        self.claim = AddressClaim(name_of(uuid.getnode()) if name is None else name)
        self.lost = 0
        self._splitter = Splitter()
        self._write: Callable[[int, bytes], None] | None = None
        self._deliver: Deliver | None = None
        self._runs = False
        self._rhythms = {what: Rhythm(period) for what, period in _PERIODS.items()}
        self._sid = 0

    async def run(self, deliver: Deliver | None = None) -> None:
        """Keep the link open until cancelled."""
        self._deliver = deliver or self._deliver
        if self._runs:
            await asyncio.Event().wait()
        self._runs = True
        await kept_open(self.uri.text, self._bus if self.uri.scheme == "n2k" else self._gateway)

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """See Output."""
        if not self.claim.holds(time.monotonic()):
            return
        if self._rhythms["motion"].is_due(row.time):
            self._sid = (self._sid + 1) % 253
            self._send(129026, write_course_and_speed(self._sid, row.cog, row.sog), priority=2)
            self._send(127251, write_rate_of_turn(self._sid, row.course_rate), priority=2)
        if leg is not None and self._rhythms["leg"].is_due(row.time):
            self._send(129283, write_cross_track(self._sid, leg))
            if math.isfinite(leg.distance):
                self._send(129284, write_navigation(self._sid, leg, _number(leg.origin), _number(leg.destination)))
        if order is None or not order.engaged or order.state not in UNDER_WAY:
            return
        if self._rhythms["orders"].is_due(row.time):
            self._send(127237, write_track_control(order.course, order.yaw_rate), priority=2)

    def unreachable(self) -> str:
        """The reason why no order reaches the bus; "" if orders reach it."""
        if self._write is None:
            return f"{self.uri.text} is not open"
        return "" if self.claim.holds(time.monotonic()) else "no address is claimed on the NMEA 2000 bus"

    def _frame(self, frame: Frame, arrived: float) -> None:
        for pgn, data in self.claim.receive(frame, time.monotonic()):
            self._send(pgn, data, priority=6)
        if self._deliver is not None and (rows := self.decoder.frame(frame, arrived)):
            self._deliver(rows)

    def _opened(self, write: Callable[[int, bytes], None]) -> None:
        self._write = write
        for pgn, data in self.claim.begin(time.monotonic()):
            self._send(pgn, data, priority=6)

    def _send(self, pgn: int, payload: bytes, priority: int = 3) -> None:
        identifier = identifier_of(pgn, self.claim.address, priority=priority)
        for data in self._splitter.parts(pgn, payload):
            try:
                if self._write is None:
                    raise OSError
                self._write(identifier, data)
            except OSError:
                self.lost += 1

    async def _bus(self) -> None:
        import can

        interface = self.uri.options.get("interface", "socketcan")
        try:
            bus = can.Bus(interface=interface, channel=self.uri.path, receive_own_messages=False)
        except (can.CanError, OSError, ValueError) as error:
            raise OSError(getattr(error, "strerror", None) or str(error)) from None

        def write(identifier: int, data: bytes) -> None:
            try:
                bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=True), timeout=0.0)
            except can.CanError as error:
                raise OSError(str(error)) from None

        received: asyncio.Queue[Any] = asyncio.Queue()
        loop = asyncio.get_running_loop()
        notifier = can.Notifier(bus, [received.put_nowait], loop=loop)
        try:
            self._opened(write)
            while True:
                message = await received.get()
                if message.is_error_frame or not message.is_extended_id:
                    continue
                self._frame(frame_of(message.arbitration_id, message.data), message.timestamp or time.time())
        finally:
            self._write = None
            notifier.stop()
            bus.shutdown()

    async def _gateway(self) -> None:
        self._begun = b""

        def write(identifier: int, data: bytes) -> None:
            if not gateway.write(f"{identifier:08X} {data.hex(' ').upper()}\r\n".encode()):
                raise OSError

        gateway = Transport(self.uri, "tcp", self._lines, lambda: self._opened(write))
        try:
            await gateway.open()
        finally:
            self._write = None

    def _lines(self, data: bytes, answer: object) -> None:
        *lines, self._begun = (self._begun + data).split(b"\n")
        for line in lines:
            frame = frame_of_line(line) if len(line) < _LONGEST else None
            if frame is not None:
                self._frame(frame, time.time())
        if max(map(len, (*lines, self._begun))) >= _LONGEST:
            raise OSError(f"a line of more than {_LONGEST} characters, expected the RAW format")


def _number(waypoint: str) -> int:
    digits = waypoint.removeprefix("WP")
    return int(digits) if digits.isascii() and digits.isdigit() else 0xFFFFFFFF


CLAIM, REQUEST = 60928, 59904
NO_ADDRESS = 254
_WAIT = 0.25  # time after a claim before anything else is sent, s
_HIGHEST = 251
_NAVIGATION, _OWN_POSITION, _MARINE, _UNKNOWN_MAKER = 60, 145, 4, 2047


def name_of(identity: int) -> int:
    """The NAME of a device: its identity number, class and function; arbitrary-address capable."""
    low = (identity & 0x1FFFFF) | _UNKNOWN_MAKER << 21
    high = _OWN_POSITION << 8 | _NAVIGATION << 17 | _MARINE << 28 | 1 << 31
    return high << 32 | low


class AddressClaim:
    """Claims an address, without clock and I/O: call `begin`, then `receive` for every frame. Both return the messages
    to send as (PGN, data)."""

    def __init__(self, name: int, address: int = 40):
        self.name, self.address = name, address
        self._first = address
        self._since = math.inf

    def holds(self, now: float) -> bool:
        """Whether the address may be used."""
        return self.address != NO_ADDRESS and now - self._since >= _WAIT

    def begin(self, now: float) -> list[tuple[int, bytes]]:
        """Claim the address."""
        self._since = now
        return [(CLAIM, struct.pack("<Q", self.name))]

    def receive(self, frame: Frame, now: float) -> list[tuple[int, bytes]]:
        """The answer to a frame of another device."""
        if frame.pgn == REQUEST and frame.destination in (BROADCAST, self.address) and len(frame.data) >= 3:
            asked = int.from_bytes(frame.data[:3], "little")
            return [(CLAIM, struct.pack("<Q", self.name))] if asked == CLAIM else []
        if frame.pgn != CLAIM or frame.source != self.address or len(frame.data) != 8:
            return []
        (other,) = struct.unpack("<Q", frame.data)
        if other == self.name:
            return []
        if self.name < other:
            return [(CLAIM, struct.pack("<Q", self.name))]
        self.address = 0 if self.address >= _HIGHEST else self.address + 1
        if self.address == self._first:
            self.address = NO_ADDRESS
        return self.begin(now)
