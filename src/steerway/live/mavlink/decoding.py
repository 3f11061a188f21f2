"""From a vehicle's messages to rows: her receiver's fixes, and her own estimate only where the receiver is not told.

Heading and yaw rate go with the next fix, whose time is older than theirs by what the receiver takes for it: told by
themselves they would make every fix a late one. While there are no fixes they are told by themselves.

Fields and their marks for "not known": MAVLink common message set. A fix's time is either Unix time or the time since
the vehicle's start, whose Unix time SYSTEM_TIME tells.
"""

import math
import time

from steerway.core.angles import wrap
from steerway.live.heard import Heard

_UNIX_USEC = 10**15  # times above are Unix time: it passed this in 2001, a vehicle never runs for so long
_PATIENCE = 3.0  # s to wait for SYSTEM_TIME, and without GPS_RAW_INT before her own estimate is heard
_PASSED_OVER = 5  # of her own positions at the least, as this computer may have been busy
_STEP = 0.5  # s by which the two clocks part at once when one was set
_SHARE = 1.0 / 16.0  # of a small difference that is taken over at each SYSTEM_TIME
_FRESH = 0.5  # s for which an aid may wait for its fix
_NO_FIX = 1.0  # s without a fix after which aids are told by themselves
_UNKNOWN_16 = 0xFFFF


class BootClock:
    """Unix time of a vehicle's start: by SYSTEM_TIME, else by this computer's clock when it stays away."""

    def __init__(self):
        self._offset = math.nan
        self._waits_since = math.nan
        self._is_told = False

    def tell(self, unix: float, boot: float) -> None:
        """A SYSTEM_TIME, s; `unix` 0 where she does not know it."""
        if unix <= 0.0:
            return
        ahead = unix - boot - self._offset
        if self._is_told and abs(ahead) < _STEP:
            self._offset += _SHARE * ahead
        else:
            self._offset = unix - boot
        self._is_told = True

    def unix(self, boot: float, arrival: float) -> float:
        """Unix time of a moment since her start (s) of which a message came in at `arrival`; NaN while unknown."""
        if self._is_told:
            return boot + self._offset
        if math.isnan(self._waits_since):
            self._waits_since = arrival
        if arrival - self._waits_since < _PATIENCE:
            return math.nan
        if not abs(time.time() - boot - self._offset) < _STEP:
            self._offset = time.time() - boot
        return boot + self._offset


class MavlinkDecoder:
    """Rows of one vehicle's messages. `place` is put behind the sources' names where several links are listened to."""

    def __init__(self, place: str = ""):
        self._place = f" in {place}" if place else ""
        self.clock = BootClock()
        self._fix_time = -1
        self._receiver_heard = -math.inf
        self._passed_over = 0  # of her own positions since the receiver was heard
        self._aids: dict[str, tuple[float, float]] = {}  # newest value and its arrival
        self._fixed = -math.inf  # arrival of the newest fix

    def message(self, message, arrival: float) -> list[Heard]:
        """The rows, none or one, of a message that came in at `arrival` (s, monotonic)."""
        if math.isinf(self._receiver_heard):
            self._receiver_heard = self._fixed = arrival  # as if: she may yet tell it
        made = _MAKERS.get(message.get_type())
        row = None if made is None else made(self, message, arrival)
        return [] if row is None or math.isnan(row.time) else [row]

    def _system_time(self, said, arrival):
        self.clock.tell(said.time_unix_usec * 1e-6, said.time_boot_ms * 1e-3)

    def _receiver(self, said, arrival):
        """The newest fix, once however often it is said."""
        self._receiver_heard, self._passed_over = arrival, 0
        if said.fix_type < 2 or said.time_usec == self._fix_time or (said.lat == 0 and said.lon == 0):
            return None
        self._fix_time = said.time_usec
        seconds = said.time_usec * 1e-6
        moment = seconds if said.time_usec > _UNIX_USEC else self.clock.unix(seconds, arrival)
        sog = math.nan if said.vel == _UNKNOWN_16 else said.vel * 1e-2
        cog = math.nan if said.cog == _UNKNOWN_16 else _angle(said.cog * 1e-2)
        std = said.h_acc * 1e-3 / math.sqrt(2.0) if said.h_acc else math.nan
        place = _angle(said.lat * 1e-7), _angle(said.lon * 1e-7)
        self._fixed = arrival
        return Heard(f"mavlink GPS_RAW_INT{self._place}", moment, *place, std, sog, cog, **self._beside(arrival))

    def _beside(self, arrival):
        """The aids that belong to a fix."""
        fresh = {name: value for name, (value, heard) in self._aids.items() if arrival - heard < _FRESH}
        self._aids = {}
        return fresh

    def _aid(self, row, name, arrival):
        """A row of one aid, kept for the next fix while fixes come."""
        self._aids[name] = getattr(row, name), arrival
        return row if arrival - self._fixed > _NO_FIX else None

    def _vehicle(self, said, arrival):
        """Heading by her own estimate, and her position where her receiver keeps silent."""
        heading = math.nan if said.hdg == _UNKNOWN_16 else _angle(said.hdg * 1e-2)
        row = Heard(f"mavlink GLOBAL_POSITION_INT{self._place}", self._since_start(said, arrival), heading=heading)
        is_told = arrival - self._receiver_heard < _PATIENCE or self._passed_over < _PASSED_OVER
        if is_told or (said.lat == 0 and said.lon == 0):
            self._passed_over += 1
            return self._aid(row, "heading", arrival)
        north, east = said.vx * 1e-2, said.vy * 1e-2
        place = {"latitude": _angle(said.lat * 1e-7), "longitude": _angle(said.lon * 1e-7)}
        return row._replace(**place, sog=math.hypot(north, east), cog=math.atan2(east, north))

    def _attitude(self, said, arrival):
        """Yaw rate by her gyro."""
        row = Heard(f"mavlink ATTITUDE{self._place}", self._since_start(said, arrival), yaw_rate=said.yawspeed)
        return self._aid(row, "yaw_rate", arrival)

    def _since_start(self, said, arrival):
        return self.clock.unix(said.time_boot_ms * 1e-3, arrival)


_MAKERS = {
    "SYSTEM_TIME": MavlinkDecoder._system_time,
    "GPS_RAW_INT": MavlinkDecoder._receiver,
    "GLOBAL_POSITION_INT": MavlinkDecoder._vehicle,
    "ATTITUDE": MavlinkDecoder._attitude,
}


def _angle(degrees):
    return wrap(math.radians(degrees))
