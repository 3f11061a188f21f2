"""The protocol with a vehicle that is steered in its mode GUIDED: from its messages and the order to messages for it.

No clock and no I/O: times are arguments, messages are returned. The vehicle is taken over only while the autopilot
runs, and given back when the autopilot stops. A mode that is set from elsewhere is not overruled.
"""

import math
from enum import Enum
from typing import Any

from steerway.live.mavlink.link import RoverMode, mode_name
from steerway.live.mavlink.readiness import Readiness, result_words
from steerway.live.rows import UNDER_WAY, Order, State

SYSTEM = 1  # this computer's system id before the vehicle is known; then the vehicle's id, as is usual
SILENCE = 2.5
"""Time without any message after which the link counts as lost, s. Chosen: longer than two heartbeats (one a second),
because a radio loses some, and shorter than the 3 s after which ArduPilot drops an order. Until then the boat follows
the last order, and the estimate assumes this."""
HEARTBEAT_LOST = 5.0
"""Time without a heartbeat after which the link counts as lost although other messages arrive, s: five heartbeats, as
is usual (mavlink.io, heartbeat protocol)."""
_CONFIRMED = 2.5  # time within which a heartbeat shows a requested mode, s
_ASKED_AGAIN = 0.5  # time between two requests of a mode, s
_REFUSED = 3.0  # time after which a request counts as refused, s
_STOPPING = 2.0  # duration of zero thrust before HOLD is requested, s
_GIVEN_UP = 10.0  # time after which leaving GUIDED is no longer requested, s
_TARGET_PERIOD = 0.1
_WANTED = {
    "GPS_RAW_INT": 0.1,
    "GLOBAL_POSITION_INT": 0.2,
    "ATTITUDE": 0.1,
    "SYSTEM_TIME": 1.0,
    "EKF_STATUS_REPORT": 1.0,
    "SYS_STATUS": 1.0,
    "BATTERY_STATUS": 2.0,
    "VFR_HUD": 0.5,
}  # messages and their intervals, s
_NO_ROVER = "the vehicle is not a boat of ArduPilot's Rover"
_MISSED = 5.0  # time between two requests for these messages while they are missing, s
_TURN_LIMIT = "ATC_STR_RAT_MAX"
"""ArduPilot Rover's parameter with the limit of its yaw rate, degrees/s; 0 for none."""
_ASKED_PARAMETER = 6  # largest number of requests for this parameter


class Takeover(Enum):
    """The phase of the take-over."""

    FREE = "free"  # not under control
    TAKING = "taking"  # GUIDED is requested
    STEERING = "steering"
    STOPPING = "stopping"  # zero thrust, then HOLD
    RETURNING = "returning"  # MANUAL is requested


