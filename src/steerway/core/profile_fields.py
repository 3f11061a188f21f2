"""Numbers of a profile: limits for every user, and the range and prior of those that are fitted to a log."""

from typing import Any

from pydantic import Field
from pydantic.fields import FieldInfo


def positive_number(
    default: float | None = None,
    *,
    unit: str = "",
    what: str = "",
    most: float = 1e6,
    or_zero: bool = False,
    bounds: tuple[float, float] | None = None,
    prior: tuple[float, float] | None = None,
    words: tuple[str, str] | None = None,
) -> Any:
    """A finite number above zero, or `or_zero`, up to `most`; without a default it is required.

    Args:
        unit, what: its unit and what it is, where `words` does not give them.
        bounds: least and largest value that a fit tries.
        prior: median, and standard deviation of the logarithm, before a log is seen.
        words: what it is called in a report, and its unit.
    """
    limit: dict[str, Any] = {"ge": 0.0} if or_zero else {"gt": 0.0}
    what, unit = words or (what, unit)
    fitting: dict[str, Any] = {"bounds": bounds, "prior": prior, "words": words}
    extra = {"unit": unit} | {key: value for key, value in fitting.items() if value is not None}
    given: dict[str, Any] = {} if default is None else {"default": default}
    return Field(
        **given, **limit, le=most, allow_inf_nan=False, strict=True, description=what or None, json_schema_extra=extra
    )


def fitting_of(fields: dict[str, FieldInfo], what: str) -> dict[str, tuple[Any, ...]]:
    """`bounds`, `prior` or `words` of the fields that have them, by name."""
    extras = {name: field.json_schema_extra for name, field in fields.items()}
    found: dict[str, Any] = {name: each.get(what) for name, each in extras.items() if isinstance(each, dict)}
    return {name: value for name, value in found.items() if value is not None}
