"""The reference pages, generated: public names, commands, keys of files, columns of tables, equations of the papers."""

import inspect
import json
import re
from importlib import import_module
from pathlib import Path

from docs.papers import paper_pages

from steerway.core.testing import Table, description_of, unit_of

MODULES = (
    "steerway",
    *(
        f"steerway.{name}"
        for name in ("estimation", "simulation", "vessels", "sensors", "guidance", "control", "pilot")
    ),
    *(f"steerway.{name}" for name in ("identification", "archive", "report", "core")),
    *(f"steerway.estimation.{name}" for name in ("heading", "speed", "steering", "positioning")),
    "steerway_studies.papers",
)


def write(folder: Path) -> None:
    """All reference pages."""
    folder.mkdir(parents=True, exist_ok=True)
    pages = {"commands": commands(), "columns": columns()} | paper_pages()
    pages |= {kind: keys(kind) for kind in ("scenario", "profile", "settings", "mission")}
    pages |= {f"python-{name.replace('.', '-')}": module(name) for name in MODULES}
    for name, text in pages.items():
        (folder / f"{name}.md").write_text(text, encoding="utf-8")
    listed = "\n".join(f"- [`{name}`](python-{name.replace('.', '-')}.md): {_lead(name)}" for name in MODULES)
    text = f"# Python\n\nNames in `__all__` of these packages are public. Everything is SI and radians.\n\n{listed}\n"
    (folder / "python.md").write_text(text, encoding="utf-8")


def write_schemas(folder: Path) -> None:
    """The JSON Schemas of files."""
    from steerway.commands.testing import KINDS, schema_of

    folder.mkdir(parents=True, exist_ok=True)
    for kind in KINDS:
        text = json.dumps(schema_of(kind), ensure_ascii=False, indent=1)
        (folder / f"{kind}.json").write_text(text, encoding="utf-8")


def _lead(name):
    return inspect.getdoc(import_module(name)).split("\n\n")[0].replace("\n", " ")


# Python


def module(name: str) -> str:
    """The public names of a module."""
    found = import_module(name)
    parts = [f"# {name}\n", _text(found.__doc__)]
    parts += [_name(each, getattr(found, each)) for each in sorted(found.__all__, key=str.lower)]
    return "\n\n".join(parts) + "\n"


def _name(name, value):
    value = getattr(value, "py_func", value)
    if inspect.isclass(value) and issubclass(value, Table):
        parts = [f"## {name}", _text(inspect.getdoc(value)), _fields(value), *_members(value)]
        return "\n\n".join(parts)
    if inspect.isclass(value):
        return "\n\n".join([f"## {name}", _signature(name, value), _text(inspect.getdoc(value)), *_members(value)])
    if inspect.isroutine(value):
        return "\n\n".join([f"## {name}", _signature(name, value), _text(inspect.getdoc(value))])
    return f"## {name}\n\n```text\n{_shortened(value)}\n```"


def _fields(table):
    """The keyword arguments of a table: default, unit, what each means."""
    rows = ["| argument | default | unit | |", "|---|---|---|---|"]
    for key, field in table.model_fields.items():
        default = "required" if field.is_required() else f"`{_shortened(field.get_default(call_default_factory=True))}`"
        rows.append(f"| `{key}` | {_cell(default)} | {unit_of(key, field)} | {_escaped(description_of(table, key))} |")
    return "\n".join(rows)


def _members(kind):
    for name, member in vars(kind).items():
        function = getattr(member, "fget", None) or getattr(member, "__func__", member)
        if name.startswith("_") or not inspect.isfunction(function) or not function.__module__.startswith("steerway"):
            continue
        if isinstance(member, property):
            yield f"### {kind.__name__}.{name}\n\n{_text(inspect.getdoc(function))}"
        else:
            yield f"### {kind.__name__}.{name}\n\n{_signature(name, function)}\n\n{_text(inspect.getdoc(function))}"


def _signature(name, value):
    try:
        signature = str(inspect.signature(value))
    except (TypeError, ValueError):
        return ""
    signature = re.sub(r"<(?:function|object|built-in)[^>]*>", "…", signature)
    if len(name) + len(signature) > 100:
        inner, _, returned = signature.rpartition(")")
        inner = re.sub(r",\s(?=[*\w]+(?::|=|,|$))", ",\n    ", inner[1:])
        signature = f"(\n    {inner},\n){returned}"
    return f"```python\n{name}{signature}\n```"


