"""Cases and their tables or texts: registration, reading, writing, comparison."""

from collections.abc import Callable
from dataclasses import dataclass
from difflib import unified_diff
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import numpy as np

FILES = Path(__file__).with_name("files")
RTOL, ATOL = 1e-9, 1e-12


@dataclass(frozen=True)
class Case:
    """One reference output: a name, a function that computes its columns, and how closely they must agree.

    `recorded` cases take the folder of recorded logs (STEERWAY_DATA) as their only argument. A `text` case gives a
    text, which must agree exactly.
    """

    name: str
    compute: Callable[..., dict[str, np.ndarray] | str]
    rtol: float = RTOL
    atol: float = ATOL
    recorded: bool = False
    text: bool = False

    @property
    def path(self) -> Path:
        return FILES / f"{self.name}.{'txt' if self.text else 'csv'}"

    def output(self, *arguments) -> dict[str, np.ndarray] | str:
        """What the code gives now: a text, or columns of equal length, where (n, m) ones are m columns name_0 …"""
        computed = self.compute(*arguments)
        if self.text:
            return computed
        flat = {}
        for name, values in computed.items():
            values = np.atleast_1d(np.asarray(values, dtype=float))
            for j, column in enumerate(values.reshape(len(values), -1).T):
                flat[name if values.ndim == 1 else f"{name}_{j}"] = column
        return flat

    def check(self, output) -> None:
        """AssertionError with the first column that differs from what was accepted last; of a text, with a diff."""
        accepted = self.path.read_text(encoding="utf-8")
        if self.text:
            old, new = accepted.splitlines(), output.splitlines()
            assert old == new, "\n".join(unified_diff(old, new, "accepted", "now", lineterm=""))
            return
        header, *rows = accepted.splitlines()
        assert list(output) == header.split(","), f"columns {list(output)}, accepted {header}"
        for name, values in zip(output, np.loadtxt(rows, delimiter=",", ndmin=2).T, strict=True):
            np.testing.assert_allclose(output[name], values, self.rtol, self.atol, err_msg=name)

    def accept(self, output) -> None:
        """Make this output the accepted one, with every digit that tells two floats apart."""
        if not self.text:
            rows = zip(*output.values(), strict=True)
            output = "\n".join([",".join(output), *(",".join(repr(float(each)) for each in row) for row in rows), ""])
        self.path.write_text(output, encoding="utf-8")


CASES: dict[str, Case] = {}


def case(name: str, rtol: float = RTOL, atol: float = ATOL, recorded: bool = False, text: bool = False):
    """Register a function that returns columns {name: (n,) or (n, m) numbers} as the case `name`.

    A dictionary of plain numbers {name: value} is a case of one row. With `text` the function returns a str.
    """

    def register(function):
        if name in CASES:
            raise ValueError(f"two reference outputs are called {name!r}")
        CASES[name] = Case(name, function, rtol, atol, recorded, text)
        return function

    return register


def load_cases() -> dict[str, Case]:
    """Every case by name, in alphabetical order."""
    from tests.reference_outputs import cases

    for module in iter_modules(cases.__path__):
        import_module(f"{cases.__name__}.{module.name}")
    return dict(sorted(CASES.items()))


def columns(names: str, rows, every: int = 1) -> dict[str, np.ndarray]:
    """Columns named by words from rows of numbers; every so many rows, counted from the last one."""
    table = np.array([np.hstack([np.ravel(each) for each in row]) for row in rows], dtype=float)
    names = names.split()
    if len(names) != table.shape[1]:
        raise ValueError(f"{len(names)} names for {table.shape[1]} columns")
    return dict(zip(names, table[::-1][::every][::-1].T, strict=True))
