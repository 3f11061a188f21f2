"""Every public name called with arguments of the right kind and the wrong content: `python -m tests.hostile_arguments`.

Arrays that are empty, short, long, of other shapes, of other types, unordered, with NaN and infinity; numbers beyond
every range. Allowed are a result and the errors of a wrong argument; an IndexError is an index that was not checked.
Run with NUMBA_BOUNDSCHECK=1, or with NUMBA_DISABLE_JIT=1, where NumPy itself checks: without either a kernel reads
whatever lies beyond its array. Prints what was called, as JSON.
"""

import argparse
import collections.abc
import importlib
import inspect
import json
import math
import random
import re
import signal
import sys
import traceback
import types
import typing
import warnings

import numpy as np

from steerway.core import Fixes, InputError

PACKAGES = (
    "core", "estimation", "estimation.heading", "estimation.speed", "estimation.positioning", "guidance", "control",
    "identification", "sensors", "vessels", "simulation", "report",
)  # fmt: skip
SKIPPED = {"over_seeds", "Unfinished", "sail", "write_page", "complete_or_absent", "made_directory", "kernel"} | {
    "estimate", "tune", "choose_profile", "InputError", "track_figure",
}  # fmt: skip
"""Writers, and what takes seconds a call: `make bounds-all` runs their own tests with checks."""
WRONG = (InputError, ValueError, TypeError, ArithmeticError, OSError, np.linalg.LinAlgError)
"""Errors of a wrong argument. (ArithmeticError: a number beyond floating point; OSError: no such file.)"""
_KINDS = (*("sound",) * 6, "nan", "infinite", "unordered", "square", "scalar", "integers", "row", "longer")
_NUMBERS = (0.0, 1.0, -1.0, 0.1, 2.5, 7.0, math.nan, math.inf, -math.inf, 1e-300, 1e300, 1e9)
_REFUSED_BY_TYPE = "too many indices", "tuple index out of range", "'float' object has no attribute"
"""A number or an array of fewer dimensions in place of an array: compiled, numba refuses it by its type."""
_LONGEST_CALL = 0.3  # s: a simulation of 1e9 s is no error
_UNIONS = (typing.Union, types.UnionType)
_LENGTHS = (0, 1, 2, 3, 5, 6, 40, 300)


def array(rng: random.Random, length: int):
    """An array that a user might hand over by mistake, or on purpose."""
    numbers = np.random.default_rng(rng.randrange(1 << 30))
    made = rng.choice((np.cumsum(numbers.uniform(0.1, 1.0, length)), numbers.normal(size=length), np.zeros(length)))
    kind = rng.choice(_KINDS)
    if kind in ("nan", "infinite") and length:
        made[rng.randrange(length)] = np.nan if kind == "nan" else rng.choice((np.inf, -np.inf, 1e300))
    if kind == "square":
        return numbers.normal(size=(length, length))
    others = {"unordered": made[::-1], "scalar": 1.0, "integers": np.arange(length), "row": made[None]}
    return (others | {"longer": np.concatenate([made, made])}).get(kind, made)


class _TooLong(BaseException):
    """A call was ended."""


class Caller:
    """Makes arguments by annotation; objects of public classes are those that were constructed before."""

    def __init__(self, seed: int):
        self.rng = random.Random(seed)
        self.made: dict[type, list] = collections.defaultdict(list)
        time = np.arange(40.0)
        self.made[Fixes] += [Fixes(time, 0.9 + 3e-7 * time, np.full(40, 0.2)), Fixes(*np.empty((3, 0)))]

    def arguments(self, function) -> tuple[list, dict] | None:
        """For one call; None where a required parameter is of a kind that is not made here."""
        positional, named = [], {}
        length = self.rng.choice(_LENGTHS)
        try:
            hints = typing.get_type_hints(function if not inspect.isclass(function) else function.__init__)
        except Exception:
            hints = {}
        for name, parameter in inspect.signature(function).parameters.items():
            optional = parameter.default is not parameter.empty
            if parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD) or (
                optional and self.rng.random() < 0.7
            ):
                continue
            value = self.value(hints.get(name, parameter.annotation), length)
            if value is Caller:
                if optional:
                    continue
                return None
            if parameter.kind is parameter.POSITIONAL_ONLY:
                positional.append(value)
            else:
                named[name] = value
        return positional, named

    def value(self, kind, length):
        """An argument of this annotation; `Caller` itself where none is made."""
        choose, origin, inner = self.rng.choice, typing.get_origin(kind), typing.get_args(kind)
        plain = {
            float: lambda: choose(_NUMBERS),
            int: lambda: choose((0, 1, 2, 5, -1, 100)),
            bool: lambda: choose((True, False)),
            types.NoneType: lambda: None,
            str: lambda: choose(("small-usv", "stop", "")),
            np.random.Generator: lambda: np.random.default_rng(0),
        }
        if kind in plain:
            return plain[kind]()
        if np.ndarray in (kind, origin) or (origin in _UNIONS and re.search("ndarray|SupportsArray", str(inner))):
            return array(self.rng, length)
        if origin is typing.Annotated:
            return self.value(inner[0], length)
        if origin in _UNIONS:
            options = [value for each in inner if (value := self.value(each, length)) is not Caller]
            return choose(options) if options else Caller
        if origin is collections.abc.Callable:
            return lambda *given: given[0] if given else None
        if origin is typing.Literal:
            return choose(inner)
        if origin in (tuple, list, collections.abc.Sequence) and inner:
            fixed = origin is tuple and Ellipsis not in inner
            made = [self.value(one, length) for one in (inner if fixed else inner[:1] * choose((0, 1, 2, 3, 6)))]
            return Caller if any(value is Caller for value in made) else tuple(made) if origin is tuple else made
        known = [each for made in self.made.values() for each in made if inspect.isclass(kind) and _is_a(each, kind)]
        return choose(known) if known else Caller