def _shortened(value):
    text = repr(value)
    return text if len(text) < 400 else f"{text[:400]} …"


def _text(doc: str | None) -> str:
    """A docstring as Markdown: lists of arguments become lists."""
    lines, out, listed = (doc or "").splitlines(), [], False
    for line in lines:
        if re.fullmatch(r"(Args|Returns|Raises|Parameters):", line.strip()):
            out += ["", f"**{line.strip()[:-1]}**", ""]
            listed = True
        elif listed and (found := re.match(r"    ([\w, ]+): (.*)", line)):
            out.append(f"- `{found[1]}`: {_escaped(found[2])}")
        elif listed and line.startswith("     "):
            out[-1] += " " + _escaped(line.strip())
        else:
            listed = listed and line.startswith("    ")
            out.append(line if line.startswith("    ") else _escaped(line))
    return "\n".join(out)


def _escaped(text):
    """Text with the signs of Markdown escaped, except in code."""
    parts = text.split("`")
    parts[::2] = [re.sub(r"([*_<\[\]])", r"\\\1", part) for part in parts[::2]]
    return "`".join(parts)


# Commands


def commands() -> str:
    """The commands with their options."""
    import typer

    from steerway.commands.testing import command_tree

    parts = ["# Commands\n\n`steerway --install-completion` makes the shell complete commands and options."]

    def walk(command, path):
        for name, inner in command.commands.items():
            if hasattr(inner, "commands"):
                walk(inner, (*path, name))
            else:
                parts.append(_command(inner, (*path, name), typer.Context(inner)))

    walk(command_tree(), ())
    return "\n\n".join(parts) + "\n"


def _command(command, path, context):
    text = inspect.cleandoc(command.help or "")
    text = re.sub(r"\n\n(?=    steerway)", "\n\n", text)
    rows = []
    for each in command.get_params(context):
        if getattr(each, "hidden", False) or "--help" in each.opts:
            continue
        argument = each.param_type_name == "argument"
        names = f"`{each.metavar or each.name}`" if argument else ", ".join(f"`{name}`" for name in each.opts)
        value = "" if argument or not each.metavar else f"`{each.metavar}`"
        rows.append(f"| {names} | {value} | {_cell(each.help or '')} |")
    table = "\n".join(["| option | value | |", "|---|---|---|", *rows]) if rows else ""
    return f"## steerway {' '.join(path)}\n\n{text}\n\n{table}"


def _cell(text):
    return str(text).replace("|", "\\|").replace("\n", " ")


# Keys


_TITLES = {
    "scenario": "Keys of a scenario",
    "profile": "Keys of a profile",
    "settings": "Keys of settings",
    "mission": "Keys of a mission",
}


def keys(kind: str) -> str:
    """The keys of a kind of file, from its schema."""
    from steerway.commands.testing import schema_of

    schema = schema_of(kind)
    tables = {"": schema, **schema.get("$defs", {})}
    used = _places(schema)
    parts = [
        f"# {_TITLES[kind]}\n\nThe file is TOML. `steerway schema {kind} -o {kind}.json` writes its "
        f"[JSON Schema](../schemas/{kind}.json), with which editors complete and check the keys.",
    ]
    for name, table in tables.items():
        if not table.get("properties"):
            continue
        title = f"[{used[name]}]" if used.get(name) else "At the top" if not name else name
        of_kind = table["properties"].get("kind", {}).get("const")
        parts.append(f"## {title}{f' of kind {of_kind}' if of_kind else ''}".replace("[", "\\["))
        parts.append(_text(table.get("description")))
        rows = [_key(key, value, table) for key, value in table["properties"].items()]
        parts.append("\n".join(["| key | type | unit | default | limits | |", "|---|---|---|---|---|---|", *rows]))
    return "\n\n".join(parts) + "\n"


def _places(schema):
    """Table → its path of keys."""
    found = {}

    def walk(table, path):
        for key, value in table.get("properties", {}).items():
            for name in re.findall(r'"#/\$defs/(\w+)"', json.dumps(value)):
                if name not in found:
                    found[name] = f"{path}{key}"
                    walk(schema["$defs"][name], f"{path}{key}.")

    walk(schema, "")
    return found


