"""Numbers of a profile: their units, what they are, and limits for every user."""

from typing import Any

from pydantic import Field


def positive_number(
    default: float | None = None,
    *,
    unit: str = "",
    what: str = "",
    most: float = 1e6,
    or_zero: bool = False,
) -> Any:
    """A finite number above zero, or `or_zero`, up to `most`; without a default it is required.

    unit, what: its unit and what it is.
    """
    limit: dict[str, Any] = {"ge": 0.0} if or_zero else {"gt": 0.0}
    extra: dict[str, Any] = {"unit": unit}
    given: dict[str, Any] = {} if default is None else {"default": default}
    return Field(
        **given, **limit, le=most, allow_inf_nan=False, strict=True, description=what or None, json_schema_extra=extra
    )
