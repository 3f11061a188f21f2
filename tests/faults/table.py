"""A measured table in the docs: between two marks, one line per fault."""

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

DOCS = Path(__file__).parents[2] / "docs"


class Table(NamedTuple):
    """Name of the page, name of the marks, and titles of the columns."""

    page: str
    name: str
    head: str

    def rows(self) -> list[str]:
        """The table's lines."""
        return self._parts()[1].strip().splitlines()[2:]

    def cells(self, count: int | None = None) -> dict[str, tuple[str, ...]]:
        """The first cells of each line by the first of them."""
        return {found[0]: found for found in (cells(each)[:count] for each in self.rows())}

    def write(self, lines: Iterable[str]) -> None:
        """Print lines and write them in place of the table's."""
        made = []
        for each in lines:
            made.append(each)
            print(each, flush=True)
        before, _, after = self._parts()
        rule = "|" + "---|" * (self.head.count("|") - 1)
        text = "\n".join((self.head, rule, *made))
        (DOCS / self.page).write_text(f"{before}\n\n{text}\n\n{after}", encoding="utf-8")

    def _parts(self):
        begin, end = f"<!-- {self.name}: python -m tests.faults -->", f"<!-- end of {self.name} -->"
        before, rest = (DOCS / self.page).read_text(encoding="utf-8").split(begin)
        table, after = rest.split(end)
        return before + begin, table, end + after


def cells(line: str) -> tuple[str, ...]:
    """The cells of a line."""
    return tuple(each.strip() for each in line.strip("|").split(" | "))