def _key(key, value, table):
    options = [each for each in (value, *value.get("anyOf", ()), *value.get("oneOf", ())) if each.get("type") != "null"]
    types = [_type(each) for each in options]
    limits = [f"{sign} {each[name]:g}" for each in options for name, sign in _LIMITS.items() if name in each]
    lists = [each for each in options if each.get("minItems") and "prefixItems" not in each]
    limits += [f"at least {each['minItems']} entries" for each in lists]
    default = json.dumps(value["default"], ensure_ascii=False) if "default" in value else "required"
    if len(default) > 60 or default == "null" or default.startswith("{"):
        default = "see there" if default.startswith("{") else "–" if default == "null" else default[:57] + "…"
    kind = ", ".join(dict.fromkeys(each for each in types if each))
    unit = value.get("unit", "")
    what = _escaped(value.get("description", ""))
    return (
        f"| `{key}` | {_cell(kind)} | {unit} | {_cell(default)} | {', '.join(dict.fromkeys(limits))} | {_cell(what)} |"
    )


_LIMITS = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
_TYPES = {"number": "number", "integer": "whole number", "string": "text", "boolean": "true or false", "array": "list"}


def _type(schema):
    if "enum" in schema:
        return ", ".join(f"`{each}`" for each in schema["enum"])
    if "const" in schema:
        return f"`{schema['const']}`"
    if "$ref" in schema:
        return "table"
    return _TYPES.get(schema.get("type"), "")


# Columns


def columns() -> str:
    """The columns of the tables that commands write."""
    from steerway.core.testing import MOTION_COLUMNS, STATUSES
    from steerway.simulation.testing import NAMES

    rows = [f"| `{name}` | {_unit(name)} | {_MOTION[name]} |" for name in ("mmsi", *MOTION_COLUMNS)]
    rows.append(f"| `status` | | {', '.join(f'`{each}`' for each in STATUSES)} |")
    run = [f"| `{outward}` | {_unit(outward)} | {name.replace('_', ' ')} |" for name, (outward, _) in NAMES.items()]
    return (
        "# Columns of tables\n\nNames end in their unit. Unknown is empty (CSV) or null (Parquet).\n\n"
        "## Results of `estimate`\n\n| column | unit | |\n|---|---|---|\n" + "\n".join(rows) + "\n\n"
        "`ok`: a fix was used; `predicted`: no fix at this time; `rejected`: the fix was not used; `no_course`: no "
        "steerageway; `starting`: the first fixes; `lost`: in `live` only, no fix for too long.\n\n"
        "## Runs of `simulate`\n\nA run also has `time_s` (Unix), `elapsed_s`, "
        "`true_sog_mps`, `true_cog_deg`, `true_crab_angle_deg`, positions in "
        "degrees, and a column for each actuator.\n\n| column | unit | |\n|---|---|---|\n" + "\n".join(run) + "\n"
    )


_MOTION = {
    "mmsi": "MMSI of the vessel; only in tables of several vessels",
    "time_s": "Unix time, UTC",
    "lat_deg": "latitude, + north, WGS-84",
    "lon_deg": "longitude, + east, −180 to 180",
    "sog_mps": "speed over ground of the antenna, or of the hull if the summary says that the antenna rolls",
    "cog_deg": "course over ground, clockwise from true north, 0 to 360; empty without steerageway",
    "course_rate_dps": "rate of the course, + to starboard",
    "sog_std_mps": "1σ of SOG",
    "cog_std_deg": "1σ of COG",
    "course_rate_std_dps": "1σ of the course rate",
    "position_std_m": "1σ of the position per axis, √((σ_N² + σ_E²)/2), including the receiver's slow error",
    "position_relative_std_m": "the same without the slow error, which positions cannot show",
    "nis": "normalised innovation squared of the fix, 2 on average",
}


_UNITS = {"dps2": "°/s²", "n": "N", "nm": "N·m", "radps": "rad/s"}


def _unit(name):
    if "_" not in name:
        return ""
    end = name.rsplit("_", 1)[1]
    return _UNITS.get(end) or unit_of(f"x_{end}")
