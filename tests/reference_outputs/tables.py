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
        """What the code gives now."""
        computed = self.compute(*arguments)
        return computed if self.text else flat_columns(computed)

    def accepted(self) -> dict[str, np.ndarray] | str:
        """What was accepted last."""
        return self.path.read_text(encoding="utf-8") if self.text else read_table(self.path)

    def accept(self, output) -> None:
        """Make this output the accepted one."""
        if self.text:
            self.path.write_text(output, encoding="utf-8")
        else:
            write_table(self.path, output)


CASES: dict[str, Case] = {}


def case(name: str, rtol: float = RTOL, atol: float = ATOL, recorded: bool = False, text: bool = False):
    """Register a function that returns columns {name: (n,) or (n, m) numbers} as the case `name`.

    A dictionary of plain numbers {name: value} is a case of one row. (n, m) columns become name_0 … name_{m−1}. With
    `text` the function returns a str.
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


def flat_columns(columns: dict) -> dict[str, np.ndarray]:
    """The columns as one-dimensional float64 arrays of equal length."""
    flat = {}
    for name, values in columns.items():
        values = np.atleast_1d(np.asarray(values, dtype=float))
        if values.ndim == 1:
            flat[name] = values
        else:
            for j, column in enumerate(values.reshape(len(values), -1).T):
                flat[f"{name}_{j}"] = column
    lengths = {len(values) for values in flat.values()}
    if len(lengths) != 1:
        raise ValueError(f"columns of different lengths: { {name: len(values) for name, values in flat.items()} }")
    return flat


def write_table(path: Path, columns: dict[str, np.ndarray]) -> None:
    """Write columns with every digit that tells two floats apart."""
    rows = [",".join(columns)]
    rows += [",".join(repr(float(value)) for value in row) for row in zip(*columns.values(), strict=True)]
    path.write_text("\n".join(rows) + "\n")


def read_table(path: Path) -> dict[str, np.ndarray]:
    header, *rows = path.read_text().splitlines()
    values = np.array([[float(value) for value in row.split(",")] for row in rows])
    return dict(zip(header.split(","), values.T, strict=True))


def differences(case: Case, computed, accepted) -> list[str]:
    """One line a column that changed: how many rows, from which row on, by how much at most. Of a text, a diff."""
    if case.text:
        return list(unified_diff(accepted.splitlines(), computed.splitlines(), "accepted", "now", lineterm=""))
    lines = [f"{name}: column is new" for name in computed.keys() - accepted.keys()]
    lines += [f"{name}: column is gone" for name in accepted.keys() - computed.keys()]
    for name in sorted(computed.keys() & accepted.keys()):
        new, old = computed[name], accepted[name]
        if len(new) != len(old):
            lines.append(f"{name}: {len(old)} rows before, {len(new)} now")
            continue
        changed = ~np.isclose(new, old, rtol=case.rtol, atol=case.atol, equal_nan=True)
        if changed.any():
            rows = np.flatnonzero(changed)
            gap = np.abs(new - old)[rows]
            worst = rows[np.argmax(np.where(np.isnan(gap), np.inf, gap))]
            lines.append(
                f"{name}: {len(rows)} of {len(new)} rows changed, from row {rows[0]} on; "
                f"most at row {worst}: {old[worst]!r} -> {new[worst]!r}"
            )
    return lines


def columns(names: str, rows, every: int = 1) -> dict[str, np.ndarray]:
    """Columns named by words from rows of numbers; every so many rows, counted from the last one."""
    table = np.array([np.hstack([np.ravel(each) for each in row]) for row in rows], dtype=float)
    names = names.split()
    if len(names) != table.shape[1]:
        raise ValueError(f"{len(names)} names for {table.shape[1]} columns")
    return dict(zip(names, table[::-1][::every][::-1].T, strict=True))
