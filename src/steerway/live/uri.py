"""Where to listen and where to speak: `scheme:…` with options behind a question mark.

A scheme that is no link itself names the one that carries it: `mavlink:udpin:host:port`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from urllib.parse import parse_qsl, urlsplit

from steerway.core.errors import InputError


@dataclass(frozen=True)
class Uri:
    """One address. `host` "" and `port` 0 where not said; `via` is what carries it, where it is not said by scheme."""

    text: str
    scheme: str
    host: str = ""
    port: int = 0
    path: str = ""
    options: Mapping[str, str] = field(default_factory=dict)
    via: str = ""

    @property
    def place(self) -> tuple[str, str, str, int, str]:
        """What of it tells one link from another."""
        return self.scheme, self.via, self.host, self.port, self.path

    def number(self, name: str, default: float) -> float:
        """A numeric option."""
        try:
            return float(self.options.get(name, default))
        except ValueError:
            raise InputError(f"{self.text}: {name} is {self.options[name]!r}, expected a number") from None


def parse(text: str, schemes: Mapping[str, tuple[str, ...]], default_ports: Mapping[str, int]) -> Uri:
    """The address a text means.

    `schemes` maps those that are known here to the options they have. Raises InputError for any other scheme or option,
    and where host, port or path is missing.
    """
    try:
        parts = urlsplit(text, allow_fragments=False)
        host, port = parts.hostname or "", parts.port or default_ports.get(parts.scheme, 0)
    except ValueError as error:
        raise InputError(f"{text}: {error}, expected scheme://host:port") from None
    if parts.scheme not in schemes:
        raise InputError(f"{text!r} is no address known here, expected one beginning with {', '.join(schemes)}")
    options = dict(parse_qsl(parts.query, keep_blank_values=True))
    for name in options:
        if name not in schemes[parts.scheme]:
            known = ", ".join(schemes[parts.scheme]) or "none"
            raise InputError(f"{text}: option {name!r} is unknown, expected {known}")
    return Uri(text, parts.scheme, host, port, parts.path, options)


def carried(uri: Uri, carriers: tuple[str, ...]) -> Uri:
    """The address with host and port of what carries it; one of a path stays as it is.

    Raises InputError for what is neither one of `carriers` with host and port nor a path.
    """
    via, colon, place = uri.path.partition(":")
    if via not in carriers or not colon:
        if uri.path.startswith("/"):
            return uri
        ways = ", ".join(f"{uri.scheme}:{each}:host:port" for each in carriers)
        raise InputError(f"{uri.text}: names no link, expected {ways} or {uri.scheme}:/dev/…")
    try:
        parts = urlsplit(f"//{place}")
        host, port = parts.hostname or "", parts.port
    except ValueError as error:
        raise InputError(f"{uri.text}: {error}, expected {uri.scheme}:{via}:host:port") from None
    if not port:
        raise InputError(f"{uri.text}: names no port, expected {uri.scheme}:{via}:host:port")
    return replace(uri, via=via, host=host, port=port, path="")


def with_port(uri: Uri) -> Uri:
    """The address itself when it names a port."""
    if not uri.port:
        raise InputError(f"{uri.text}: names no port, expected {uri.scheme}://host:port")
    return uri


def with_path(uri: Uri) -> Uri:
    """The address itself when it names a path."""
    if not uri.path:
        raise InputError(f"{uri.text}: names no path, expected {uri.scheme}:PATH")
    return uri
