"""The forms of output by name, for any sink. A new form is a file of its own and a row here."""

from collections.abc import Callable
from typing import NamedTuple

from steerway.live.links.link import Sink
from steerway.live.outputs.json_lines import JsonLines
from steerway.live.outputs.output import Output
from steerway.live.outputs.propellers import PERIOD, PropellerCommands
from steerway.live.outputs.sentences import SentenceOutput


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
