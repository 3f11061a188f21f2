"""The command that prints the JSON Schemas of the TOML files, with units: schema."""

import json
from importlib import import_module
from pathlib import Path
from typing import Any

from steerway.commands.terminal import argument, option
from steerway.core.errors import InputError
from steerway.core.settings import all_models, description_of, names_of, unit_of

_MODELS = {
    "scenario": ("steerway.simulation.scenario", "Scenario"),
    "profile": ("steerway.estimation.vessel.profile", "Profile"),
    "settings": ("steerway.live.settings", "Settings"),
    "mission": ("steerway.live.autopilot.mission", "MissionFile"),
}
KINDS = tuple(_MODELS)
_BY_KEY = {"kind": "Selects this kind."}  # in a table with a single kind


def schema_of(kind: str) -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of one of the `KINDS` of file. Numbers have a `unit`."""
    if kind not in KINDS:
        raise InputError(f"schema {kind!r} is unknown, expected one of {', '.join(KINDS)}")
    module, name = _MODELS[kind]
    model = getattr(import_module(module), name)
    found = model.model_json_schema(by_alias=True)
    models = {each.__name__: each for each in all_models(model)}
    for name, table in {model.__name__: found, **found.get("$defs", {})}.items():
        for field_name, field in models[name].model_fields.items():
            for key in names_of(field_name, field):
                value = table["properties"][key]
                if text := description_of(models[name], field_name) or _BY_KEY.get(key):
                    value["description"] = text
                if _is_number(value):
                    value.setdefault("unit", unit_of(key, field))
    return {"$schema": "https://json-schema.org/draft/2020-12/schema"} | found | {"title": f"Steerway {kind}"}


def _is_number(schema: dict[str, Any]) -> bool:
    text = json.dumps({key: value for key, value in schema.items() if key != "default"})
    return '"number"' in text or '"integer"' in text


def schema(
    kind: str = argument("KIND", f"The kind of file: {', '.join(KINDS)}."),
    out: Path | None = option("FILE", "Output file, .json.", None, "-o", "--out"),
) -> None:
    """Print the JSON Schema of scenarios, profiles, settings or missions. Editors complete and check keys with it.

    An editor with TOML support finds the schema if the first line of your file is: #:schema scenario.json

    Example:

        steerway schema scenario -o scenario.json
    """
    text = json.dumps(schema_of(kind), ensure_ascii=False, indent=2) + "\n"
    if out is None:
        print(text, end="")
        return
    from steerway.core.files import complete_or_absent

    with complete_or_absent(out) as file:
        file.write(text.encode())
    print(f"wrote {out}")
