"""What users meet: every command with its arguments and options, and the schemas of the files that they write."""

import inspect
import json

import typer

from steerway.commands.testing import KINDS, app, schema_of
from tests.reference_outputs.tables import case


def commands(command, name):
    """Lines of a command and of those below it."""
    lines = [f"## {name}", inspect.cleandoc(command.help or "")]
    for each in command.params:
        names = " ".join([*each.opts, *each.secondary_opts])
        lines.append(f"- {names} | {getattr(each, 'metavar', None)} | {getattr(each, 'help', None)}")
        lines.append(f"  {type(each).__name__} default {each.default!r} required {each.required}")
    lines.append("")
    for below, of_below in getattr(command, "commands", {}).items():
        lines += commands(of_below, f"{name} {below}")
    return lines


@case("interface_commands", text=True)
def command_line():
    return "\n".join(commands(typer.main.get_command(app), "steerway"))


@case("interface_schemas", text=True)
def schemas():
    return "\n".join(json.dumps(schema_of(kind), indent=1, ensure_ascii=False) for kind in KINDS)
