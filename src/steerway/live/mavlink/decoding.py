"""Decodes a vehicle's messages to rows: the fixes of its receiver, or the vehicle's own estimate if no fixes are sent.

The heading and yaw rate measured nearest to the time of a fix become part of the row of the fix. In rows of their own
they would be newer than the next fix, because a receiver has latency, and every fix would count as late. Without fixes
heading and yaw rate are rows of their own.

Fields and their values for "unknown": MAVLink common message set. The time of a fix is Unix time, or time since the
vehicle's start; SYSTEM_TIME relates the two. It is the time at which the receiver delivered the fix. `ReceiverLag`
estimates how old the fix was then.
"""

import math
import time
from collections import deque
from typing import Any

from steerway.core.angles import wrap
from steerway.core.earth import STANDARD_GRAVITY, displacement
from steerway.live.rows import InputRow
from steerway.live.tick_timing import FixClock

_UNIX_USEC = 10**15  # larger times (µs) are Unix time, which passed this in 2001; smaller ones count from the start
_WAIT = 3.0  # longest wait for SYSTEM_TIME, and for GPS_RAW_INT before the vehicle's estimate is used, s
_PASSED_OVER = 5  # least number of the vehicle's own positions to skip: this computer may have been busy
_STEP = 0.5  # difference (s) above which the clock offset is replaced
_SHARE = 1.0 / 16.0  # fraction of a smaller difference that each SYSTEM_TIME corrects
_FRESH = 0.5  # largest difference in time between an aid and its fix, s
_KEPT = 20  # number of the newest values of each aid that are kept
_OLDEST = 2.0  # largest age of a row at its arrival, s; a larger one means that the time is from another clock
_NO_FIX = 1.0  # time without a fix after which aids are rows of their own, s
_UNKNOWN_16 = 0xFFFF
_ARMED = 0b1000_0000  # MAV_MODE_FLAG_SAFETY_ARMED
_ARDUPILOT, _ROVERS = 3, (10, 11)  # MAV_AUTOPILOT_ARDUPILOTMEGA; MAV_TYPE_GROUND_ROVER and _SURFACE_BOAT


class BootClock:
    """Unix time of a vehicle's start: from SYSTEM_TIME, or from this computer's clock if SYSTEM_TIME is not sent.

    The least delayed message gives the vehicle's present time.
    """

    def __init__(self) -> None:
        self._least_delayed = FixClock()
        self._newest = -math.inf
        self._offset = math.nan
        self._waits_since = math.nan
        self._is_known = False

    def set(self, unix: float, boot: float) -> None:
        """Take a SYSTEM_TIME: Unix time (0 for unknown) and time since the start, s."""
        if unix <= 0.0:
            return
        ahead = unix - boot - self._offset
        if self._is_known and abs(ahead) < _STEP:
            self._offset += _SHARE * ahead
        else:
            self._offset = unix - boot
        self._is_known = True

    def sent(self, boot: float, arrival: float) -> None:
        """Note that a message sent at `boot` (since the start) arrived at `arrival` (this computer's clock), s."""
        if boot < self._newest - _STEP:
            self._least_delayed.forget()
        self._newest = boot
        self._least_delayed.add(boot, arrival)

    def now(self, arrival: float) -> float:
        """The vehicle's Unix time (s) at a time of this computer's clock; NaN while unknown."""
        return self._least_delayed.now(arrival) + self._offset

    def unix(self, boot: float, arrival: float) -> float:
        """Convert `boot` (s since the start), of a message that arrived at `arrival`, to Unix time; NaN: unknown."""
        if self._is_known:
            return boot + self._offset
        if math.isnan(self._waits_since):
            self._waits_since = arrival
        if arrival - self._waits_since < _WAIT:
            return math.nan
        if not abs(time.time() - boot - self._offset) < _STEP:
            self._offset = time.time() - boot
        return boot + self._offset


