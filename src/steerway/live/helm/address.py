"""Where the page is served, and the token for access from other computers."""

import ipaddress
import os
import re
from typing import NamedTuple

from steerway.core.errors import InputError
from steerway.live.uri import host_and_port, secret_in

DEFAULT = "127.0.0.1:8080"
TOKEN_VARIABLE = "STEERWAY_HELM_TOKEN"
_PORT = 8080
_HOST = re.compile(r"[A-Za-z0-9._:-]+")
_ORIGIN = re.compile(r"https?://(\[[0-9a-f:.]+\]|[a-z0-9._-]+)(:[0-9]{1,5})?")  # as browsers send it
_SHORTEST = 8  # characters of a token: one guess a second does not find it in a lifetime
_LONGEST = 256


class Address(NamedTuple):
    """Where to serve, the token for access (None: no token), and the origin that browsers see behind a proxy."""

    host: str
    port: int
    token: str | None = None
    origin: str | None = None

    @property
    def is_loopback(self) -> bool:
        """Whether only this computer can reach it."""
        return is_loopback(self.host)

    @property
    def url(self) -> str:
        """The address for a browser."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"http://{host}:{self.port}"


def address(text: str, token: str | None = None, origin: str | None = None) -> Address:
    """The address of a text `host:port`; port 8080 by default. origin: `https://host` at which a proxy serves the page.

    Raises InputError for anything else, for a token that is too short, and for an address or an origin that other
    computers reach without a token.
    """
    try:
        host, port = host_and_port(text)
        port = _PORT if port is None else port
    except ValueError:
        host, port = "", 0
    if not _HOST.fullmatch(host) or host.isdigit() or not port:
        raise InputError(f"helm is {text!r}, expected host:port such as {DEFAULT}")
    if origin is not None and not _ORIGIN.fullmatch(origin):
        raise InputError(f"helm-origin is {origin!r}, expected the address for browsers such as https://boat.example")
    found = Address(host, port, checked(token), origin)
    if (origin is not None or not found.is_loopback) and found.token is None:
        raise InputError(
            f"helm {origin or text!r} can be reached from other computers, expected a token for it in the environment "
            f"variable {TOKEN_VARIABLE} or in a file that --helm-token-file names"
        )
    return found


def checked(token: str | None, whose: str = "helm") -> str | None:
    """The token itself when it is long enough. Raises InputError, which does not repeat it."""
    if token is not None and not (_SHORTEST <= len(token) <= _LONGEST and token.isprintable()):
        raise InputError(
            f"the {whose}'s token has {len(token)} characters, expected {_SHORTEST} to {_LONGEST} printable"
        )
    return token


def token_of(path: str | None, variable: str = TOKEN_VARIABLE, whose: str = "helm") -> str | None:
    """The token in a file, else in the environment; None without either.

    It is no option of its own: a command line is visible in logs and in the list of processes.
    """
    if path is None:
        return os.environ.get(variable) or None
    return secret_in(path, f"{whose}-token-file")


def is_loopback(host: str) -> bool:
    """Whether a host is this computer itself."""
    if host.casefold() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
