"""Check that a Parquet file declares no more than it can hold, in its footer and the headers of its pages.

A decoder that uses a corrupted count can request 2⁶¹ bytes, which ends the process without an exception. Footer and
headers are in Thrift's compact protocol (thrift-compact-protocol.md of Apache Thrift; parquet.thrift of Apache Parquet
defines the field numbers used here).
"""

from typing import Any

from steerway.core.errors import InputError

_MAGIC = b"PAR1"
_DEEPEST = 16
_TRUE, _FALSE, _BYTE, _DOUBLE, _BINARY, _LIST, _SET, _STRUCT = 1, 2, 3, 7, 8, 9, 10, 12
_ROW_GROUPS, _COLUMNS, _META_DATA = 4, 1, 3
_COMPRESSED, _DATA_PAGE, _DICTIONARY_PAGE = 7, 9, 11  # of a column
_PAGE_SIZE, _PAGE_HEADERS = 3, (5, 7, 8)  # of a page; each of these headers begins with the number of values


def check(data: bytes) -> None:
    """Raises InputError if the structure of the file is damaged."""
    size = int.from_bytes(data[-8:-4], "little")
    if len(data) < 12 or data[-4:] != _MAGIC or not 0 < size <= len(data) - 12:
        raise InputError("the Parquet file is damaged: it does not end in a footer")
    try:
        footer, _ = _struct(data, len(data) - 8 - size, len(data) - 8, 0)
        for group in footer[_ROW_GROUPS]:
            for column in group[_COLUMNS]:
                _check_pages(data, column[_META_DATA])
    except (IndexError, KeyError, TypeError):
        raise InputError("the Parquet file is damaged: it declares more than it holds") from None


Struct = dict[int, Any]
"""A Thrift structure: values by field number."""


def _check_pages(data: bytes, column: Struct) -> None:
    at = min(column[_DATA_PAGE], column.get(_DICTIONARY_PAGE) or column[_DATA_PAGE])
    stop = at + column[_COMPRESSED]
    if not 0 <= at <= stop <= len(data):
        raise IndexError
    while at < stop:
        page, at = _struct(data, at, stop, 0)
        for kind in _PAGE_HEADERS:
            if kind in page and page[kind][1] < 0:
                raise IndexError
        if page[_PAGE_SIZE] < 0:
            raise IndexError
        at += page[_PAGE_SIZE]


def _varint(data: bytes, at: int, stop: int) -> tuple[int, int]:
    """(value, index after it)."""
    value = shift = 0
    while at < stop and shift < 64:
        value |= (data[at] & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if data[at - 1] < 0x80:
            return value, at
    raise IndexError


def _struct(data: bytes, at: int, stop: int, depth: int) -> tuple[Struct, int]:
    """(values by field number, index after the structure)."""
    if depth > _DEEPEST:
        raise IndexError
    fields: Struct = {}
    number = 0
    while at < stop:
        kind, step = data[at] & 0x0F, data[at] >> 4
        at += 1
        if kind == 0:
            return fields, at
        if step:
            number += step
        else:
            coded, at = _varint(data, at, stop)
            number = _signed(coded)
        if kind in (_TRUE, _FALSE):  # the type is the value
            fields[number] = kind == _TRUE
        else:
            fields[number], at = _value(data, at, stop, kind, depth)
    raise IndexError


def _value(data: bytes, at: int, stop: int, kind: int, depth: int) -> tuple[Any, int]:
    if kind in (_TRUE, _FALSE, _BYTE, _DOUBLE):
        return None, at + (8 if kind == _DOUBLE else 1)
    if kind == _STRUCT:
        return _struct(data, at, stop, depth + 1)
    if kind == _BINARY:
        length, at = _varint(data, at, stop)
        return None, at + length
    if kind in (_LIST, _SET) and at < stop:
        inner, length = data[at] & 0x0F, data[at] >> 4
        at += 1
        if length == 15:
            length, at = _varint(data, at, stop)
        if length > stop - at:
            raise IndexError
        values = []
        for _ in range(length):
            value, at = _value(data, at, stop, inner, depth + 1)
            values.append(value)
        return values, at
    if not _BYTE < kind < _DOUBLE:
        raise IndexError  # Parquet has no maps
    coded, at = _varint(data, at, stop)
    return _signed(coded), at


def _signed(coded: int) -> int:
    """The signed integer of a zigzag code."""
    return coded >> 1 if coded % 2 == 0 else -(coded >> 1) - 1
