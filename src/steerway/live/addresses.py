"""Opens inputs and outputs by address: for every scheme its link, what it can read and write, its options and checks.

To add a link, write a file and add a row to `SCHEMES`; to add an output format, write a file and add one to `FORMATS`.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, NamedTuple, TypeVar
from urllib.parse import quote

from steerway.core.checks import positive
from steerway.core.errors import InputError
from steerway.core.extras import require
from steerway.live import uri
from steerway.live.links.file import StdoutSink
from steerway.live.links.gpsd import GpsdInput
from steerway.live.links.link import Reads, Runs, Sink
from steerway.live.links.signalk import TOKENS, SignalKInput, SignalKSink, token_of
from steerway.live.links.transport import StreamInput, StreamSink, UdpSink, speed_of
from steerway.live.mavlink.companion import CARRIERS, Companion
from steerway.live.mavlink.link import key_of
from steerway.live.n2k import N2kDevice
from steerway.live.outputs.foxglove import FoxgloveServer
from steerway.live.outputs.lines import PERIOD, JsonLines, PropellerCommands, SentenceOutput
from steerway.live.outputs.output import Output
from steerway.live.outputs.signalk_output import Deltas
from steerway.live.outputs.table import TableFile
from steerway.live.uri import Uri

if TYPE_CHECKING:
    from steerway.live.autopilot.supervisor import Supervisor

T = TypeVar("T")


class Context(NamedTuple):
    """The parts of a service that its outputs use.

    every_tick: whether to output a row per tick instead of a row per fix.
    lossless:   whether a log is replayed, which waits for slow outputs.
    inputs:     the open inputs; an output on the same link uses the open link.
    supervisor: the supervisor, which gives the orders for a vehicle; None without a route.
    """

    every_tick: bool = False
    lossless: bool = False
    inputs: Sequence[object] = ()
    supervisor: "Supervisor | None" = None


@dataclass(frozen=True)
class Scheme:
    """One kind of link.

    check: address → completed address; raises InputError.
    port:  default port, 0 for none.
    extra: the extra whose packages the link needs, "" for none.
    source: (address, suffix for names of sources) → input; None for a link that cannot be read.
    source_options: options of an input address.
    sink:  (address, lossless) → sink, for any format of `forms`; `form` is the default format.
    output: (address, context) → output and its link, for a scheme with a format of its own.
    sink_options: options of an output address.
    """

    check: Callable[[Uri], Uri] = uri.with_port
    port: int = 0
    extra: str = ""
    source: Callable[[Uri, str], Reads] | None = None
    source_options: tuple[str, ...] = ()
    sink: Callable[[Uri, bool], Sink] | None = None
    form: str = "nmea"
    forms: tuple[str, ...] = ("nmea", "json", "propellers")
    output: Callable[[Uri, Context], tuple[Output, Runs | None]] | None = None
    sink_options: tuple[str, ...] = ()


def _serial(address: Uri) -> Uri:
    speed_of(uri.with_path(address))
    return address


def _signalk(address: Uri) -> Uri:
    token_of(address)
    return uri.with_port(address)


def _mavlink(address: Uri) -> Uri:
    address = uri.split_carrier(address, CARRIERS)
    if address.path:
        speed_of(address)
    if "signing" in address.options:
        key_of(address.options["signing"])
    return address


def _foxglove_output(address: Uri, context: Context) -> tuple[Output, Runs | None]:
    server = FoxgloveServer(address, positive(f"{address.text}: period", address.number("period", 0.1)))
    return server, server


def _table_output(address: Uri, context: Context) -> tuple[Output, Runs | None]:
    return TableFile(address.path, every_tick=context.every_tick, lossless=context.lossless), None


def _signalk_output(address: Uri, context: Context) -> tuple[Output, Runs | None]:
    """By default the position is not sent back to a server from which it is read."""
    read = any(isinstance(each, SignalKInput) and each.uri.place == address.place for each in context.inputs)
    text = address.options.get("position", "no" if read else "yes")
    if text not in ("yes", "no"):
        raise InputError(f"{address.text}: position is {text!r}, expected yes or no")
    sink = SignalKSink(address)
    period = positive(f"{address.text}: period", address.number("period", 1.0))
    return Deltas(sink, period, text == "yes"), sink


def _mavlink_output(address: Uri, context: Context) -> tuple[Output, Runs | None]:
    """The companion that reads from the same link, or else a new one."""
    if context.supervisor is None or context.lossless:
        what = "a live link" if context.lossless else "a route, expected --mission FILE"
        raise InputError(f"{address.text}: steering a vehicle needs {what}")
    open_ones = (each for each in context.inputs if isinstance(each, Companion))
    companion = next((each for each in open_ones if each.link.uri.place == address.place), None) or Companion(address)
    if companion.link.uri.options != address.options:
        raise InputError(f"{address.text}: differs from {companion.link.uri.text}, expected the same options in both")
    companion.supervisor = context.supervisor
    return companion, companion


def _n2k_output(address: Uri, context: Context) -> tuple[Output, Runs | None]:
    """The device that reads from the same bus, or else a new one."""
    if context.lossless:
        raise InputError(f"{address.text}: a log is replayed, expected a live link")
    found = (each for each in context.inputs if isinstance(each, N2kDevice) and each.uri.place == address.place)
    device = next(found, None) or N2kDevice(address)
    return device, device


_COMPANION_OPTIONS = ("baud", "silence", "system", "signing")

SCHEMES = {
    "serial": Scheme(
        check=_serial,
        source=partial(StreamInput, kind="serial"),
        source_options=("baud",),
        sink=lambda address, _: StreamSink(address, "serial"),
        sink_options=("baud",),
    ),
    "tcp": Scheme(source=StreamInput, sink=lambda address, _: StreamSink(address)),
    "tcp-server": Scheme(sink=lambda address, _: StreamSink(address, "tcp-server")),
    "udp": Scheme(source=partial(StreamInput, kind="udp"), sink=lambda address, _: UdpSink(address)),
    "gpsd": Scheme(port=2947, source=GpsdInput),
    "signalk": Scheme(
        check=_signalk,
        port=3000,
        extra="live",
        source=SignalKInput,
        source_options=TOKENS,
        output=_signalk_output,
        sink_options=(*TOKENS, "period", "position"),
    ),
    "mavlink": Scheme(
        check=_mavlink,
        extra="mavlink",
        source=Companion,
        source_options=_COMPANION_OPTIONS,
        output=_mavlink_output,
        sink_options=_COMPANION_OPTIONS,
    ),
    "n2k": Scheme(
        check=uri.with_path,
        extra="n2k",
        source=N2kDevice,
        source_options=("interface",),
        output=_n2k_output,
        sink_options=("interface",),
    ),
    "n2k+tcp": Scheme(source=N2kDevice, output=_n2k_output),
    "foxglove": Scheme(port=8765, extra="foxglove", output=_foxglove_output, sink_options=("period",)),
    "file": Scheme(check=uri.with_path, source_options=("speed",), output=_table_output),
    "stdout": Scheme(check=lambda address: address, sink=StdoutSink, form="json"),
}
LOG = "file"
"""The scheme whose input is a recorded log, replayed instead of read."""
INPUTS = tuple(name for name, each in SCHEMES.items() if each.source or name == LOG)
OUTPUTS = tuple(name for name, each in SCHEMES.items() if each.sink or each.output)
PORTS = {name: each.port for name, each in SCHEMES.items() if each.port}


class Format(NamedTuple):
    """One output format.

    make:    (sink, period in s, whether every tick is sent) → output.
    period:  default period, s; None for a format without one.
    commands_propellers: whether it contains the autopilot's propeller commands; it then needs a route.
    """

    make: Callable[[Sink, float, bool], Output]
    period: float | None = None
    commands_propellers: bool = False


FORMATS = {
    "nmea": Format(lambda sink, period, _: SentenceOutput(sink, period), 1.0),
    "json": Format(lambda sink, _, every_tick: JsonLines(sink, every_tick)),
    "propellers": Format(lambda sink, period, _: PropellerCommands(sink, period), PERIOD, commands_propellers=True),
}


def sources(texts: Sequence[str]) -> tuple[list[Uri], float]:
    """The checked addresses of --from, and the speed of a replay (NaN for live links).

    Raises InputError for an invalid address, and for a log together with a live link: they have no common time.
    """
    found = [_checked(text, INPUTS) for text in texts]
    if not found:
        raise InputError("no input, expected --from with an address such as serial:/dev/ttyACM0?baud=38400")
    logs = [each for each in found if each.scheme == LOG]
    if not logs:
        return found, math.nan
    if len(logs) < len(found):
        raise InputError(f"{logs[0].text}: a log cannot be replayed beside a live link, expected one or the other")
    speeds = {_speed(each) for each in logs}
    if len(speeds) > 1:
        raise InputError(f"{logs[1].text}: the logs have different replay speeds, expected the same for all")
    return found, speeds.pop()


def opened(address: Uri, among: int) -> Reads:
    """The input of an address. If it is one of several (`among`), names of its sources contain the address."""
    return _given(SCHEMES[address.scheme].source)(address, address.text if among > 1 else "")


def sink(text: str) -> Uri:
    """The checked address of --to. Raises InputError for an invalid one."""
    address = uri.parse(text, OUTPUTS, PORTS)
    scheme = SCHEMES[address.scheme]
    options = scheme.sink_options
    if scheme.sink is not None:
        form = _form(address)
        options += ("format",) if len(scheme.forms) > 1 else ()
        options += () if FORMATS[form].period is None else ("period",)
    return _completed(uri.with_options(address, options))


def commands_propellers(address: Uri) -> bool:
    """Whether an output contains the autopilot's propeller commands."""
    return SCHEMES[address.scheme].sink is not None and FORMATS[_form(address)].commands_propellers


