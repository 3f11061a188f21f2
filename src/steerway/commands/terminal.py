"""Output on a terminal (pairs, tables, JSON, progress), and the declaration of options and arguments."""

import json
import math
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Protocol

import typer

from steerway.core.errors import printable


class Progressed(Protocol):
    """Called with the share done (0 to 1) and the current step."""

    def __call__(self, part: float, note: str = "") -> None: ...


def option(metavar: str | None, help: str, default: Any = None, *names: str, **limits: Any) -> Any:
    """An option; the metavar names its value. Without `names` its parameter names it. Default `...`: required."""
    return typer.Option(default, *names, metavar=metavar, help=help, **limits)


def argument(metavar: str, help: str, default: Any = ...) -> Any:
    """An argument; required if it has no default."""
    return typer.Argument(default, metavar=metavar, help=help)


def flag(names: str, help: str, default: bool = False) -> Any:
    """An option without a value; the help shows no type beside it."""
    return typer.Option(default, names, metavar="", help=help)


def print_pairs(pairs: Sequence[tuple[str, object]]) -> None:
    """Print (what, value) pairs, values in one column."""
    width = max((len(name) for name, _ in pairs), default=0)
    for name, value in pairs:
        print(printable(f"{name:<{width}}  {value}"))


def print_notes(notes: Iterable[str], indent: str = "") -> None:
    """Print one line per note."""
    for note in notes:
        print(f"{indent}· {printable(note)}")


def print_table(title: str, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Print a plain table, 160 characters wide if the output is not a terminal."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(
        title=Text(printable(title)), title_justify="left", box=None, show_header=any(columns), pad_edge=False
    )
    for name in columns:
        table.add_column(name)
    for row in rows:
        table.add_row(*(Text(printable(str(each))) for each in row))
    Console(width=None if sys.stdout.isatty() else 160).print(table)


def print_json(value: object) -> None:
    """Print JSON; NaN, which JSON does not have, is written as null."""
    print(json.dumps(_finite(value), ensure_ascii=False, indent=2))


def _finite(value: object) -> object:
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


@contextmanager
def progress_line(what: str) -> Iterator[Progressed]:
    """Show progress on stderr: a bar on a terminal, else a line per minute. Yields the function that advances it."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:3.0f} %"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(what, total=1.0)
        line = _Lines(what)

        def step(part: float, note: str = "") -> None:
            bar.update(task, completed=part, description=note or what)
            if not console.is_terminal:
                line.step(part, note)

        yield step


class _Lines:
    """Progress as one line per minute, with the time left at the pace so far.

    Progress reported in the first seconds is that of an earlier, interrupted run. It does not count for the pace.
    """

    def __init__(self, what: str) -> None:
        self._what, self._began, self._before = what, time.monotonic(), 0.0
        self._next = self._began + 60.0

    def step(self, part: float, note: str) -> None:
        now = time.monotonic()
        if now < self._began + _RESUMED:
            self._before = part
        elif now >= self._next and part > self._before:
            left = (now - self._began) * (1.0 - part) / (part - self._before) / 60.0
            words = ", ".join(each for each in (self._what, note) if each)
            print(f"{words}: {100.0 * part:.0f} %, about {left:.0f} min left", file=sys.stderr, flush=True)
            self._next = now + 60.0


_RESUMED = 5.0  # s from the start in which a reported share counts as done by an interrupted run
