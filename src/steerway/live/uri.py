"""Addresses of links: `scheme:…` with options after a question mark.

MAVLink also names the link that carries it: `mavlink:udpin:host:port`. The address of a server (helm page, control
port) is `host:port`, with a token for access from other computers.
"""

import ipaddress
import logging
import os
import re
import stat
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple
from urllib.parse import parse_qsl, urlsplit

from steerway.core.errors import InputError

LOG = logging.getLogger("steerway.live")
_LONGEST_SECRET = 4096  # characters
DEFAULT = "127.0.0.1:8080"
TOKEN_VARIABLE = "STEERWAY_HELM_TOKEN"
_PORT = 8080
_HOST = re.compile(r"[A-Za-z0-9._:-]+")
_ORIGIN = re.compile(r"https?://(\[[0-9a-f:.]+\]|[a-z0-9._-]+)(:[0-9]{1,5})?")  # as browsers send it
_SHORTEST = 8  # least characters of a token: one guess a second does not find it in a lifetime
_LONGEST = 256
_TOKEN = re.compile(r"([?&]token=)[^&]*")


@dataclass(frozen=True)
class Uri:
    """One address. `host` is "" and `port` 0 if it has none; `via` is the carrier of `mavlink:`, else ""."""

    text: str
    scheme: str
    host: str = ""
    port: int = 0
    path: str = ""
    options: Mapping[str, str] = field(default_factory=dict)
    via: str = ""

    @property
    def place(self) -> tuple[str, str, str, int, str]:
        """The parts that identify the link."""
        return self.scheme, self.via, self.host, self.port, self.path

    def number(self, name: str, default: float) -> float:
        """An option as a number, or `default`. Raises InputError if it is not a number."""
        try:
            return float(self.options.get(name, default))
        except ValueError:
            raise InputError(f"{self.text}: {name} is {self.options[name]!r}, expected a number") from None


def parse(text: str, schemes: Collection[str], default_ports: Mapping[str, int]) -> Uri:
    """Parse an address; its options are not checked yet.

    Raises InputError for a scheme that is not among `schemes`, and for a malformed host or port. A token is kept in the
    options only, never in the text that logs and messages show.
    """
    given, text = text, _TOKEN.sub(r"\1***", text)
    try:
        parts = urlsplit(given, allow_fragments=False)
        host, port = parts.hostname or "", parts.port or default_ports.get(parts.scheme, 0)
    except ValueError as error:
        raise InputError(f"{text}: {error}, expected scheme://host:port") from None
    if parts.scheme not in schemes:
        known = ", ".join(f"{scheme}:" for scheme in schemes)
        raise InputError(f"{text!r} is not a known address, expected one that begins with {known}")
    options = dict(parse_qsl(parts.query, keep_blank_values=True))
    return Uri(text, parts.scheme, host, port, parts.path, options)


def with_options(uri: Uri, known: Collection[str]) -> Uri:
    """The address itself if all its options are known. Raises InputError that names the first unknown one."""
    for name in uri.options:
        if name not in known:
            expected = ", ".join(known) or "none"
            raise InputError(f"{uri.text}: option {name!r} is unknown, expected {expected}")
    return uri


def split_carrier(uri: Uri, carriers: tuple[str, ...]) -> Uri:
    """The address with its carrier, host and port taken from the path; an address of a device file stays as it is.

    Raises InputError for any path that is neither a device file nor one of `carriers` with host and port.
    """
    via, colon, place = uri.path.partition(":")
    if via not in carriers or not colon:
        if uri.path.startswith("/"):
            return uri
        forms = ", ".join(f"{uri.scheme}:{each}:host:port" for each in carriers)
        raise InputError(f"{uri.text}: names no link, expected {forms} or {uri.scheme}:/dev/…")
    try:
        host, port = host_and_port(place)
    except ValueError as error:
        raise InputError(f"{uri.text}: {error}, expected {uri.scheme}:{via}:host:port") from None
    if not port:
        raise InputError(f"{uri.text}: names no port, expected {uri.scheme}:{via}:host:port")
    return replace(uri, via=via, host=host, port=port, path="")


def host_and_port(text: str) -> tuple[str, int | None]:
    """Host ("" for none) and port (None for none) of `host:port` or `[address]:port`. Raises ValueError."""
    parts = urlsplit(f"//{text}")
    if parts.path or parts.query or parts.fragment or parts.username is not None:
        raise ValueError(f"{text!r} is more than host and port")
    return parts.hostname or "", parts.port


def secret_in(path: str | Path, what: str) -> str:
    """Read a secret from a file, without the space around it; warn if other users of the computer can read the file.

    Raises InputError if the file cannot be read; the message starts with `what` and never contains the secret.
    """
    try:
        with open(path, encoding="utf-8") as file:
            mode = stat.S_IMODE(os.fstat(file.fileno()).st_mode)
            if os.name == "posix" and mode & 0o077:
                LOG.warning("%s %s: other users can read it (mode %03o), expected mode 600", what, path, mode)
            return file.read(_LONGEST_SECRET).strip()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{what} {path} cannot be read: {getattr(error, 'strerror', None) or error}") from None


def with_port(uri: Uri) -> Uri:
    """The address itself. Raises InputError if it names no port."""
    if not uri.port:
        raise InputError(f"{uri.text}: names no port, expected {uri.scheme}://host:port")
    return uri


def with_path(uri: Uri) -> Uri:
    """The address itself. Raises InputError if it names no path."""
    if not uri.path:
        raise InputError(f"{uri.text}: names no path, expected {uri.scheme}:PATH")
    return uri


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
    """Parse `host:port`; the default port is 8080. origin: `https://host` at which a proxy serves the page.

    Raises InputError for any other text, for a token of a wrong length, and if other computers can reach the address or
    the origin but there is no token.
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
    """The token itself if its length is allowed. Raises InputError otherwise, without the token in the message."""
    if token is not None and not (_SHORTEST <= len(token) <= _LONGEST and token.isprintable()):
        raise InputError(
            f"the {whose}'s token has {len(token)} characters, expected {_SHORTEST} to {_LONGEST} printable ones"
        )
    return token


def token_of(path: str | None, variable: str = TOKEN_VARIABLE, whose: str = "helm") -> str | None:
    """The token from a file, else from the environment; None without either.

    No option takes the token itself: a command line is visible in logs and in the list of processes.
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
