"""Checks of numbers and arrays that a user gives; each failure is one sentence."""

import math

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.arrays import Floats
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


def elapsed(place: str, value: float) -> float:
    """The value, or 0 if negative, as after a clock was set back; InputError names the place if it is not finite."""
    return not_negative(place, 0.0 if value < 0.0 and math.isfinite(value) else value)


def one_of(place: str, value: str, choices: tuple[str, ...]) -> str:
    """The value itself when it is among the choices; InputError names the place otherwise."""
    if value not in choices:
        raise InputError(f"{place} is {value!r}, expected one of {', '.join(choices)}")
    return value


def array_of(place: str, values: ArrayLike, shape: tuple[int | None, ...]) -> Floats:
    """The values as an array of floats, contiguous; a None in `shape` allows any length. InputError names the place."""
    try:
        array = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as problem:
        raise InputError(f"{place} is not an array of numbers, expected one of shape {_text(shape)}") from problem
    shape_given = np.shape(values)
    if len(shape_given) != len(shape) or any(
        n not in (None, given) for n, given in zip(shape, shape_given, strict=True)
    ):
        raise InputError(f"{place} has shape {_text(shape_given)}, expected {_text(shape)}")
    return array


def _text(shape: tuple[int | None, ...]) -> str:
    """As Python writes a shape, with n for any length."""
    sizes = ["n" if size is None else str(size) for size in shape]
    return f"({', '.join(sizes)}{',' if len(sizes) == 1 else ''})"
