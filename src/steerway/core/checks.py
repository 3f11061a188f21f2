"""Checks of the numbers a user gives, in one sentence each."""

import math

from steerway.core.errors import InputError


def positive(place: str, value: float) -> float:
    """The value itself when it is a finite number above zero; InputError names the place otherwise."""
    if not (math.isfinite(value) and value > 0.0):
        raise InputError(f"{place} is {value:g}, expected a number above 0")
    return float(value)


def positive_or_unlimited(place: str, value: float) -> float:
    """The value itself when it is above zero, infinity included; InputError names the place otherwise."""
    return math.inf if value == math.inf else positive(place, value)


def not_negative(place: str, value: float) -> float:
    """The value itself when it is a finite number of at least zero; InputError names the place otherwise."""
    if not (math.isfinite(value) and value >= 0.0):
        raise InputError(f"{place} is {value:g}, expected a number of at least 0")
    return float(value)


def one_of(place: str, value: str, choices: tuple[str, ...]) -> str:
    """The value itself when it is among the choices; InputError names the place otherwise."""
    if value not in choices:
        raise InputError(f"{place} is {value!r}, expected one of {', '.join(choices)}")
    return value
