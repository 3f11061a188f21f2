"""What users meet: every command with its arguments and options, and the signatures of the public names."""

import importlib
import inspect
import json
import pkgutil
import re

import typer

import steerway
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


def signature(function):
    """Parameters and result, without the modules that types live in."""
    try:
        output = str(inspect.signature(function))
    except (TypeError, ValueError):
        return ""
    return re.sub(r"\bsteerway\.(\w+\.)*|0x[0-9a-f]+", "", output)


def described(name, thing):
    """Lines of a public name: what it is called with; of a class, its fields, properties and methods."""
    lines = [f"## {name}{signature(thing)}", (inspect.getdoc(thing) or "").partition("\n")[0]]
    if inspect.isclass(thing):
        members = {}
        for each in reversed(thing.__mro__):
            if each.__module__.startswith("steerway"):
                members |= dict.fromkeys(inspect.get_annotations(each), "field") | vars(each)
        for member, value in sorted(members.items()):
            if member.startswith("_") or member == "model_config":
                continue
            kind = "property" if isinstance(value, property) else "field"
            if isinstance(value, classmethod | staticmethod):
                kind = f"{type(value).__name__}{signature(value.__func__)}"
            elif inspect.isfunction(value):
                kind = f"method{signature(value)}"
            lines.append(f"- {member}: {kind}")
    return [*lines, ""]


def public(package):
    """Lines of the names that a package lists."""
    lines = [f"{package.__name__}: {' '.join(sorted(package.__all__))}", ""]
    for name in sorted(package.__all__):
        thing = getattr(package, name)
        if inspect.isclass(thing) or callable(thing):
            lines += described(name, thing)
    return lines


@case("interface_names", text=True)
def names():
    return "\n".join(public(steerway))


@case("interface_packages", text=True)
def packages():
    """The packages below `steerway`, by their own lists of names."""
    found = [each.name for each in pkgutil.walk_packages(steerway.__path__, "steerway.") if each.ispkg]
    modules = [importlib.import_module(name) for name in sorted(found)]
    return "\n".join(line for each in modules if hasattr(each, "__all__") for line in public(each))


@case("interface_schemas", text=True)
def schemas():
    return "\n".join(json.dumps(schema_of(kind), indent=1, ensure_ascii=False) for kind in KINDS)
