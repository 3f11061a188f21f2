"""From addresses to links: which schemes there are, and what each becomes."""

import math
from collections.abc import Sequence

from steerway.core.errors import InputError
from steerway.live import uri
from steerway.live.links import listeners, speakers
from steerway.live.links.foxglove import FoxgloveServer, require_foxglove
from steerway.live.links.serial import speed_of
from steerway.live.links.signalk import require_websockets
from steerway.live.mavlink.companion import Companion, Told
from steerway.live.outputs.deltas import Deltas
from steerway.live.outputs.json_lines import JsonLines
from steerway.live.outputs.output import Output
from steerway.live.outputs.propellers import PERIOD, Propellers
from steerway.live.outputs.sentences import Sentences
from steerway.live.outputs.table import TableFile
from steerway.live.uri import Uri

FROM = {
    "serial": ("baud",),
    "tcp": (),
    "udp": (),
    "gpsd": (),
    "signalk": ("token",),
    "mavlink": ("baud", "silence", "system"),
    "file": ("speed",),
}
TO = {
    "stdout": ("say",),
    "serial": ("baud", "period", "say"),
    "tcp": ("period", "say"),
    "tcp-server": ("period", "say"),
    "udp": ("period", "say"),
    "signalk": ("token", "period"),
    "foxglove": ("period",),
    "mavlink": ("baud", "silence", "system"),
    "file": (),
}
"""Schemes and their options."""
MAVLINK_CARRIERS = ("udpin", "udpout", "tcp")

_PORTS = {"gpsd": 2947, "signalk": 3000, "foxglove": 8765}
_PERIODS = {"foxglove": 0.1}  # s, where it is not 1
_LISTENERS = {
    "serial": listeners.SerialListener,
    "tcp": listeners.TcpListener,
    "udp": listeners.UdpListener,
    "gpsd": listeners.GpsdListener,
    "signalk": listeners.SignalKListener,
}
_SPEAKERS = {
    "serial": speakers.SerialSpeaker,
    "tcp": speakers.TcpSpeaker,
    "tcp-server": speakers.TcpServerSpeaker,
    "udp": speakers.UdpSpeaker,
}


def sources(texts: Sequence[str]) -> tuple[list[Uri], float]:
    """What --from names, checked, and the speed of a replay (NaN for live links).

    Raises InputError for an address that cannot be, and for a log beside a live link: they have no common time.
    """
    found = [_checked(text, FROM) for text in texts]
    if not found:
        raise InputError("nothing to listen to, expected --from with an address such as serial:/dev/ttyACM0?baud=38400")
    logs = [each for each in found if each.scheme == "file"]
    if not logs:
        return found, math.nan
    if len(logs) < len(found):
        raise InputError(f"{logs[0].text}: a log cannot be played beside a live link, expected one or the other")
    speeds = {speed(each) for each in logs}
    if len(speeds) > 1:
        raise InputError(f"{logs[1].text}: the logs have different speeds, expected one for all")
    return found, speeds.pop()


def speed(log: Uri) -> float:
    """How many times faster than recorded a log is played; infinity for `speed=max`."""
    if log.options.get("speed") == "max":
        return math.inf
    chosen = log.number("speed", 1.0)
    if not chosen > 0.0:
        raise InputError(f"{log.text}: speed is {chosen:g}, expected a number above 0 or max")
    return chosen


def listener(address: Uri, among: int) -> listeners.Listener | Companion:
    """The listener of an address, one of `among`."""
    place = address.text if among > 1 else ""
    if address.scheme == "mavlink":
        return Companion(address, place)
    return _LISTENERS[address.scheme](address, place)


def output(
    text: str, rate: float | None, patient: bool, listening: Sequence = (), autopilot: Told | None = None
) -> tuple[Output, speakers.Speaker | Companion | FoxgloveServer | None]:
    """The output of an address and its link; files have none.

    rate:      None: a row a fix.
    patient:   lose nothing, as a log is replayed.
    listening: listeners that are there already; a link that works both ways is not opened twice.
    autopilot: whose orders a vehicle is told, and who hears of her link.
    """
    address = _checked(text, TO)
    if address.scheme == "mavlink":
        if autopilot is None or patient:
            what = "from a live link" if patient else "of a route, expected --mission FILE with it"
            raise InputError(f"{text}: a vehicle is steered by orders {what}")
        companion = _companion(address, listening)
        companion.autopilot = autopilot
        return companion, companion
    if address.scheme == "file":
        return TableFile(address.path, every_tick=rate is not None, patient=patient), None
    says_propellers = _says_propellers(address)
    if address.scheme == "stdout":
        speaker = speakers.StdoutSpeaker(address, patient)
        if says_propellers:
            return Propellers(speaker), speaker
        return JsonLines(speaker, every_tick=rate is not None), speaker
    usual = PERIOD if says_propellers else _PERIODS.get(address.scheme, 1.0)
    period = address.number("period", usual)
    if not period > 0.0:
        raise InputError(f"{text}: period is {period:g}, expected s above 0")
    if address.scheme == "signalk":
        speaker = speakers.SignalKSpeaker(address)
        return Deltas(speaker, period), speaker
    if address.scheme == "foxglove":
        server = FoxgloveServer(address, period)
        return server, server
    speaker = _SPEAKERS[address.scheme](address)
    return (Propellers if says_propellers else Sentences)(speaker, period), speaker


def _says_propellers(address) -> bool:
    said = address.options.get("say", "propellers")
    if said != "propellers":
        raise InputError(f"{address.text}: say is {said!r}, expected propellers, or nothing")
    return "say" in address.options


def stream(text: str) -> speakers.Speaker:
    """A link to say sentences on as they come. Raises InputError as the others do."""
    address = _checked(text, {"stdout": ()} | {scheme: TO[scheme] for scheme in _SPEAKERS})
    return speakers.StdoutSpeaker(address) if address.scheme == "stdout" else _SPEAKERS[address.scheme](address)


def vehicle(text: str) -> Uri:
    """The address on which a vehicle speaks MAVLink, with or without `mavlink:` before it."""
    return _checked(text if text.startswith("mavlink:") else f"mavlink:{text}", {"mavlink": ("baud", "cruise")})


def datagrams(text: str) -> Uri:
    """An address to listen to datagrams."""
    return _checked(text, {"udp": ()})


def _companion(address, listening) -> Companion:
    """The one that listens there already, or a new one."""
    for each in listening:
        if isinstance(each, Companion) and each.link.uri.place == address.place:
            if each.link.uri.options != address.options:
                raise InputError(
                    f"{address.text}: differs from {each.link.uri.text}, expected the same options in both"
                )
            return each
    return Companion(address)


def _checked(text, schemes) -> Uri:
    address = uri.parse(text, schemes, _PORTS)
    if address.scheme == "mavlink":
        address = uri.carried(address, MAVLINK_CARRIERS)
        if address.path:
            speed_of(address)
        return address
    if address.scheme in ("serial", "file"):
        uri.with_path(address)
    elif address.scheme != "stdout":
        uri.with_port(address)
    if address.scheme == "serial":
        speed_of(address)
    if address.scheme == "signalk":
        require_websockets(address)
    if address.scheme == "foxglove":
        require_foxglove(address)
    return address