class Guided:
    """One vehicle and the messages sent to it.

    ArduPilot's Rover in GUIDED takes the thrust of an order as a fraction of CRUISE_SPEED, or of WP_SPEED if that is
    set. This parameter is then the boat's speed at full thrust.

    messages: the dialect's module.
    silence:  time without any message after which the link counts as lost, s.
    system:   id of the vehicle; 0: the first one that sends, until a boat sends.

    `turn_limit`: limit of the vehicle's yaw rate, rad/s; NaN until the vehicle reports it.
    `refusal`: why the vehicle is not steered although it should be, else "". `obstacle`: why it could not be steered.
    """

    def __init__(self, messages: Any, silence: float = SILENCE, system: int = 0):
        self._messages, self._silence, self._only = messages, silence, system
        self.vehicle: tuple[int, int] | None = None
        self._other: tuple[int, int] | None = None  # sender of the last heartbeat of another vehicle
        self.mode: int | None = None
        self.is_armed = self.is_rover = False
        self.phase = Takeover.FREE
        self.refusal = ""
        self.readiness = Readiness(messages)
        self.turn_limit = math.nan
        self._asks_left = _ASKED_PARAMETER
        self._answer = ""  # reason of the last refusal of GUIDED
        self._since = -math.inf  # when the phase began
        self._received = self._heartbeat = self._fix_received = -math.inf
        self._own_heartbeat = self._target = self._asked_messages = self._asked_parameter = -math.inf
        self._asked: RoverMode | None = None
        self._asked_at = self._asked_guided = -math.inf

    def receive(self, message: Any, now: float) -> bool:
        """Take a message; return whether it is from the vehicle."""
        sender = (message.get_srcSystem(), message.get_srcComponent())
        kind = message.get_type()
        if sender != self.vehicle and kind == "HEARTBEAT" and self._is_vehicle(message):
            self._choose(sender, self._is_rover(message), now)
        if sender != self.vehicle:
            return False
        if now - self._received > self._silence:
            self._asked_messages = -math.inf
        self._received = now
        self.readiness.receive(message, now)
        if kind == "HEARTBEAT":
            self._heartbeat = now
            self.mode = message.custom_mode
            self.is_armed = bool(message.base_mode & self._messages.MAV_MODE_FLAG_SAFETY_ARMED)
            self.is_rover = self._is_rover(message)
        elif kind == "GPS_RAW_INT":
            self._fix_received = now
        elif kind == "COMMAND_ACK":
            self._answered(message)
        elif kind == "PARAM_VALUE" and message.param_id == _TURN_LIMIT and math.isfinite(message.param_value):
            self.turn_limit = math.radians(message.param_value)
        return True

    def _answered(self, answer: Any) -> None:
        """Take the answer to a mode request. Another mode in a later HEARTBEAT was set from elsewhere."""
        if answer.command == self._messages.MAV_CMD_DO_SET_MODE and self._asked is not None:
            if answer.result == self._messages.MAV_RESULT_ACCEPTED:
                self.mode = int(self._asked)
            elif self._asked is RoverMode.GUIDED:
                self._answer = result_words(self._messages, answer.result)
            self._asked = None

    def _choose(self, sender: tuple[int, int], is_rover: bool, now: float) -> None:
        """Choose the first vehicle that sends a heartbeat.

        Another vehicle replaces it after two heartbeats, if only the other one is a boat, or if the chosen one is
        silent. A vehicle under control is never replaced.
        """
        if self.vehicle is not None:
            heard, self._other = self._other, sender
            is_better = is_rover and not self.is_rover
            if heard != sender or self.phase is not Takeover.FREE or not (is_better or not self.alive(now)):
                return
            self.readiness = Readiness(self._messages)
            self.mode, self.is_armed = None, False
            self.turn_limit, self._asks_left = math.nan, _ASKED_PARAMETER
            self._asked_messages = self._fix_received = -math.inf
        self.vehicle, self._other = sender, None

    def _is_vehicle(self, heartbeat: Any) -> bool:
        messages = self._messages
        wanted = self._only in (0, heartbeat.get_srcSystem())
        return wanted and heartbeat.autopilot != messages.MAV_AUTOPILOT_INVALID

    @property
    def _addressed(self) -> tuple[int, int]:
        """Target of the messages, (system, component); (0, 0) is everybody."""
        return self.vehicle or (0, 0)

    def _is_rover(self, heartbeat: Any) -> bool:
        """Whether the numbers of modes are those of `RoverMode`."""
        messages = self._messages
        kinds = (messages.MAV_TYPE_GROUND_ROVER, messages.MAV_TYPE_SURFACE_BOAT)
        return heartbeat.autopilot == messages.MAV_AUTOPILOT_ARDUPILOTMEGA and heartbeat.type in kinds

    def alive(self, now: float) -> bool:
        """Whether the vehicle still sends: messages within `silence`, and heartbeats within `HEARTBEAT_LOST`."""
        return now - self._received <= self._silence and now - self._heartbeat <= HEARTBEAT_LOST

    def obstacle(self, now: float) -> str:
        """Why the vehicle could not be steered now; "" if it could."""
        if self.vehicle is None:
            return "no vehicle answers"
        return self.readiness.obstacle(now) if self.is_rover else _NO_ROVER

    @property
    def is_refused(self) -> bool:
        """True if the take-over failed before it was complete."""
        return bool(self.refusal) and self.phase is Takeover.TAKING

    def due(self, now: float, order: Order | None) -> list[Any]:
        """The messages to send now; call it at least every 0.1 s."""
        due = []
        if now - self._own_heartbeat >= 1.0:
            self._own_heartbeat = now
            due.append(self._heartbeat_message())
        if self.vehicle is None:
            return due
        order = order or Order(State.IDLE)
        self._judge(now, order)
        due += self._requests(now)
        due += self.targets_due(now, order)
        return due

    def last_messages(self, hands_back: bool) -> list[Any]:
        """The messages to send before the link closes: zero thrust and HOLD, or MANUAL for the skipper."""
        if self.vehicle is None or self.phase in (Takeover.FREE, Takeover.RETURNING):
            return []
        if hands_back:
            return [self._mode_message(RoverMode.MANUAL)]
        return [self._target_message(0.0, 0.0, 0.0), self._mode_message(RoverMode.HOLD)]

    def _judge(self, now: float, order: Order) -> None:
        """Update the phase from the order and the vehicle's mode."""
        steers = order.engaged and order.state in UNDER_WAY
        guided = self.mode == RoverMode.GUIDED
        if not steers:
            self.refusal = ""
        if self.phase in (Takeover.TAKING, Takeover.STEERING) and not steers:
            self._enter(Takeover.STOPPING if order.engaged else Takeover.RETURNING, now)
        elif self.phase in (Takeover.STOPPING, Takeover.RETURNING) and self._is_left(guided, now):
            self._enter(Takeover.FREE, now)
        elif self.phase is Takeover.TAKING and guided:
            self._enter(Takeover.STEERING, now)
        elif steers and not self.refusal:
            self._watch(guided, now)

    def _watch(self, guided: bool, now: float) -> None:
        """Check that the vehicle follows while the autopilot steers; set `refusal` if not."""
        if not self.is_rover:
            self.refusal = _NO_ROVER
        elif not self.is_armed:
            self.refusal = "the vehicle is not armed"
        elif self.phase is Takeover.STEERING and not guided:
            self.refusal = f"the vehicle was put into {mode_name(self.mode or 0)}"
            self._enter(Takeover.FREE, now)
        elif self.phase is Takeover.TAKING and now - self._since > _REFUSED:
            self.refusal = f"the vehicle does not go into GUIDED{f': {self._answer}' if self._answer else ''}"
            self.readiness.refused(self.refusal, now)
        elif self.phase in (Takeover.FREE, Takeover.STOPPING, Takeover.RETURNING):
            self._answer = ""
            self._enter(Takeover.TAKING, now)

    def _is_left(self, guided: bool, now: float) -> bool:
        """Whether the vehicle does not respond, or has left GUIDED while no request of GUIDED is pending."""
        on_its_way = now - self._asked_guided <= _CONFIRMED
        return (not guided and not on_its_way) or now - self._since > _GIVEN_UP

    def _enter(self, phase: Takeover, now: float) -> None:
        self.phase, self._since, self._asked_at = phase, now, -math.inf

    def _requests(self, now: float) -> list[Any]:
        """Requests of another mode, of missing messages, and of the parameter `_TURN_LIMIT`."""
        due = []
        mode = self._mode_wanted(now)
        if mode is not None and now - self._asked_at >= _ASKED_AGAIN:
            self._asked, self._asked_at = mode, now
            if mode is RoverMode.GUIDED:
                self._asked_guided = now
            due.append(self._mode_message(mode))
        misses = now - self._fix_received > _MISSED and now - self._asked_messages > _MISSED
        if misses or self._asked_messages == -math.inf:
            self._asked_messages = now
            due += [self._interval_message(name, interval) for name, interval in _WANTED.items()]
        if math.isnan(self.turn_limit) and self._asks_left and now - self._asked_parameter > _MISSED:
            self._asked_parameter, self._asks_left = now, self._asks_left - 1
            m = self._messages
            due.append(m.MAVLink_param_request_read_message(*self._addressed, _TURN_LIMIT.encode(), -1))
        return due

    def _mode_wanted(self, now: float) -> RoverMode | None:
        """The mode to request; None if it is in force, or if something else has ended GUIDED."""
        guided = self.mode == RoverMode.GUIDED
        if self.phase is Takeover.TAKING and not guided:
            return RoverMode.GUIDED
        if self.phase is Takeover.STOPPING and guided and now - self._since >= _STOPPING:
            return RoverMode.HOLD
        return RoverMode.MANUAL if self.phase is Takeover.RETURNING and guided else None

    def targets_due(self, now: float, order: Order) -> list[Any]:
        """The target to send now, none or one, while the vehicle is under control; see `due`."""
        if now - self._target < 0.9 * _TARGET_PERIOD or self.phase not in (Takeover.STEERING, Takeover.STOPPING):
            return []
        self._target = now
        yaw_rate, thrust = order.yaw_rate, order.thrust
        if self.phase is Takeover.STOPPING or not math.isfinite(yaw_rate + thrust):
            yaw_rate = thrust = 0.0
        return [self._target_message(yaw_rate, max(-1.0, min(1.0, thrust)), now)]

    def _heartbeat_message(self) -> Any:
        m = self._messages
        return m.MAVLink_heartbeat_message(
            m.MAV_TYPE_ONBOARD_CONTROLLER, m.MAV_AUTOPILOT_INVALID, 0, 0, m.MAV_STATE_ACTIVE, 3
        )

    def _target_message(self, yaw_rate: float, thrust: float, now: float) -> Any:
        m = self._messages
        mask = (
            m.ATTITUDE_TARGET_TYPEMASK_BODY_ROLL_RATE_IGNORE
            | m.ATTITUDE_TARGET_TYPEMASK_BODY_PITCH_RATE_IGNORE
            | m.ATTITUDE_TARGET_TYPEMASK_ATTITUDE_IGNORE
        )
        upright = [1.0, 0.0, 0.0, 0.0]
        return m.MAVLink_set_attitude_target_message(
            int(now * 1e3) & 0xFFFFFFFF, *self._addressed, mask, upright, 0.0, 0.0, yaw_rate, thrust
        )

    def _mode_message(self, mode: RoverMode) -> Any:
        m = self._messages
        return self._command(m.MAV_CMD_DO_SET_MODE, m.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, int(mode))

    def _interval_message(self, name: str, interval: float) -> Any:
        m = self._messages
        return self._command(m.MAV_CMD_SET_MESSAGE_INTERVAL, getattr(m, f"MAVLINK_MSG_ID_{name}"), interval * 1e6)

    def _command(self, command: int, first: float, second: float) -> Any:
        return self._messages.MAVLink_command_long_message(*self._addressed, command, 0, first, second, *[0.0] * 5)
