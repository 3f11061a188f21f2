"""One sentence for what is wrong in a file of settings: the key's path, the value, and what was expected."""

import difflib
from collections.abc import Iterator, Sequence

from pydantic import BaseModel, ValidationError

from steerway.core.errors import InputError
from steerway.core.schema import names_of

Location = Sequence[str | int]
_EXPECTED = {
    "greater_than": "expected more than {gt}",
    "greater_than_equal": "expected at least {ge}",
    "less_than": "expected less than {lt}",
    "less_than_equal": "expected at most {le}",
    "finite_number": "expected a finite number",
    "float_type": "expected a number",
    "float_parsing": "expected a number",
    "int_type": "expected a whole number",
    "int_parsing": "expected a whole number",
    "int_from_float": "expected a whole number",
    "bool_type": "expected true or false",
    "bool_parsing": "expected true or false",
    "string_type": "expected a text",
    "list_type": "expected a list",
    "tuple_type": "expected a list",
    "missing_argument": "expected one more number",
    "too_short": "expected at least {min_length} entries",
    "model_type": "expected a table of keys",
    "model_attributes_type": "expected a table of keys",
    "dict_type": "expected a table of keys",
}


def refusal(place: str, error: ValidationError, model: type[BaseModel]) -> InputError:
    """The first thing that is wrong, as an InputError. An unknown key counts as first: it is most often a slip."""
    problems = sorted(error.errors(), key=lambda each: each["type"] != "extra_forbidden")
    problem = problems[0]
    keys, holder, chosen = _located(problem["loc"], model)
    path = _path(keys)
    kind = problem["type"]
    if kind == "extra_forbidden":
        of_kind = f" for kind {chosen}" if chosen else ""
        return InputError(f"{place}: unknown key {path}{of_kind}, expected {_keys(keys[-1], holder)}")
    if kind == "missing":
        return InputError(f"{place}: {path} is missing, expected {_what(keys[-1], holder)}")
    if kind == "value_error":
        return InputError(f"{place}: {problem['msg'].removeprefix('Value error, ')}")
    if kind == "literal_error":
        expected = "expected one of " + problem["ctx"]["expected"].replace("'", "").replace(" or ", ", ")
    elif kind == "union_tag_invalid":
        path = f"{path}.kind"
        problem["input"] = problem["input"].get("kind")
        expected = "expected one of " + problem["ctx"]["expected_tags"].replace("'", "")
    elif kind == "union_tag_not_found":
        return InputError(f"{place}: {path}.kind is missing, expected the kind of {path}")
    else:
        form = _EXPECTED.get(kind)
        expected = form.format(**problem.get("ctx", {})) if form else problem["msg"][0].lower() + problem["msg"][1:]
        if problem.get("ctx"):
            expected += _unit(keys[-1], holder)
    return InputError(f"{place}: {path} is {problem['input']!r}, {expected}")


def _unit(key: str | int, holder: type[BaseModel]) -> str:
    field = holder.model_fields.get(str(key))
    extra = field.json_schema_extra if field is not None else None
    return f" {extra['unit']}" if isinstance(extra, dict) and extra.get("unit") else ""


def _path(location: Location) -> str:
    """`route.waypoints[2].north` from pydantic's location."""
    text = ""
    for part in location:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else str(part)
    return text


def _keys(wrong: str | int, holder: type[BaseModel]) -> str:
    """The keys there are in place of the wrong one, the nearest alone if it is near."""
    names = [each for name, field in holder.model_fields.items() for each in names_of(name, field)]
    near = difflib.get_close_matches(str(wrong), names, 1, 0.6)
    return f"perhaps {near[0]}" if near else "one of " + ", ".join(names)


def _what(key: str | int, holder: type[BaseModel]) -> str:
    field = holder.model_fields.get(str(key))
    return field.description if field is not None and field.description else "a value"


def _located(location: Location, model: type[BaseModel]) -> tuple[list[str | int], type[BaseModel], str | int | None]:
    """The keys of pydantic's location, the model that holds the last of them, and the kind that selected this model.

    Where a field holds one of several models, the location has the kind as one more part.
    """
    keys: list[str | int] = []
    holder, options = model, [model]
    chosen: str | int | None = None
    for part in location:
        of_kind = [
            each for each in options if "kind" in each.model_fields and each.model_fields["kind"].default == part
        ]
        if len(options) > 1 and of_kind:
            options, chosen = of_kind, part
            continue
        keys.append(part)
        if isinstance(part, int) or not options:
            continue
        holder = options[0]
        field = holder.model_fields.get(part)
        if field is not None:
            options = list(_models(field.annotation)) or options
            chosen = None
    return keys, holder, chosen


def _models(annotation: object) -> Iterator[type[BaseModel]]:
    """The models in a type, however deep."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in getattr(annotation, "__args__", ()):
        yield from _models(inner)