class MavlinkDecoder:
    """Rows of one vehicle's messages. `place`, unless "", is appended to the names of sources."""

    def __init__(self, place: str = ""):
        self._place = f" in {place}" if place else ""
        self.clock = BootClock()
        self._fix_time = -1
        self._receiver_sent = -math.inf
        self._passed_over = 0  # number of the vehicle's own positions since the last one of the receiver
        self._lag = ReceiverLag()
        self._aids: dict[str, deque[tuple[float, float]]] = {}  # newest (time, value) of each aid
        self._used: dict[str, float] = {}  # time of the last used value of each aid
        self._fixed = -math.inf  # arrival of the newest fix
        self._moment = self._moment_came = math.nan  # time of the newest row, and its arrival
        self._says_throttle = False  # whether the vehicle is armed, and reports the throttle of its motors

    def message(self, message: Any, arrival: float) -> list[InputRow]:
        """The rows, none or one, of a message that arrived at `arrival` (s, monotonic)."""
        if math.isinf(self._receiver_sent):
            self._receiver_sent = self._fixed = arrival  # the receiver's fixes may still follow
        if hasattr(message, "time_boot_ms"):
            self.clock.sent(message.time_boot_ms * 1e-3, arrival)
        made = _MAKERS.get(message.get_type())
        row = None if made is None else made(self, message, arrival)
        if row is not None and math.isfinite(row.time):
            self._moment, self._moment_came = row.time, arrival
        return [] if row is None or math.isnan(row.time) else [row]

    def age(self, row: InputRow, arrival: float) -> float:
        """Age of a row at its arrival `arrival`, s; 0 if the vehicle's clock does not show it."""
        age = self.clock.now(arrival) - row.time
        return age if 0.0 < age < _OLDEST else 0.0

    def _system_time(self, message: Any, arrival: float) -> None:
        self.clock.set(message.time_unix_usec * 1e-6, message.time_boot_ms * 1e-3)

    def _receiver(self, message: Any, arrival: float) -> InputRow | None:
        """The newest fix; a repeated message gives no row."""
        self._receiver_sent, self._passed_over = arrival, 0
        if message.fix_type < 2 or message.time_usec == self._fix_time or (message.lat == 0 and message.lon == 0):
            return None
        self._fix_time = message.time_usec
        moment = self._stamped(message.time_usec, arrival)
        sog = math.nan if message.vel == _UNKNOWN_16 else message.vel * 1e-2
        cog = math.nan if message.cog == _UNKNOWN_16 else _angle(message.cog * 1e-2)
        std = message.h_acc * 1e-3 / math.sqrt(2.0) if message.h_acc else math.nan
        place = _angle(message.lat * 1e-7), _angle(message.lon * 1e-7)
        moment -= self._lag.at(moment, *place)
        self._fixed = arrival
        return InputRow(f"mavlink GPS_RAW_INT{self._place}", moment, *place, std, sog, cog, **self._beside(moment))

    def _beside(self, moment: float) -> dict[str, Any]:
        """The aids of a fix at a time: the nearest value of each, unless an earlier fix has used it."""
        found = {}
        for name, values in self._aids.items():
            time, value = min(values, key=lambda each: abs(each[0] - moment))
            if time != self._used.get(name) and abs(time - moment) < _FRESH:
                found[name], self._used[name] = value, time
        return found

    def _aid(self, row: InputRow, name: str, arrival: float) -> InputRow | None:
        """Keep an aid for the next fix; return its row only while fixes are missing."""
        self._aids.setdefault(name, deque(maxlen=_KEPT)).append((row.time, getattr(row, name)))
        return row if arrival - self._fixed > _NO_FIX else None

    def _vehicle(self, message: Any, arrival: float) -> InputRow | None:
        """Heading from the vehicle's estimate, and its position if the receiver's position is not sent."""
        heading = math.nan if message.hdg == _UNKNOWN_16 else _angle(message.hdg * 1e-2)
        row = InputRow(
            f"mavlink GLOBAL_POSITION_INT{self._place}", self._since_start(message, arrival), heading=heading
        )
        latitude, longitude, north, east = (
            _angle(message.lat * 1e-7),
            _angle(message.lon * 1e-7),
            message.vx * 1e-2,
            message.vy * 1e-2,
        )
        is_known = message.lat != 0 or message.lon != 0
        if is_known:
            self._lag.own(row.time, latitude, longitude, north, east)
        is_passed_over = arrival - self._receiver_sent < _WAIT or self._passed_over < _PASSED_OVER
        if is_passed_over or not is_known:
            self._passed_over += 1
            return self._aid(row, "heading", arrival)
        sog, cog = math.hypot(north, east), math.atan2(east, north)
        return row._replace(latitude=latitude, longitude=longitude, sog=sog, cog=cog)

    def _attitude(self, message: Any, arrival: float) -> InputRow | None:
        """Yaw rate by the vehicle's gyro."""
        row = InputRow(f"mavlink ATTITUDE{self._place}", self._since_start(message, arrival), yaw_rate=message.yawspeed)
        return self._aid(row, "yaw_rate", arrival)

    def _scaled_inertial(self, message: Any, arrival: float) -> InputRow:
        """SCALED_IMU and RAW_IMU: mg and mrad/s, x ahead and z down. ArduPilot uses these units in both."""
        is_scaled = message.get_type() == "SCALED_IMU"
        time = self._since_start(message, arrival) if is_scaled else self._stamped(message.time_usec, arrival)
        return self._inertial(time, message.xacc * 1e-3 * STANDARD_GRAVITY, message.zgyro * 1e-3, arrival)

    def _fine_inertial(self, message: Any, arrival: float) -> InputRow:
        """HIGHRES_IMU: m/s² and rad/s."""
        return self._inertial(self._stamped(message.time_usec, arrival), message.xacc, message.zgyro, arrival)

    def _inertial(self, time: float, acceleration: float, yaw_rate: float, arrival: float) -> InputRow:
        """A row with the acceleration. The yaw rate is kept for the next fix, as in ATTITUDE."""
        row = InputRow(f"mavlink IMU{self._place}", time, yaw_rate=yaw_rate)
        alone = self._aid(row, "yaw_rate", arrival) is not None
        return row._replace(yaw_rate=yaw_rate if alone else math.nan, acceleration=acceleration)

    def _turns(self, message: Any, arrival: float) -> InputRow:
        """ESC_TELEMETRY_1_TO_4: mean shaft speed of the motors that turn, rev/s."""
        turns = [each for each in message.rpm[:4] if each]
        mean = sum(turns) / len(turns) / 60.0 if turns else 0.0
        return InputRow(f"mavlink ESC_TELEMETRY{self._place}", self._untimed(arrival), shaft=mean)

    def _heartbeat(self, message: Any, arrival: float) -> InputRow | None:
        """HEARTBEAT: throttle 0 if the vehicle is not armed."""
        is_armed = bool(message.base_mode & _ARMED)
        self._says_throttle = is_armed and message.autopilot == _ARDUPILOT and message.type in _ROVERS
        return None if is_armed else self._throttle(0.0, arrival)

    def _hud(self, message: Any, arrival: float) -> InputRow | None:
        """VFR_HUD: the throttle, which the message gives in per cent."""
        return self._throttle(message.throttle * 1e-2, arrival) if self._says_throttle else None

    def _throttle(self, share: float, arrival: float) -> InputRow:
        return InputRow(f"mavlink throttle{self._place}", self._untimed(arrival), throttle=share)

    def _untimed(self, arrival: float) -> float:
        """Time for a message without one: the time of the newest row plus the time since its arrival."""
        return self._moment + arrival - self._moment_came

    def _stamped(self, microseconds: float, arrival: float) -> float:
        """Unix time (s) of a time stamp (µs) that is either Unix time or time since the start."""
        seconds = microseconds * 1e-6
        return seconds if microseconds > _UNIX_USEC else self.clock.unix(seconds, arrival)

    def _since_start(self, message: Any, arrival: float) -> float:
        return self.clock.unix(message.time_boot_ms * 1e-3, arrival)


