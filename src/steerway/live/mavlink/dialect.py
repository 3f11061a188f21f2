"""pymavlink's dialect, where it is installed, the modes of ArduPilot's Rover, and MAVLink 2 signing.

The key is the SHA-256 of a passphrase, as ground stations make it, or 64 hexadecimal digits.
Source: mavlink.io, guide "Message signing".
"""

import hashlib
import re
import time
from enum import IntEnum

from steerway.core.errors import InputError
from steerway.core.extras import missing
from steerway.live.uri import secret_in


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


_EPOCH = 1_420_070_400.0  # Unix time of 2015-01-01, from which signatures count
_TICK = 1e-5  # s
_SHORTEST = 8


def key_of(path: str) -> bytes:
    """The key in a file. Raises InputError, which does not repeat it."""
    text = secret_in(path, "signing key")
    if re.fullmatch(r"[0-9A-Fa-f]{64}", text):
        return bytes.fromhex(text)
    if len(text) < _SHORTEST:
        raise InputError(f"signing key {path} has {len(text)} characters, expected at least {_SHORTEST}")
    return hashlib.sha256(text.encode()).digest()


def sign(codec, key: bytes, link: int = 0) -> None:
    """Sign what a codec sends, and accept only what is signed with the same key."""
    codec.signing.secret_key = key
    codec.signing.sign_outgoing = True
    codec.signing.link_id = link
    codec.signing.timestamp = int((time.time() - _EPOCH) / _TICK)
