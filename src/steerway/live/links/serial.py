"""A serial port as a file, by termios: raw, eight bits, no parity, one stop bit."""

import os
import termios
import tty

from steerway.core.errors import InputError
from steerway.live.uri import Uri

_SPEEDS = {int(name[1:]): value for name, value in vars(termios).items() if name[0] == "B" and name[1:].isdigit()}


def speed_of(uri: Uri) -> int:
    """The termios constant of an address' baud rate. Raises InputError where there is none such."""
    baud = uri.number("baud", 38400)
    if baud not in _SPEEDS or not baud:
        usual = ", ".join(map(str, sorted(each for each in _SPEEDS if 4800 <= each <= 921600)))
        raise InputError(f"{uri.text}: baud is {baud:g}, expected one of {usual}")
    return _SPEEDS[baud]


def opened(uri: Uri):
    """An unbuffered file on the port of an address, set to its speed and never blocking."""
    descriptor = os.open(uri.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        tty.setraw(descriptor)
        settings = termios.tcgetattr(descriptor)
        settings[2] |= termios.CLOCAL | termios.CREAD
        settings[2] &= ~termios.CSTOPB
        settings[4] = settings[5] = speed_of(uri)
        termios.tcsetattr(descriptor, termios.TCSANOW, settings)
    except termios.error as error:
        os.close(descriptor)
        raise OSError(*error.args) from None
    return os.fdopen(descriptor, "r+b", buffering=0)
