"""TOML files of settings: tables that refuse unknown keys, and errors of one sentence."""

import ast
import difflib
import inspect
import json
import textwrap
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, Self, Union

from pydantic import (
    AliasChoices,
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    GetJsonSchemaHandler,
    Tag,
    ValidationError,
)
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema

from steerway.core.errors import InputError

# Strict: a number in quotation marks is a text, and true is not 1. A string in the annotation of a field is its unit.
Positive = Annotated[float, Field(strict=True, gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(strict=True, ge=0.0, allow_inf_nan=False)]
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Rate = Annotated[float, Field(strict=True, gt=0.0, le=1000.0)]
Latitude = Annotated[float, Field(strict=True, ge=-89.0, le=89.0, allow_inf_nan=False)]
Longitude = Annotated[float, Field(strict=True, ge=-180.0, le=180.0, allow_inf_nan=False)]
Flag = Annotated[bool, Field(strict=True)]
Triple = tuple[Number, Number, Number]


class Table(BaseModel):
    """A table of a file: frozen. Raises InputError for an unknown key and for a value that its key does not take."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    if not TYPE_CHECKING:  # type checkers know the keys

        def __init__(self, **keys: Any) -> None:
            try:
                super().__init__(**keys)
            except ValidationError as error:
                raise refusal(type(self).__name__, error, type(self)) from None

        __init__.__pydantic_base_init__ = True  # a table within a table is checked with it

    @classmethod
    def made_of(cls, keys: Mapping[str, Any], place: str) -> Self:
        """The table with these keys; `place` names it in errors. Raises InputError naming the key that is wrong."""
        try:
            return cls.model_validate(keys)
        except ValidationError as error:
            raise refusal(place, error, cls) from None

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """The JSON Schema; a key with several names is listed under each."""
        found = handler(core)
        properties = handler.resolve_ref_schema(found).get("properties", {})
        for first, *others in map(names_of, cls.model_fields, cls.model_fields.values()):
            properties |= dict.fromkeys(others, properties.get(first))
        return found


def names_of(name: str, field: FieldInfo) -> list[str]:
    """The names of a key in a file, the usual one first."""
    choices = field.validation_alias
    return list(map(str, choices.choices)) if isinstance(choices, AliasChoices) else [field.alias or name]


def description_of(model: type[BaseModel], key: str) -> str:
    """One sentence about a key: the text below its field in the source; "" without one."""
    text = model.model_fields[key].description or _texts(model).get(key, "")
    return text and f"{text[0].upper()}{text[1:].rstrip('.')}."


@cache
def _texts(model: type[BaseModel]) -> dict[str, str]:
    """Key → the text below its field. Reading the source at import would take a tenth of the start."""
    found: dict[str, str] = {}
    for kind in (each for each in reversed(model.__mro__) if issubclass(each, Table) and each is not Table):
        with suppress(OSError, TypeError):  # a model without a file, or made by a function, has no source
            body = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0]
            for field, text in pairwise(body.body if isinstance(body, ast.ClassDef) else []):
                if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr):
                    found[ast.unparse(field.target)] = inspect.cleandoc(ast.literal_eval(text.value)).replace("\n", " ")
    return found


class Option(NamedTuple):
    """In the annotation of a field: the key is also an option of the command line.

    metavar: the word for its value in the help; None for a flag. name, help: replace the key's name and description.
    """

    metavar: str | None = None
    name: str = ""
    help: str = ""


_BY_ENDING = {"deg": "°", "dps": "°/s", "mps": "m/s", "m": "m", "s": "s", "hour": "°/h"}


def unit_of(key: str, field: FieldInfo | None = None) -> str:
    """The unit of a number: stated by its field, else given by the ending of its key; "" if neither gives one."""
    stated: list[Any] = []
    if field is not None:
        stated = [each for each in field.metadata if isinstance(each, str)]
        if isinstance(extra := field.json_schema_extra, dict):
            stated.append(extra.get("unit"))
    ending = _BY_ENDING.get(key.rpartition("_")[2], "") if "_" in key else ""
    return next(filter(None, stated), ending)


def all_models(model: type[BaseModel]) -> set[type[BaseModel]]:
    """A model and all models nested in its fields."""
    found: set[type[BaseModel]] = set()
    waiting = [model]
    while waiting:
        found.add(each := waiting.pop())
        inner = (inner for field in each.model_fields.values() for inner in _models(field.annotation))
        waiting += [other for other in inner if other not in found]
    return found


def kind_of(table: type[Table]) -> str:
    """The value of `kind` that selects a table."""
    return table.model_fields["kind"].default


def union_by_kind(tables: tuple[type[Table], ...]) -> Any:
    """The type of a field that holds one of several tables, selected by its key `kind`; the first is the default."""
    default = kind_of(tables[0])

    def chosen(value: object) -> str:
        return value.get("kind", default) if isinstance(value, dict) else getattr(value, "kind", default)

    tagged = tuple(Annotated[table, Tag(kind_of(table))] for table in tables)
    # The members are known only at run time, so that they cannot be joined by |.
    return Annotated[Union[tagged], Discriminator(chosen)]  # noqa: UP007


def positive_number(
    default: float | None = None,
    *,
    unit: str = "",
    what: str = "",
    most: float = 1e6,
    or_zero: bool = False,
) -> Any:
    """A finite number, above 0 (with `or_zero`: at least 0) and at most `most`; required if it has no default.

    unit, what: its unit and meaning, for the schema and error messages.
    """
    limit: dict[str, Any] = {"ge": 0.0} if or_zero else {"gt": 0.0}
    extra: dict[str, Any] = {"unit": unit}
    given: dict[str, Any] = {} if default is None else {"default": default}
    return Field(
        **given, **limit, le=most, allow_inf_nan=False, strict=True, description=what or None, json_schema_extra=extra
    )


def read_toml(path: str | Path, what: str) -> dict[str, Any]:
    """The tables of a TOML file. Raises InputError; its message begins with `what` ("profile") and the path."""
    place = f"{what} {path}"
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{place} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    return parse_toml(text, place)


def parse_toml(text: str, place: str) -> dict[str, Any]:
    """The tables of a TOML text. Raises InputError; its message begins with `place`."""
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # a date out of range is a plain ValueError
        raise InputError(f"{place} is not valid TOML: {str(error).splitlines()[0]}") from None


def toml_value(value: float | Sequence[str] | Sequence[float]) -> str:
    """A number, a text or a list of them as TOML writes it."""
    return repr(float(value)) if isinstance(value, int | float) else json.dumps(value, ensure_ascii=False)


Location = Sequence[str | int]
_EXPECTED = {
    "greater_than": "expected more than {gt}",
    "greater_than_equal": "expected at least {ge}",
    "less_than": "expected less than {lt}",
    "less_than_equal": "expected at most {le}",
    "finite_number": "expected a finite number",
    "float_type": "expected a number",
    "float_parsing": "expected a number",
    "value_error": "{error}",
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
    """The first problem as an InputError. An unknown key comes first: it is most often a typing mistake."""
    problems = sorted(error.errors(), key=lambda each: each["type"] != "extra_forbidden")
    problem = problems[0]
    keys, holder, chosen = _located(problem["loc"], model)
    path = _path(keys)
    kind = problem["type"]
    if kind == "extra_forbidden":
        for name, field in holder.model_fields.items():
            if keys[-1] in (names := names_of(name, field)):
                return InputError(f"{place}: {path} is given twice, expected one of {' and '.join(names)}")
        of_kind = f" for kind {chosen}" if chosen else ""
        return InputError(f"{place}: unknown key {path}{of_kind}, expected {_keys(keys[-1], holder)}")
    if kind == "missing":
        return InputError(f"{place}: {path} is missing, expected {_what(keys[-1], holder)}")
    if kind == "value_error":
        return InputError(": ".join(filter(None, (place, path, expectation(problem)))))
    if kind == "literal_error":
        expected = "expected one of " + problem["ctx"]["expected"].replace("'", "").replace(" or ", ", ")
    elif kind == "union_tag_invalid":
        path = f"{path}.kind"
        problem["input"] = problem["input"].get("kind")
        expected = "expected one of " + problem["ctx"]["expected_tags"].replace("'", "")
    elif kind == "union_tag_not_found":
        return InputError(f"{place}: {path}.kind is missing, expected the kind of {path}")
    else:
        expected = expectation(problem)
        if problem.get("ctx"):
            key = str(keys[-1])
            expected = f"{expected} {unit_of(key, holder.model_fields.get(key))}".rstrip()
    return InputError(f"{place}: {path} is {problem['input']!r}, {expected}")


def expectation(problem: Mapping[str, Any]) -> str:
    """What was expected, from one of pydantic's errors."""
    form = _EXPECTED.get(problem["type"])
    return form.format(**problem.get("ctx", {})) if form else problem["msg"][0].lower() + problem["msg"][1:]


def _path(location: Location) -> str:
    """`route.waypoints[2].north` from pydantic's location."""
    text = ""
    for part in location:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else str(part)
    return text


def _keys(wrong: str | int, holder: type[BaseModel]) -> str:
    """The valid keys, for the error about a wrong one; only the similar key, if there is one."""
    names = [each for name, field in holder.model_fields.items() for each in names_of(name, field)]
    near = difflib.get_close_matches(str(wrong), names, 1, 0.6)
    return f"perhaps {near[0]}" if near else "one of " + ", ".join(names)


def _what(key: str | int, holder: type[BaseModel]) -> str:
    text = description_of(holder, str(key)).rstrip(".") if key in holder.model_fields else "a value"
    return text[:1].lower() + text[1:] if text[1:2].islower() else text


def _located(location: Location, model: type[BaseModel]) -> tuple[list[str | int], type[BaseModel], str | int | None]:
    """Of pydantic's location: the keys, the model that holds the last key, and the kind that selected this model.

    If a field holds one of several models, the location contains the kind as an additional part.
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
    """The models nested in a type."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in getattr(annotation, "__args__", ()):
        yield from _models(inner)
