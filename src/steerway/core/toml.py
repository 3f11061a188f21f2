"""TOML files and texts, with errors that name the file and what it was expected to be."""

import json
import tomllib
from pathlib import Path
from typing import Any

from steerway.core.errors import InputError


def read_toml(path: str | Path, what: str) -> dict[str, Any]:
    """The tables of a TOML file; `what` it is ("profile") stands before its name in errors. Raises InputError."""
    place = f"{what} {path}"
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{place} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    return parse_toml(text, place)


def parse_toml(text: str, place: str) -> dict[str, Any]:
    """The tables of a TOML text; `place` names it in errors. Raises InputError."""
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # a date out of range is a plain ValueError
        raise InputError(f"{place} is not valid TOML: {str(error).splitlines()[0]}") from None


def toml_value(value: str | float | list[str]) -> str:
    """A text, number or list of texts as TOML has it."""
    return repr(float(value)) if isinstance(value, int | float) else json.dumps(value, ensure_ascii=False)