def output(address: Uri | str, context: Context = Context()) -> tuple[Output, Runs | None]:  # noqa: B008
    """The output of an address, and its link (None for a file)."""
    address = sink(address) if isinstance(address, str) else address
    scheme = SCHEMES[address.scheme]
    if scheme.output is not None:
        return scheme.output(address, context)
    form = FORMATS[_form(address)]
    period = math.nan
    if form.period is not None:
        period = positive(f"{address.text}: period", address.number("period", form.period))
    link = _given(scheme.sink)(address, context.lossless)
    return form.make(link, period, context.every_tick), link


def stream(text: str) -> Sink:
    """A sink for NMEA 0183 sentences. Raises InputError for an invalid address."""
    streams = [name for name in OUTPUTS if "nmea" in SCHEMES[name].forms and SCHEMES[name].sink]
    scheme = SCHEMES[uri.parse(text, streams, PORTS).scheme]
    return _given(scheme.sink)(_checked(text, streams, scheme.sink_options), False)


def _given(opener: T | None) -> T:
    """A scheme's opener, which every scheme in `INPUTS` or `OUTPUTS` has."""
    assert opener is not None
    return opener


def signed(text: str, key_file: str | None) -> str:
    """The address with the file of the signing key, if it is a MAVLink address that names none."""
    if key_file is None or not text.startswith("mavlink:") or "signing=" in text:
        return text
    return f"{text}{'&' if '?' in text else '?'}signing={quote(key_file)}"


