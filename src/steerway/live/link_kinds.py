"""The links by scheme: what each can read, what it can write, its options and its checks.

A new link is a file of its own and a row here; a new form of output a file and a row of `FORMATS`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from steerway.core.checks import positive
from steerway.core.errors import InputError
from steerway.live import uri
from steerway.live.links.file import StdoutSink
from steerway.live.links.gpsd import GpsdInput
from steerway.live.links.link import Input, Sink
from steerway.live.links.signalk import TOKENS, SignalKInput, SignalKSink, require_websockets, token_of
from steerway.live.links.transport import StreamInput, StreamSink, UdpSink, speed_of
from steerway.live.mavlink.companion import CARRIERS, Companion
from steerway.live.mavlink.link import key_of
from steerway.live.n2k import N2kDevice, require_can
from steerway.live.outputs.foxglove import FoxgloveServer, require_foxglove
from steerway.live.outputs.lines import PERIOD, JsonLines, PropellerCommands, SentenceOutput
from steerway.live.outputs.output import Output
from steerway.live.outputs.signalk_output import Deltas
from steerway.live.outputs.table import TableFile
from steerway.live.uri import Uri

if TYPE_CHECKING:
    from steerway.live.autopilot.supervisor import Supervisor


class Context(NamedTuple):
    """What an output is opened for.

    every_tick: rows at a rate, else a row a fix.
    lossless:   a log is replayed, which waits for slow outputs.
    inputs:     those that are open already; a link that works both ways is not opened twice.
    supervisor: gives the orders for a vehicle; None without a route.
    """

    every_tick: bool = False
    lossless: bool = False
    inputs: Sequence = ()
    supervisor: "Supervisor | None" = None


@dataclass(frozen=True)
class Scheme:
    """One kind of link.

    check: the address itself, completed, or InputError.
    port:  default, 0 for none.
    source: (address, name of its place) → input; None for what cannot be read here.
    source_options: of its address as an input.
    sink:  (address, lossless) → sink, for any form of output; `form` is the default one, `forms` those that it takes.
    output: (address, context) → output and its link, for what has a form of its own.
    sink_options: of its address as an output.
    """

    check: Callable[[Uri], Uri] = uri.with_port
    port: int = 0
    source: Callable[[Uri, str], Input | Companion] | None = None
    source_options: tuple[str, ...] = ()
    sink: Callable[[Uri, bool], Sink] | None = None
    form: str = "nmea"
    forms: tuple[str, ...] = ("nmea", "json", "propellers")
    output: Callable[[Uri, Context], tuple[Output, object]] | None = None
    sink_options: tuple[str, ...] = ()


def _serial(address: Uri) -> Uri:
    speed_of(uri.with_path(address))
    return address


def _signalk(address: Uri) -> Uri:
    require_websockets(uri.with_port(address))
    token_of(address)
    return address


def _foxglove(address: Uri) -> Uri:
    require_foxglove(uri.with_port(address))
    return address


def _mavlink(address: Uri) -> Uri:
    address = uri.split_carrier(address, CARRIERS)
    if address.path:
        speed_of(address)
    if "signing" in address.options:
        key_of(address.options["signing"])
    return address


def _foxglove_output(address, context):
    server = FoxgloveServer(address, positive(f"{address.text}: period", address.number("period", 0.1)))
    return server, server


def _table_output(address, context):
    return TableFile(address.path, every_tick=context.every_tick, lossless=context.lossless), None


def _signalk_output(address, context):
    """The own position is not sent back to the server that the positions come from."""
    read = any(isinstance(each, SignalKInput) and each.uri.place == address.place for each in context.inputs)
    text = address.options.get("position", "no" if read else "yes")
    if text not in ("yes", "no"):
        raise InputError(f"{address.text}: position is {text!r}, expected yes or no")
    sink = SignalKSink(address)
    period = positive(f"{address.text}: period", address.number("period", 1.0))
    return Deltas(sink, period, text == "yes"), sink


def _mavlink_output(address, context):
    """The companion that reads from the same link, or a new one."""
    if context.supervisor is None or context.lossless:
        what = "from a live link" if context.lossless else "of a route, expected --mission FILE with it"
        raise InputError(f"{address.text}: a vehicle is steered by orders {what}")
    companion = next((each for each in context.inputs if _is_on(each, address)), None) or Companion(address)
    if companion.link.uri.options != address.options:
        raise InputError(f"{address.text}: differs from {companion.link.uri.text}, expected the same options in both")
    companion.supervisor = context.supervisor
    return companion, companion


def _is_on(link, address) -> bool:
    return isinstance(link, Companion) and link.link.uri.place == address.place


def _n2k(address: Uri) -> Uri:
    require_can(uri.with_path(address))
    return address


def _n2k_output(address, context):
    """The device that reads from the same bus, or a new one."""
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
        source=SignalKInput,
        source_options=TOKENS,
        output=_signalk_output,
        sink_options=(*TOKENS, "period", "position"),
    ),
    "mavlink": Scheme(
        check=_mavlink,
        source=Companion,
        source_options=_COMPANION_OPTIONS,
        output=_mavlink_output,
        sink_options=_COMPANION_OPTIONS,
    ),
    "n2k": Scheme(
        check=_n2k,
        source=N2kDevice,
        source_options=("interface",),
        output=_n2k_output,
        sink_options=("interface",),
    ),
    "n2k+tcp": Scheme(source=N2kDevice, output=_n2k_output),
    "foxglove": Scheme(check=_foxglove, port=8765, output=_foxglove_output, sink_options=("period",)),
    "file": Scheme(check=uri.with_path, source_options=("speed",), output=_table_output),
    "stdout": Scheme(check=lambda address: address, sink=StdoutSink, form="json"),
}
LOG = "file"
"""The scheme whose input is a recorded log, replayed instead of read."""
INPUTS = tuple(name for name, each in SCHEMES.items() if each.source or name == LOG)
OUTPUTS = tuple(name for name, each in SCHEMES.items() if each.sink or each.output)
PORTS = {name: each.port for name, each in SCHEMES.items() if each.port}


class Format(NamedTuple):
    """One form.

    make:    (sink, period in s, whether every tick is sent) → output.
    period:  default, s; None for a form that has none.
    commands_propellers: whether it carries the autopilot's commands, and is of no use without a route.
    """

    make: Callable[[Sink, float, bool], Output]
    period: float | None = None
    commands_propellers: bool = False


FORMATS = {
    "nmea": Format(lambda sink, period, _: SentenceOutput(sink, period), 1.0),
    "json": Format(lambda sink, _, every_tick: JsonLines(sink, every_tick)),
    "propellers": Format(lambda sink, period, _: PropellerCommands(sink, period), PERIOD, commands_propellers=True),
}