def _is_a(value, kind) -> bool:
    try:
        return isinstance(value, kind)
    except TypeError:
        return False


def public():
    """(name, class or function) of every public name."""
    seen = set()
    for package in PACKAGES:
        module = importlib.import_module(f"steerway.{package}")
        for name in module.__all__:
            value = getattr(module, name)
            if name not in SKIPPED and callable(value) and id(value) not in seen and not _is_protocol(value):
                seen.add(id(value))
                yield f"{package}.{name}", value


def _is_protocol(value) -> bool:
    return getattr(value, "_is_protocol", False)


def methods(value):
    """(name, bound method) of an object's own public methods."""
    for name in sorted(set(dir(type(value))) - set(dir(tuple)) - set(dir(object))):
        static = inspect.getattr_static(type(value), name, None)
        if name.startswith(("_", "model_", "to_", "plot", "save")) or isinstance(static, property):
            continue
        if callable(method := getattr(value, name, None)) and not inspect.isclass(method):
            yield name, method


def main() -> None:
    """Call everything some times; exit code 1 for an unchecked index or any other error that is not the argument's."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--rounds", type=int, default=25)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    np.seterr(all="ignore")
    caller, names = Caller(given.seed), list(public())
    called, findings, slow = {}, {}, {}

    def stop(_, frame):
        """End what `call` called; never `call` itself: to free what was made can take longer than to the next alarm."""
        if frame.f_code is not call.__code__:
            raise _TooLong

    def call(name, function):
        try:
            made = caller.arguments(function)
        except (TypeError, ValueError):
            return None
        if made is None:
            return None
        called[name] = called.get(name, 0) + 1
        # Again and again: an exception that comes while a weak reference is cleared is lost.
        signal.setitimer(signal.ITIMER_REAL, _LONGEST_CALL, 0.1)
        try:
            try:
                return function(*made[0], **made[1])
            finally:
                signal.setitimer(signal.ITIMER_REAL, 0.0)
        except WRONG:
            return None
        except _TooLong:
            slow[name] = slow.get(name, 0) + 1
            return None
        except Exception as error:
            if any(words in str(error) for words in _REFUSED_BY_TYPE):
                return None
            where = traceback.extract_tb(error.__traceback__)[-1]
            place = f"{where.filename}:{where.lineno}"
            findings.setdefault(f"{name}: {type(error).__name__} at {place} ({error})", str(made)[:400])
            return None

    signal.signal(signal.SIGALRM, stop)
    for _ in range(given.rounds):
        for name, value in names:
            if slow.get(name, 0) > 2:
                continue
            result = call(name, value)
            if inspect.isclass(value) and isinstance(result, value) and len(caller.made[value]) < 6:
                caller.made[value].append(result)
            for made in caller.made.get(value, ())[:3] if inspect.isclass(value) else ():
                for method_name, method in methods(made):
                    if slow.get(f"{name}.{method_name}", 0) < 3:
                        call(f"{name}.{method_name}", method)
    never = sorted(name for name, _ in names if name not in called)
    counts = {"calls": sum(called.values()), "names": len(called), "never": never, "slow": slow, "findings": findings}
    print(json.dumps(counts, indent=1))
    sys.exit(bool(findings))


if __name__ == "__main__":
    main()
