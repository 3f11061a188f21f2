"""One sentence for what is wrong in a file of settings: the key's path, the value, and what was expected."""

import difflib

from pydantic import BaseModel, ValidationError

from steerway.core.errors import InputError

Location = tuple[str | int, ...]
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
    path = _path(problem["loc"])
    kind = problem["type"]
    if kind == "extra_forbidden":
        return InputError(f"{place}: {path} is no key, expected {_keys(problem['loc'], model)}")
    if kind == "missing":
        return InputError(f"{place}: {path} is missing, expected {_what(problem['loc'], model)}")
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
    return InputError(f"{place}: {path} is {problem['input']!r}, {expected}")


def _path(location: Location) -> str:
    """`route.waypoints[2].north` from pydantic's location."""
    text = ""
    for part in location:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else str(part)
    return text


def _keys(location: Location, model: type[BaseModel]) -> str:
    """The keys there are beside the wrong one, the nearest first if it is near."""
    fields = _model_at(location[:-1], model).model_fields
    names = [field.alias or name for name, field in fields.items()]
    near = difflib.get_close_matches(str(location[-1]), names, 1, 0.6)
    return f"perhaps {near[0]}" if near else "one of " + ", ".join(names)


def _what(location: Location, model: type[BaseModel]) -> str:
    holder = _model_at(location[:-1], model)
    field = holder.model_fields.get(str(location[-1])) if holder else None
    return field.description if field is not None and field.description else "a value"


def _model_at(location: Location, model: type[BaseModel]) -> type[BaseModel]:
    """The model that holds a location's last key."""
    for part in location:
        if isinstance(part, int) or part not in model.model_fields:
            continue
        model = _first_model(model.model_fields[part].annotation) or model
    return model


def _first_model(annotation: object) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for inner in getattr(annotation, "__args__", ()):
        found = _first_model(inner)
        if found:
            return found
    return None