_MAKERS = {
    "SYSTEM_TIME": MavlinkDecoder._system_time,
    "GPS_RAW_INT": MavlinkDecoder._receiver,
    "GLOBAL_POSITION_INT": MavlinkDecoder._vehicle,
    "ATTITUDE": MavlinkDecoder._attitude,
    "SCALED_IMU": MavlinkDecoder._scaled_inertial,
    "RAW_IMU": MavlinkDecoder._scaled_inertial,
    "HIGHRES_IMU": MavlinkDecoder._fine_inertial,
    "ESC_TELEMETRY_1_TO_4": MavlinkDecoder._turns,
    "HEARTBEAT": MavlinkDecoder._heartbeat,
    "VFR_HUD": MavlinkDecoder._hud,
}


def _angle(degrees: float) -> float:
    return wrap(math.radians(degrees))


_LARGEST = 1.0
"""Largest delay that is used, s. Chosen: receivers take 0.1 to 0.4 s."""
_WINDOW = 30.0
"""Time in which the weight of an old difference falls by a factor of e, s."""
_SLOWEST, _TRAVELLED = 0.5, 3.0
"""Lowest speed at which a fix is used (m/s); distance to travel before the delay is used (m). Chosen: with fixes of 0.1
m the delay is then accurate to 0.03 s."""
_SLEW = 0.05
"""Largest change of the delay, s per second. It changes the intervals between fixes by at most this fraction."""
_FRESH_FIX = 0.5  # largest difference in time between the vehicle's estimate and a fix, s


class ReceiverLag:
    """Delay of a receiver's fixes, found by comparison with the vehicle's estimates; `lag` in s, 0 while unknown."""

    def __init__(self) -> None:
        self.lag = 0.0
        self._own = (-math.inf, 0.0, 0.0, 0.0, 0.0)
        self._along = self._squares = self._way = 0.0
        self._before = -math.inf

    def own(self, time: float, latitude: float, longitude: float, north: float, east: float) -> None:
        """Take the vehicle's estimate: time (s), position (rad) and velocity (m/s)."""
        self._own = (time, latitude, longitude, north, east)

    def at(self, time: float, latitude: float, longitude: float) -> float:
        """The delay (s) of the fix delivered at `time`; update the estimate of the delay with this fix."""
        since, known_latitude, known_longitude, north, east = self._own
        step, self._before = time - self._before, time
        squared = north * north + east * east
        if not (0.0 < step < _WINDOW and abs(time - since) < _FRESH_FIX and squared > _SLOWEST**2):
            return self.lag
        ahead = displacement(known_latitude, known_longitude, latitude, longitude)
        kept = math.exp(-step / _WINDOW)
        along = (ahead[0] * north + ahead[1] * east) + (time - since) * squared
        self._along = kept * self._along + step * along
        self._squares = kept * self._squares + step * squared
        self._way += step * math.sqrt(squared)
        if self._way > _TRAVELLED:
            found = min(_LARGEST, max(0.0, self._along / self._squares))
            self.lag += min(_SLEW * step, max(-_SLEW * step, found - self.lag))
        return self.lag