def vehicle(text: str) -> Uri:
    """The address of a simulated MAVLink vehicle, with or without `mavlink:` before it."""
    return _checked(_of_mavlink(text), ("mavlink",), ("baud", "cruise", "ekf", "compass", "turn", "signing"))


def ground_station(text: str, key_file: str | None = None) -> Uri:
    """The address of ground stations, with or without `mavlink:` before it; key_file: as for `signed`."""
    return _checked(signed(_of_mavlink(text), key_file), ("mavlink",), ("baud", "signing"))


def datagrams(text: str) -> Uri:
    """An address on which datagrams are received."""
    return _checked(text, ("udp",), ())


def _of_mavlink(text: str) -> str:
    return text if text.startswith("mavlink:") else f"mavlink:{text}"


def _checked(text: str, schemes: Sequence[str], options: Sequence[str] | None = None) -> Uri:
    """A checked address with one of `schemes`. options: the allowed ones, by default those of an input address."""
    address = uri.parse(text, schemes, PORTS)
    return _completed(uri.with_options(address, SCHEMES[address.scheme].source_options if options is None else options))


def _completed(address: Uri) -> Uri:
    scheme = SCHEMES[address.scheme]
    if scheme.extra:
        require(f"{address.text}:", scheme.extra)
    return scheme.check(address)


def _speed(log: Uri) -> float:
    """How many times faster than recorded a log is replayed; infinity for `speed=max`."""
    if log.options.get("speed") == "max":
        return math.inf
    speed = log.number("speed", 1.0)
    if not speed > 0.0:
        raise InputError(f"{log.text}: speed is {speed:g}, expected a number above 0 or max")
    return speed


def _form(address: Uri) -> str:
    scheme = SCHEMES[address.scheme]
    form = address.options.get("format", scheme.form)
    if form not in scheme.forms:
        raise InputError(f"{address.text}: format is {form!r}, expected one of {', '.join(scheme.forms)}")
    return form
