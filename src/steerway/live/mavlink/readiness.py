"""Whether a vehicle can be steered, from its reports: EKF, receiver, battery, fail-safes and arming.

A missing report prevents steering for `_WAIT` s, then it counts as good: not every firmware sends every report.
Messages and flags: MAVLink ardupilotmega message set. ArduPilot's Rover accepts GUIDED only when it has a position.
"""

import math
from typing import Any

_WAIT = 5.0  # longest wait for a missing report, from the first message, s
_STALE = 5.0  # age above which a report counts as missing, s
_REFUSED = 5.0  # time between a refused take-over and the next attempt, s
_WORDS = {
    "MAV_RESULT_TEMPORARILY_REJECTED": "rejected for now (TEMPORARILY_REJECTED)",
    "MAV_RESULT_DENIED": "not permitted (DENIED)",
    "MAV_RESULT_UNSUPPORTED": "not supported (UNSUPPORTED)",
    "MAV_RESULT_FAILED": "it failed (FAILED), as before the vehicle has a position",
    "MAV_RESULT_IN_PROGRESS": "still in progress (IN_PROGRESS)",
    "MAV_RESULT_CANCELLED": "cancelled (CANCELLED)",
    "MAV_RESULT_COMMAND_LONG_ONLY": "only as COMMAND_LONG",
    "MAV_RESULT_COMMAND_INT_ONLY": "only as COMMAND_INT",
    "MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME": "not in this frame",
}
_BATTERY = {
    "MAV_BATTERY_CHARGE_STATE_LOW": "low",
    "MAV_BATTERY_CHARGE_STATE_CRITICAL": "critically low",
    "MAV_BATTERY_CHARGE_STATE_EMERGENCY": "nearly empty",
    "MAV_BATTERY_CHARGE_STATE_FAILED": "damaged",
    "MAV_BATTERY_CHARGE_STATE_UNHEALTHY": "faulty",
}


def result_words(messages: Any, result: int) -> str:
    """The meaning of the result in a COMMAND_ACK."""
    return next((words for name, words in _WORDS.items() if getattr(messages, name, -1) == result), f"result {result}")


class Readiness:
    """The newest reports of one vehicle; `messages` is the dialect's module, times are s of a monotonic clock."""

    def __init__(self, messages: Any) -> None:
        self._messages = messages
        self._first = math.nan
        self._reports: dict[str, tuple[object, float]] = {}
        self._batteries: dict[int, tuple[int, float]] = {}
        self._prearm = ""
        self._refused, self._refused_at = "", -math.inf

    def receive(self, message: Any, now: float) -> None:
        """Take a message of the vehicle."""
        kind = message.get_type()
        self._first = now if math.isnan(self._first) else self._first
        if kind in ("HEARTBEAT", "EKF_STATUS_REPORT", "SYS_STATUS", "GPS_RAW_INT"):
            self._reports[kind] = message, now
        elif kind == "BATTERY_STATUS":
            self._batteries[message.id] = message.charge_state, now
        elif kind == "STATUSTEXT" and message.text.startswith("PreArm:"):
            self._prearm = message.text.partition(":")[2].strip()

    def refused(self, why: str, now: float) -> None:
        """Note that a take-over was refused: the vehicle counts as not ready for `_REFUSED` s."""
        self._refused, self._refused_at = why, now

    def obstacle(self, now: float) -> str:
        """Why the vehicle cannot be steered yet; "" if it can."""
        checks = (self._ekf, self._receiver, self._battery, self._failsafe, self._arming)
        found = next((why for why in (check(now) for check in checks) if why), "")
        if not found and now - self._refused_at < _REFUSED:
            return f"{self._refused}; tried again in {_REFUSED - (now - self._refused_at):.0f} s"
        return found

    def _report(self, kind: str, now: float) -> Any:
        """The newest report of a kind; "" while the first one may still arrive, None if it is missing after that."""
        message, came = self._reports.get(kind, (None, -math.inf))
        if now - came <= _STALE:
            return message
        return "" if now - self._first < _WAIT else None

    def _ekf(self, now: float) -> str:
        report, m = self._report("EKF_STATUS_REPORT", now), self._messages
        if report == "":
            return "the vehicle's EKF has not reported"
        if report is None:
            return ""
        lacking = {
            "it is not initialised": report.flags & m.EKF_UNINITIALIZED,
            "no attitude": not report.flags & m.EKF_ATTITUDE,
            "no velocity": not report.flags & m.EKF_VELOCITY_HORIZ,
            "no position": not report.flags & m.EKF_POS_HORIZ_ABS or report.flags & m.EKF_CONST_POS_MODE,
            "its receiver's positions jump": report.flags & m.EKF_GPS_GLITCHING,
        }
        why = next((why for why, lacks in lacking.items() if lacks), "")
        return f"the vehicle's EKF is not ready: {why}" if why else ""

    def _receiver(self, now: float) -> str:
        report = self._report("GPS_RAW_INT", now)
        if report == "":
            return "the vehicle's receiver has not reported"
        if report is not None and report.fix_type < self._messages.GPS_FIX_TYPE_3D_FIX:
            return "the vehicle's receiver has no 3D fix"
        return ""

    def _battery(self, now: float) -> str:
        for number, (state, came) in self._batteries.items():
            words = next((w for name, w in _BATTERY.items() if getattr(self._messages, name, -1) == state), "")
            if words and now - came <= 2.0 * _STALE:
                return f"the vehicle's battery {number + 1} is {words}"
        report, bit = self._report("SYS_STATUS", now), self._messages.MAV_SYS_STATUS_SENSOR_BATTERY
        if report and report.onboard_control_sensors_enabled & bit and not report.onboard_control_sensors_health & bit:
            return "the vehicle reports a fault of its battery"
        return ""

    def _failsafe(self, now: float) -> str:
        report, m = self._report("HEARTBEAT", now), self._messages
        failing = {m.MAV_STATE_CRITICAL, m.MAV_STATE_EMERGENCY, m.MAV_STATE_FLIGHT_TERMINATION}
        if report and report.system_status in failing:
            return "the vehicle is in a fail-safe"
        return "the vehicle is starting" if report and report.system_status == m.MAV_STATE_BOOT else ""

    def _arming(self, now: float) -> str:
        report, m = self._report("HEARTBEAT", now), self._messages
        if not report or report.base_mode & m.MAV_MODE_FLAG_SAFETY_ARMED:
            return ""
        status, bit = self._report("SYS_STATUS", now), m.MAV_SYS_STATUS_PREARM_CHECK
        fails = status and status.onboard_control_sensors_enabled & bit
        if fails and not status.onboard_control_sensors_health & bit:
            return f"the vehicle is not armed, its pre-arm checks fail{f': {self._prearm}' if self._prearm else ''}"
        return "the vehicle is not armed"
