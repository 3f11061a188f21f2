"""A MAVLink connection without a line."""

import time

import pytest

messages = pytest.importorskip("pymavlink.dialects.v20.ardupilotmega", reason="pymavlink is not installed")
NOON = 1_780_000_000.0


class Wire:
    """Packs what one says and hands it to the other."""

    def __init__(self, system, component):
        self.codec = messages.MAVLink(None, system, component)
        self.other = messages.MAVLink(None)

    def carry(self, output):
        return [each for message in output for each in self.other.parse_buffer(message.pack(self.codec))]


def signed(codec, key):
    """A codec that signs what it packs by a key from now on."""
    codec.signing.secret_key, codec.signing.sign_outgoing = key, True
    codec.signing.timestamp = round((time.time() - 1_420_070_400.0) * 1e5)  # since 2015, 10 µs
    return codec
