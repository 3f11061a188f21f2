"""Fields of the NMEA 2000 messages that are read, from logs or live. Source: the canboat PGN database."""

import math
import struct
from datetime import date, time
from functools import cached_property
from typing import Any, NamedTuple

TRUE, MAGNETIC = 0, 1
"""Codes of the reference of an angle."""
_DEGREE = math.degrees(1.0)
LARGEST = {"H": 0xFFFF, "h": 0x7FFF, "I": 0xFFFFFFFF, "i": 0x7FFFFFFF, "q": 0x7FFFFFFFFFFFFFFF}
"""Largest number of a `struct` format."""
METHODS = (
    "no GNSS", "GNSS fix", "DGNSS fix", "Precise GNSS", "RTK Fixed Integer", "RTK float", "Estimated (DR) mode",
    "Manual Input", "Simulate mode",
)  # fmt: skip


class Field(NamedTuple):
    """A field of a message: its name, and its label in canboat's JSON.

    unit: SI value of one bit. in_json: factor from SI to the unit in JSON. A field with `words` is a code instead, in
    the bits of its byte from `shift` on; the words are its values in JSON.
    """

    name: str
    label: str
    unit: float = 0.0
    in_json: float = 1.0
    words: tuple[str, ...] = ()
    shift: int = 0


class Message:
    """A message: its title, the layout of its bytes (a `struct` format), and its fields in order."""

    def __init__(self, title: str, layout: str, *fields: Field):
        self.title, self.fields = title, fields
        self._layout = struct.Struct(layout)
        self.length = self._layout.size

    def raw(self, payload: bytes) -> tuple[int, ...]:
        """The raw field values in a payload of at least `length` bytes."""
        return self._layout.unpack_from(payload)

    def raw_of_json(self, values: dict[str, Any], in_radians: bool) -> tuple[int, ...]:
        """The raw field values of a message decoded in JSON; a missing field gets its largest value (not available)."""
        return tuple(_raw(field, most, values.get(field.label), in_radians) for field, most in self._ranges)

    def values(self, raw: tuple[int, ...]) -> dict[str, float]:
        """SI values by name; NaN for the three largest raw values (not available, out of range, reserved)."""
        return {
            field.name: number >> field.shift if field.words else math.nan if number > most - 3 else number * field.unit
            for (field, most), number in zip(self._ranges, raw, strict=True)
        }

    @cached_property
    def _ranges(self) -> tuple[tuple[Field, int], ...]:
        kinds = [each for each in self._layout.format if each in "BHhIiq"]
        return tuple((field, LARGEST.get(kind, 0xFF)) for field, kind in zip(self.fields, kinds, strict=True))


def _raw(field: Field, most: int, value: object, in_radians: bool) -> int:
    if isinstance(value, dict):
        value = value.get("value")
    if field.words:
        number = field.words.index(value) if value in field.words else value
        return number << field.shift & 0xFF if isinstance(number, int) else 0xFF
    if isinstance(value, str):
        value = _seconds(value)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return most
    size = field.unit * (1.0 if in_radians and field.in_json == _DEGREE else field.in_json)
    return min(round(value / size), most)


def _seconds(text: str) -> float:
    """Seconds since 1970 of a date such as 2021.10.13, or since midnight of a time such as 09:00:38.5; else NaN."""
    try:
        if ":" in text:
            moment = time.fromisoformat(text)
            return 3600.0 * moment.hour + 60.0 * moment.minute + moment.second + 1e-6 * moment.microsecond
        return 86400.0 * (date.fromisoformat(text.replace(".", "-")) - date(1970, 1, 1)).days
    except ValueError:
        return math.nan


def _angle(name: str, label: str) -> Field:
    return Field(name, label, 1e-4, _DEGREE)


def _reference(label: str) -> Field:
    return Field("reference", label, words=("True", "Magnetic"))


MESSAGES = {
    126992: Message("system time", "<xxHI", Field("days", "Date", 86400.0), Field("clock", "Time", 1e-4)),
    127250: Message(
        "heading",
        "<xHhhB",
        _angle("heading", "Heading"),
        _angle("deviation", "Deviation"),
        _angle("variation", "Variation"),
        _reference("Reference"),
    ),
    127251: Message("rate of turn", "<xi", Field("yaw_rate", "Rate", 3.125e-8, _DEGREE)),
    127258: Message("magnetic variation", "<xxxxh", _angle("variation", "Variation")),
    127488: Message("engine speed", "<xH", Field("shaft", "Speed", 0.25 / 60.0, 60.0)),
    128259: Message("water speed", "<xH", Field("water_speed", "Speed Water Referenced", 0.01)),
    129025: Message("position", "<ii", Field("latitude", "Latitude", 1e-7), Field("longitude", "Longitude", 1e-7)),
    129026: Message(
        "SOG and COG", "<xBHH", _reference("COG Reference"), _angle("cog", "COG"), Field("sog", "SOG", 0.01)
    ),
    129029: Message(
        "GNSS position",
        "<xHIqq8xBxxh",
        Field("days", "Date", 86400.0),
        Field("clock", "Time", 1e-4),
        Field("latitude", "Latitude", 1e-16),
        Field("longitude", "Longitude", 1e-16),
        Field("method", "Method", words=METHODS, shift=4),
        Field("hdop", "HDOP", 0.01),
    ),
}
"""Messages that are read, by PGN."""
ANGLES = ("COG", "Heading")
"""Fields in JSON whose values show whether the angles of the log are in degrees or radians."""
