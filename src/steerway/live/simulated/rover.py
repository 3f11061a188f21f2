"""A MAVLink vehicle like ArduPilot's Rover, as seen by a companion computer: modes, GUIDED targets and their timeout.

No clock and no I/O: messages have the boat's time. Like ArduPilot's Rover, it takes thrust in GUIDED as a fraction of
CRUISE_SPEED; it drops a target after 3 s; its messages contain the time since its start; and it accepts GUIDED only
once its own estimate (EKF) has a position.
"""

import math
from typing import Any, NamedTuple

from steerway.core.angles import wrap
from steerway.core.checks import not_negative, positive
from steerway.core.kinematics import GroundMotion
from steerway.live.mavlink.link import RoverMode
from steerway.live.simulated.boat import ReceiverFix

TIMEOUT = 3.0
"""Time without a target after which a vehicle in GUIDED stops, s."""
TURN_LIMIT = math.radians(120.0)
"""Limit of the yaw rate, rad/s: the default of the parameter ATC_STR_RAT_MAX of ArduPilot's Rover."""
_TURN_PARAMETER = "ATC_STR_RAT_MAX"
_MODES = (RoverMode.MANUAL, RoverMode.HOLD, RoverMode.GUIDED)
_FIX_LOST = 1.5  # time after the last fix at which the receiver reports no fix, s
_UNKNOWN_16 = 0xFFFF
_EKF_ATTITUDE, _EKF_ALL = 0b0010000001, 0b1100111111
"""Flags of EKF_STATUS_REPORT. _EKF_ATTITUDE: attitude and constant position. _EKF_ALL: attitude, velocity and position,
measured and predicted."""


class Target(NamedTuple):
    """The last target in GUIDED: yaw rate (rad/s), speed (m/s) and the time of the target (s)."""

    yaw_rate: float
    speed: float
    time: float


