"""The cases of a study, side by side; an interrupted study continues with those that are done."""

import hashlib
import io
import pickle
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

from steerway.simulation import Unfinished, over_seeds

_kept: Unfinished | None = None


@contextmanager
def keeping(parts: Unfinished | None) -> Iterator[None]:
    """Meanwhile `over_cases` keeps its results in `parts`, and takes from there what is done."""
    global _kept
    before, _kept = _kept, parts
    try:
        yield
    finally:
        _kept = before


def over_cases(run: Callable, cases: Iterable, progress: Callable[[float], None] | None = None) -> list:
    """`steerway.simulation.over_seeds` for cases of any kind; within `keeping` none is run that is done."""
    cases, parts = list(cases), _kept
    if parts is None:
        return over_seeds(run, cases, progress=progress)
    keys = [_key(run, case) for case in cases]
    missing = [k for k, key in enumerate(keys) if key not in parts.results]
    done = len(cases) - len(missing)
    if progress and done:
        progress(done / len(cases))
    over_seeds(
        _Nth(run, cases),
        missing,
        progress=progress and (lambda share: progress((done + share * len(missing)) / len(cases))),
        finished=lambda k, result: parts.add(keys[k], result),
    )
    return [parts.results[key] for key in keys]


class _Nth:
    """`run` of the k-th case."""

    def __init__(self, run, cases):
        self.run, self.cases = run, cases

    def __call__(self, k):
        return self.run(self.cases[k])


def _key(run, case) -> bytes:
    """What is asked for: the function with its arguments, and the case."""
    packed = io.BytesIO()
    pickler = pickle.Pickler(packed)
    pickler.fast = True  # equal values are packed alike, also where they are not one object
    pickler.dump((run, case))
    return hashlib.sha256(packed.getvalue()).digest()
