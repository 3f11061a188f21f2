"""pymavlink's dialect, where it is installed, and the modes of ArduPilot's Rover."""

from enum import IntEnum

from steerway.core.extras import missing


class RoverMode(IntEnum):
    """`custom_mode` of a HEARTBEAT of ArduPilot's Rover, boats included; ardupilot.org, Rover parameter MODE1."""

    MANUAL = 0
    ACRO = 1
    STEERING = 3
    HOLD = 4
    LOITER = 5
    FOLLOW = 6
    SIMPLE = 7
    DOCK = 8
    CIRCLE = 9
    AUTO = 10
    RTL = 11
    SMART_RTL = 12
    GUIDED = 15
    INITIALISING = 16


def mode_name(custom_mode: int) -> str:
    """A mode's name as ground stations show it."""
    try:
        return RoverMode(custom_mode).name
    except ValueError:
        return f"mode {custom_mode}"


def dialect(address: str):
    """The module of messages, all of ArduPilot's and the common ones. Raises InputError where pymavlink is not."""
    try:
        import pymavlink.dialects.v20.ardupilotmega as messages
    except ImportError:
        raise missing(f"{address}:", "pymavlink", "mavlink") from None
    return messages