class Rover:
    """Modes, targets and messages of one vehicle.

    messages: the dialect's module.
    cruise:   speed over ground at thrust 1, m/s.
    unix:     Unix time of the boat's time 0.
    armed:    whether it is armed from the start.
    ekf_time: s from the start until its EKF has a position.
    compass:  whether it has a compass; without one it reports no heading.
    turn_limit: limit of its yaw rate, rad/s.
    """

    def __init__(
        self,
        messages: Any,
        cruise: float,
        unix: float,
        timeout: float = TIMEOUT,
        armed: bool = True,
        ekf_time: float = 0.0,
        compass: bool = True,
        turn_limit: float = TURN_LIMIT,
    ):
        self._messages = messages
        self.cruise, self.timeout = positive("cruise", cruise), positive("timeout", timeout)
        self.unix, self.armed = unix, armed
        self.ekf_time, self.compass = not_negative("ekf", ekf_time), compass
        self.turn_limit = positive("turn", turn_limit)
        self.system, self.component = 1, 1
        self.mode = RoverMode.MANUAL
        self.heading = math.nan  # from the compass; NaN: the true heading is used
        self.throttle = 0.0  # fraction of full
        self._target: Target | None = None
        self._seen: ReceiverFix | None = None
        self._intervals = {
            "HEARTBEAT": 1.0,
            "SYSTEM_TIME": 1.0,
            "ATTITUDE": 0.1,
            "GLOBAL_POSITION_INT": 0.2,
            "GPS_RAW_INT": 0.2,
            "EKF_STATUS_REPORT": 0.5,
            "VFR_HUD": 0.25,
        }
        self._sent = dict.fromkeys(self._intervals, -math.inf)

    def target(self, now: float) -> Target | None:
        """The target in force; None means engines off."""
        if self._target is not None and now - self._target.time > self.timeout:
            self._target = None
        return self._target if self.armed and self.mode is RoverMode.GUIDED else None

    def see(self, seen: ReceiverFix) -> None:
        """Take a fix that the receiver delivers."""
        self._seen = seen

    def receive(self, message: Any, now: float) -> list[Any]:
        """The answers to a message."""
        handler = _HANDLERS.get(message.get_type())
        mine = getattr(message, "target_system", 0) in (0, self.system)
        return [] if handler is None or not mine else handler(self, message, now)

    def due(self, now: float, motion: GroundMotion, place: tuple[float, float]) -> list[Any]:
        """The messages to send now; `place` is the true latitude and longitude, rad."""
        due = []
        for name, interval in self._intervals.items():
            if interval > 0.0 and now - self._sent[name] >= interval - 1e-6:
                self._sent[name] = now
                due.append(_MAKERS[name](self, now, motion, place))
        return due

    def _set_mode(self, number: int, now: float) -> int:
        """Carry out a request of a mode; return its MAV_RESULT."""
        if number not in _MODES or (number == RoverMode.GUIDED and now < self.ekf_time):
            return self._messages.MAV_RESULT_FAILED
        if RoverMode(number) is not self.mode:
            self.mode, self._target = RoverMode(number), None
        return self._messages.MAV_RESULT_ACCEPTED

    def _on_set_mode(self, message: Any, now: float) -> list[Any]:
        return [self._answer(self._messages.MAVLINK_MSG_ID_SET_MODE, self._set_mode(message.custom_mode, now))]

    def _on_command(self, message: Any, now: float) -> list[Any]:
        m = self._messages
        result = m.MAV_RESULT_UNSUPPORTED
        if message.command == m.MAV_CMD_DO_SET_MODE:
            custom = int(message.param1) & m.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
            result = self._set_mode(int(message.param2), now) if custom else m.MAV_RESULT_FAILED
        elif message.command == m.MAV_CMD_COMPONENT_ARM_DISARM:
            self.armed = message.param1 == 1.0
            result = m.MAV_RESULT_ACCEPTED
        elif message.command == m.MAV_CMD_SET_MESSAGE_INTERVAL:
            result = self._set_interval(int(message.param1), message.param2)
        return [self._answer(message.command, result)]

    def _set_interval(self, number: float, microseconds: float) -> int:
        for name in self._intervals:
            if getattr(self._messages, f"MAVLINK_MSG_ID_{name}") == number and math.isfinite(microseconds):
                self._intervals[name] = microseconds * 1e-6  # below 0: never; 0 would be the default
                return self._messages.MAV_RESULT_ACCEPTED
        return self._messages.MAV_RESULT_FAILED

    def _answer(self, command: int, result: int) -> Any:
        return self._messages.MAVLink_command_ack_message(command, result)

    def _on_target(self, message: Any, now: float) -> list[Any]:
        """Take a target of yaw rate and thrust; a target of attitude is ignored."""
        m = self._messages
        ignored = m.ATTITUDE_TARGET_TYPEMASK_THROTTLE_IGNORE | m.ATTITUDE_TARGET_TYPEMASK_BODY_YAW_RATE_IGNORE
        if not message.type_mask & ignored:
            thrust = max(-1.0, min(1.0, message.thrust))
            if math.isfinite(message.body_yaw_rate + thrust):
                most = self.turn_limit
                self._target = Target(max(-most, min(most, message.body_yaw_rate)), thrust * self.cruise, now)
        return []

    def _on_parameter(self, message: Any, now: float) -> list[Any]:
        """Answer the request of ATC_STR_RAT_MAX; as in ArduPilot, an unknown parameter gets no answer."""
        if message.param_id != _TURN_PARAMETER:
            return []
        m = self._messages
        value = math.degrees(self.turn_limit)
        return [m.MAVLink_param_value_message(_TURN_PARAMETER.encode(), value, m.MAV_PARAM_TYPE_REAL32, 1, 0)]

    def _heartbeat(self, now: float, motion: GroundMotion, place: tuple[float, float]) -> Any:
        m = self._messages
        flags = m.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        flags |= m.MAV_MODE_FLAG_SAFETY_ARMED if self.armed else 0
        flags |= m.MAV_MODE_FLAG_GUIDED_ENABLED if self.mode is RoverMode.GUIDED else 0
        state = m.MAV_STATE_ACTIVE if self.armed else m.MAV_STATE_STANDBY
        return m.MAVLink_heartbeat_message(
            m.MAV_TYPE_SURFACE_BOAT, m.MAV_AUTOPILOT_ARDUPILOTMEGA, flags, int(self.mode), state, 3
        )

    def _ekf(self, now: float, motion: GroundMotion, place: tuple[float, float]) -> Any:
        """EKF_STATUS_REPORT: until `ekf_time` attitude and a constant position only, then everything."""
        flags = _EKF_ALL if now >= self.ekf_time else _EKF_ATTITUDE
        return self._messages.MAVLink_ekf_status_report_message(flags, 0.1, 0.1, 0.1, 0.1, 0.0)

    def _hud(self, now: float, motion: GroundMotion, place: tuple[float, float]) -> Any:
        """VFR_HUD, with heading 0 if the heading is unknown."""
        heading = self._heading_of(motion)
        degrees = 0 if math.isnan(heading) else round(math.degrees(heading)) % 360
        sog = math.hypot(motion.north_velocity, motion.east_velocity)
        return self._messages.MAVLink_vfr_hud_message(0.0, sog, degrees, round(100.0 * abs(self.throttle)), 0.0, 0.0)

    def _heading_of(self, motion: GroundMotion) -> float:
        if not self.compass:
            return math.nan
        return motion.heading if math.isnan(self.heading) else self.heading

    def _system_time(self, now: float, motion: GroundMotion, place: tuple[float, float]) -> Any:
        return self._messages.MAVLink_system_time_message(round((self.unix + now) * 1e6), round(now * 1e3))

    def _attitude(self, now: float, motion: GroundMotion, place: tuple[float, float]) -> Any:
        heading = self._heading_of(motion)
        yaw = 0.0 if math.isnan(heading) else math.remainder(heading, math.tau)
        return self._messages.MAVLink_attitude_message(
            round(now * 1e3), motion.roll, motion.pitch, yaw, 0.0, 0.0, motion.yaw_rate
        )

    def _global_position(self, now: float, motion: GroundMotion, place: tuple[float, float]) -> Any:
        heading = self._heading_of(motion)
        yaw = _UNKNOWN_16 if math.isnan(heading) else _hundredths(heading)
        velocity = round(motion.north_velocity * 100.0), round(motion.east_velocity * 100.0), 0
        return self._messages.MAVLink_global_position_int_message(
            round(now * 1e3), *_ten_millionths(*place), 0, 0, *velocity, yaw
        )

    def _gps_raw(self, now: float, motion: GroundMotion, place: tuple[float, float]) -> Any:
        """GPS_RAW_INT: the newest fix, with the time of its delivery since the start."""
        m, seen = self._messages, self._seen
        if seen is None or now - seen.delivered > _FIX_LOST:
            unknown = [0, 0, 0, _UNKNOWN_16, _UNKNOWN_16, _UNKNOWN_16, _UNKNOWN_16]
            return m.MAVLink_gps_raw_int_message(0, m.GPS_FIX_TYPE_NO_FIX, *unknown, 0)
        sog = _UNKNOWN_16 if math.isnan(seen.sog) else min(round(seen.sog * 100.0), _UNKNOWN_16 - 1)
        cog = _UNKNOWN_16 if math.isnan(seen.cog) else _hundredths(seen.cog)
        return m.MAVLink_gps_raw_int_message(
            round(seen.delivered * 1e6),
            m.GPS_FIX_TYPE_3D_FIX,
            *_ten_millionths(seen.latitude, seen.longitude),
            0,
            _UNKNOWN_16,
            _UNKNOWN_16,
            sog,
            cog,
            12,
        )


