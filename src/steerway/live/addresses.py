"""From addresses to inputs and outputs, by the tables in `link_kinds`."""

import math
from collections.abc import Sequence
from urllib.parse import quote

from steerway.core.checks import positive
from steerway.core.errors import InputError
from steerway.live import uri
from steerway.live.link_kinds import FORMATS, INPUTS, LOG, OUTPUTS, PORTS, SCHEMES, Context
from steerway.live.links.link import Input, Sink
from steerway.live.mavlink.companion import Companion
from steerway.live.outputs.output import Output
from steerway.live.uri import Uri


def sources(texts: Sequence[str]) -> tuple[list[Uri], float]:
    """The addresses of --from, checked, and the speed of a replay (NaN for live links).

    Raises InputError for an address that cannot be, and for a log beside a live link: they have no common time.
    """
    found = [_source(text) for text in texts]
    if not found:
        raise InputError("no input, expected --from with an address such as serial:/dev/ttyACM0?baud=38400")
    logs = [each for each in found if each.scheme == LOG]
    if not logs:
        return found, math.nan
    if len(logs) < len(found):
        raise InputError(f"{logs[0].text}: a log cannot be replayed beside a live link, expected one or the other")
    speeds = {_speed(each) for each in logs}
    if len(speeds) > 1:
        raise InputError(f"{logs[1].text}: the logs have different speeds, expected one for all")
    return found, speeds.pop()


def opened(address: Uri, among: int) -> Input | Companion:
    """The input of an address, one of `among`."""
    return SCHEMES[address.scheme].source(address, address.text if among > 1 else "")


def sink(text: str) -> Uri:
    """An address of --to, checked. Raises InputError for one that cannot be."""
    address = uri.parse(text, OUTPUTS, PORTS)
    scheme = SCHEMES[address.scheme]
    options = scheme.sink_options
    if scheme.sink is not None:
        form = _form(address)
        options += ("format",) if len(scheme.forms) > 1 else ()
        options += () if FORMATS[form].period is None else ("period",)
    return scheme.check(uri.with_options(address, options))


def commands_propellers(address: Uri) -> bool:
    """Whether an output carries the autopilot's propeller commands."""
    return SCHEMES[address.scheme].sink is not None and FORMATS[_form(address)].commands_propellers


def output(address: Uri | str, context: Context = Context()) -> tuple[Output, object]:  # noqa: B008
    """The output of an address and its link, None for a file."""
    address = sink(address) if isinstance(address, str) else address
    scheme = SCHEMES[address.scheme]
    if scheme.output is not None:
        return scheme.output(address, context)
    form = FORMATS[_form(address)]
    period = math.nan
    if form.period is not None:
        period = positive(f"{address.text}: period", address.number("period", form.period))
    link = scheme.sink(address, context.lossless)
    return form.make(link, period, context.every_tick), link


def stream(text: str) -> Sink:
    """A link for sentences as they come. Raises InputError as the others do."""
    streams = [name for name in OUTPUTS if "nmea" in SCHEMES[name].forms and SCHEMES[name].sink]
    address = uri.parse(text, streams, PORTS)
    scheme = SCHEMES[address.scheme]
    return scheme.sink(scheme.check(uri.with_options(address, scheme.sink_options)), False)


def signed(text: str, key_file: str | None) -> str:
    """An address with the file of the signing key, where it is one of MAVLink that names none."""
    if key_file is None or not text.startswith("mavlink:") or "signing=" in text:
        return text
    return f"{text}{'&' if '?' in text else '?'}signing={quote(key_file)}"


def vehicle(text: str) -> Uri:
    """The address of a simulated MAVLink vehicle, with or without `mavlink:` before it."""
    address = uri.parse(text if text.startswith("mavlink:") else f"mavlink:{text}", ("mavlink",), PORTS)
    return SCHEMES["mavlink"].check(uri.with_options(address, ("baud", "cruise", "ekf", "compass", "turn", "signing")))


def ground_station(text: str, key_file: str | None = None) -> Uri:
    """The address of ground stations, with or without `mavlink:` before it; key_file: as of `signed`."""
    text = signed(text if text.startswith("mavlink:") else f"mavlink:{text}", key_file)
    return SCHEMES["mavlink"].check(uri.with_options(uri.parse(text, ("mavlink",), PORTS), ("baud", "signing")))


def datagrams(text: str) -> Uri:
    """An address on which datagrams are received."""
    return uri.with_port(uri.with_options(uri.parse(text, ("udp",), PORTS), ()))


def _source(text) -> Uri:
    address = uri.parse(text, INPUTS, PORTS)
    scheme = SCHEMES[address.scheme]
    return scheme.check(uri.with_options(address, scheme.source_options))


def _speed(log: Uri) -> float:
    """How many times faster than recorded a log is replayed; infinity for `speed=max`."""
    if log.options.get("speed") == "max":
        return math.inf
    speed = log.number("speed", 1.0)
    if not speed > 0.0:
        raise InputError(f"{log.text}: speed is {speed:g}, expected a number above 0 or max")
    return speed


def _form(address) -> str:
    scheme = SCHEMES[address.scheme]
    form = address.options.get("format", scheme.form)
    if form not in scheme.forms:
        raise InputError(f"{address.text}: format is {form!r}, expected one of {', '.join(scheme.forms)}")
    return form
