"""Two lookups that take two fifths of numba's time to compile, answered at once. What it compiles stays the same.

First estimate of a log with an empty cache: 49 s of processor time, 38 with the first, 31 with both.
"""

import functools
from typing import Any

import numba
from numba.core import targetconfig, types

_OF_VERSIONS = (0, 65), (0, 68)
"""Of which the insides are as they are read here."""
_Flags: Any = targetconfig.TargetConfig
_Function: Any = types.BaseFunction


def install() -> None:
    """Replace both in this process."""
    first, last = _OF_VERSIONS
    if first <= numba.version_info[:2] <= last and not hasattr(_Function.get_call_type, "__wrapped__"):
        _Flags.__eq__, _Flags.__hash__ = _are_equal, _hash
        _Function.get_call_type = _remembered(_Function.get_call_type)


def _are_equal(one: Any, other: Any) -> bool:
    """Whether two compilations have the same options: dicts, where numba reads each of thirty as a property.

    It compares them for every operator that it meets, with those of all kernels that it met it in.
    """
    if not isinstance(other, _Flags):
        return NotImplemented
    if one._values == other._values:
        return True
    return bool(_defaults(one.__class__) | one._values == _defaults(other.__class__) | other._values)


def _hash(flags: Any) -> int:
    return hash(type(flags))


@functools.cache
def _defaults(kind: Any) -> dict[str, Any]:
    return {name: option.default for name, option in kind.options.items()}


def _remembered(find: Any) -> Any:
    """The signature of an operator for types of arguments, found once: numba tries up to fifty rules every time.

    Where the rule is a function that is compiled itself, it is looked up as ever: that depends on the caller's options.
    """

    signatures: dict[Any, Any] = {}

    @functools.wraps(find)
    def found(self: Any, context: Any, args: Any, kws: Any) -> Any:
        if kws:
            return find(self, context, args, kws)
        asked = self, context, tuple(args)
        if asked in signatures:
            return signatures[asked]
        signature = find(self, context, args, kws)
        if self._impl_keys[signature.args] is self.typing_key:
            signatures[asked] = signature
        return signature

    return found