_HANDLERS = {
    "SET_MODE": Rover._on_set_mode,
    "COMMAND_LONG": Rover._on_command,
    "SET_ATTITUDE_TARGET": Rover._on_target,
    "PARAM_REQUEST_READ": Rover._on_parameter,
}
_MAKERS = {
    "HEARTBEAT": Rover._heartbeat,
    "SYSTEM_TIME": Rover._system_time,
    "ATTITUDE": Rover._attitude,
    "GLOBAL_POSITION_INT": Rover._global_position,
    "GPS_RAW_INT": Rover._gps_raw,
    "EKF_STATUS_REPORT": Rover._ekf,
    "VFR_HUD": Rover._hud,
}


def _ten_millionths(latitude: float, longitude: float) -> tuple[int, int]:
    return round(math.degrees(latitude) * 1e7), round(math.degrees(longitude) * 1e7)


def _hundredths(angle: float) -> int:
    return round(math.degrees(angle % math.tau) * 100.0) % 36000


SPEED = 1.0
"""Speed over ground on the circle, m/s."""
RADIUS = 15.0
"""Radius of the circle around the position at the start, m."""
_GAIN, _MOST = 0.3, 0.3  # gain from course error to yaw rate (1/s), and largest yaw rate (rad/s)


class Skipper:
    """Keeps the boat near its start, whatever the current."""

    def __init__(self, motion: GroundMotion):
        self._north, self._east = motion.north, motion.east

    def step(self, motion: GroundMotion) -> Target:
        """Target yaw rate and speed: clockwise along the circle, and back to the circle from inside or outside."""
        north, east = motion.north - self._north, motion.east - self._east
        outside = math.hypot(north, east) / RADIUS - 1.0
        course = math.atan2(east, north) + 0.5 * math.pi + math.atan(outside)
        yaw_rate = SPEED / RADIUS + _GAIN * wrap(course - motion.cog)
        return Target(max(-_MOST, min(_MOST, yaw_rate)), SPEED, math.nan)
