"""A MAVLink connection without a line."""

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
