"""The schema of files of settings: tables that refuse unknown keys, types of numbers, tables selected by their kind."""

import math
from typing import Annotated, Any, Union

from pydantic import AliasChoices, BaseModel, ConfigDict, Discriminator, Field, GetJsonSchemaHandler, Tag
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema

# Strict: a number in quotation marks is a text, and true is not 1.
Positive = Annotated[float, Field(strict=True, gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(strict=True, ge=0.0, allow_inf_nan=False)]
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Rate = Annotated[float, Field(strict=True, gt=0.0, le=1000.0)]
Latitude = Annotated[float, Field(strict=True, ge=-89.0, le=89.0, allow_inf_nan=False)]
Longitude = Annotated[float, Field(strict=True, ge=-180.0, le=180.0, allow_inf_nan=False)]
Flag = Annotated[bool, Field(strict=True)]
Triple = tuple[Number, Number, Number]


class Table(BaseModel):
    """A table of a file: frozen; an unknown key is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """The JSON Schema with every name of a key that has several."""
        found = handler(core)
        properties = handler.resolve_ref_schema(found).get("properties", {})
        for first, *others in map(names_of, cls.model_fields, cls.model_fields.values()):
            properties |= dict.fromkeys(others, properties.get(first))
        return found


def names_of(name: str, field: FieldInfo) -> list[str]:
    """The names of a key in a file, the usual one first."""
    choices = field.validation_alias
    return list(map(str, choices.choices)) if isinstance(choices, AliasChoices) else [field.alias or name]


def in_radians(table: Table) -> dict[str, Any]:
    """A table's values by name; keys that end in `_deg` lose the ending and their values become radians."""
    values = {}
    for name, value in table.model_dump().items():
        if name.endswith("_deg") and value is not None:
            value = math.radians(value)
        values[name.removesuffix("_deg")] = value
    return values


def kind_of(table: type[Table]) -> str:
    """The value of `kind` that selects a table."""
    return table.model_fields["kind"].default


def one_of_kinds(tables: tuple[type[Table], ...]) -> Any:
    """The type of a field that holds one of several tables, selected by its key `kind`; the first is the default."""
    default = kind_of(tables[0])

    def chosen(value: object) -> str:
        return value.get("kind", default) if isinstance(value, dict) else getattr(value, "kind", default)

    tagged = tuple(Annotated[table, Tag(kind_of(table))] for table in tables)
    # The members are known only at run time, so that they cannot be joined by |.
    return Annotated[Union[tagged], Discriminator(chosen)]  # noqa: UP007
