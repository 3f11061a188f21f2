"""The table of faults in docs/service.md: between two marks, one line per fault."""

import math
from pathlib import Path

from tests.faults.measured import Measured
from tests.faults.sorties import Fault

DOCS = Path(__file__).parents[2] / "docs" / "service.md"
BEGIN, END = "<!-- faults: python -m tests.faults -->", "<!-- end of faults -->"
HEAD = (
    "| what happens | status | RMC | COG | no position | position | SOG | COG | recovers in |",
    "|---|---|---|---|---|---|---|---|---|",
)


def line(fault: Fault, found: Measured) -> str:
    """One line of the table; measured numbers are rounded."""
    unknown = f"{found.unknown:.0f} s" if found.unknown > 0.5 else "never"
    recovers = "at once" if found.recovery < 0.05 else f"{found.recovery:.1f} s" if found.recovery < 60 else "not"
    errors = f"{found.position:.1f} m | {found.sog:.2f} m/s | {math.degrees(found.course):.0f}°"
    statuses = ", ".join(found.statuses)
    return f"| {fault.name} | {statuses} | {found.rmc} | {found.cog} | {unknown} | {errors} | {recovers} |"


def discrete(row: str) -> tuple[str, ...]:
    """The cells of a line that do not depend on noise: name, status, RMC, COG."""
    return tuple(cell.strip() for cell in row.strip("|").split("|")[:4])


def in_docs(docs: Path = DOCS, begin: str = BEGIN, end: str = END, head: tuple[str, ...] = HEAD) -> list[str]:
    """A table's lines in the docs."""
    return docs.read_text(encoding="utf-8").split(begin)[1].split(end)[0].strip().splitlines()[len(head) :]


def written(
    lines: list[str], docs: Path = DOCS, begin: str = BEGIN, end: str = END, head: tuple[str, ...] = HEAD
) -> None:
    """Write a table's lines into the docs."""
    before, rest = docs.read_text(encoding="utf-8").split(begin)
    table = "\n".join((*head, *lines))
    docs.write_text(f"{before}{begin}\n\n{table}\n\n{end}{rest.split(end)[1]}", encoding="utf-8")
