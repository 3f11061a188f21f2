"""Results as text and back: JSON that contains data only, so that reading it executes none of its content.

A type that JSON lacks is an object with one key, the name of the type. Arrays are bytes in NumPy's format. A class (a
named tuple, a dataclass, or one with its values in `__dict__`) is stored by name and made without its constructor.
"""

import base64
import importlib
import io
import json
from collections.abc import Collection
from enum import Enum
from typing import Any

import numpy as np

_AS_THEY_ARE = (str, int, float, bool, type(None))
_SEQUENCES = {"tuple": tuple, "set": set, "frozenset": frozenset}


def packed(value: object) -> str:
    """A value as one line. Raises TypeError for a value that is not plain data."""
    return json.dumps(_node(value))


def unpacked(text: str, packages: set[str]) -> Any:
    """The value of a line; only classes of `packages` are allowed. Raises ValueError for a line without a value."""
    try:
        return _value(json.loads(text), packages)
    except (ArithmeticError, AttributeError, ImportError, LookupError, RecursionError, TypeError, OSError) as error:
        raise ValueError(f"is no result ({error})") from None


def _node(value: Any) -> Any:
    kind = type(value)
    if kind in _AS_THEY_ARE:
        return value
    if kind is list:
        return [_node(each) for each in value]
    if kind is dict:
        return {"dict": [[_node(key), _node(each)] for key, each in value.items()]}
    if kind in _SEQUENCES.values():
        return {kind.__name__: [_node(each) for each in value]}
    if kind is complex:
        return {"complex": [value.real, value.imag]}
    if kind is bytes:
        return {"bytes": base64.b64encode(value).decode()}
    if kind is np.ndarray or isinstance(value, np.generic):
        return {"array" if kind is np.ndarray else "scalar": _array_text(np.asarray(value))}
    return {"object": [kind.__module__, kind.__qualname__, _node(_content(value))]}


def _array_text(array: np.ndarray) -> str:
    if array.dtype.hasobject:
        raise TypeError("an array of objects is not plain data")
    file = io.BytesIO()
    np.lib.format.write_array(file, array)
    return base64.b64encode(file.getvalue()).decode()


def _content(value: Any) -> Any:
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return tuple(value)
    kind: Any = type(value)
    is_plain = kind.__reduce_ex__ is object.__reduce_ex__ and kind.__reduce__ is object.__reduce__
    if is_plain and kind.__module__ != "builtins" and hasattr(value, "__dict__"):
        return dict(vars(value))
    raise TypeError(f"{type(value).__qualname__} is not plain data")


def _value(node: Any, packages: Collection[str]) -> Any:
    if isinstance(node, list):
        return [_value(each, packages) for each in node]
    if not isinstance(node, dict):
        return node
    ((kind, content),) = node.items()
    if kind == "dict":
        return {_value(key, packages): _value(each, packages) for key, each in content}
    if kind in _SEQUENCES:
        return _SEQUENCES[kind](_value(each, packages) for each in content)
    if kind == "complex":
        return complex(*content)
    if kind == "bytes":
        return base64.b64decode(content, validate=True)
    if kind in ("array", "scalar"):
        array = np.lib.format.read_array(io.BytesIO(base64.b64decode(content, validate=True)))
        return array if kind == "array" else array[()]
    if kind == "object":
        module, name, held = content
        return _made(_class_of(module, name, packages), _value(held, packages))
    raise ValueError(f"{kind!r} is no kind of value")


def _class_of(module: str, name: str, packages: Collection[str]) -> type[Any]:
    """The class of this name, from its own module. A `__main__` module is refused: importing it runs it."""
    parts = module.split(".")
    if parts[0] not in packages or parts[-1] == "__main__" or not all(each.isidentifier() for each in parts):
        raise ValueError(f"{module}.{name} is in none of the allowed packages")
    found = importlib.import_module(module)
    for each in name.split("."):
        found = vars(found)[each]
    if not isinstance(found, type) or found.__module__ != module:
        raise ValueError(f"{module}.{name} is not a class defined in {module}")
    return found


def _made(kind: type[Any], held: Any) -> Any:
    if issubclass(kind, Enum):
        return kind(held)
    if issubclass(kind, tuple):
        fields: tuple[str, ...] = vars(kind)["_fields"]
        if len(held) != len(fields):
            raise ValueError(f"{kind.__qualname__} has {len(fields)} fields")
        return tuple.__new__(kind, held)
    made = object.__new__(kind)
    vars(made).update(held)
    return made
