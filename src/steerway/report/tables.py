"""Tables of pages as HTML: headers have a scope, wide ones scroll."""

import html
from collections.abc import Sequence
from typing import Any

Table = tuple[str, Sequence[str], Sequence[Sequence[Any]]]
"""Heading, column names, rows."""


def html_table(heading: str, names: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A section with one table; the first column names the rows."""
    named = f"<thead><tr>{''.join(map(_header, names))}</tr></thead>" if any(names) else ""
    body = "".join(f"<tr>{''.join(map(_cell, range(len(row)), row))}</tr>" for row in rows)
    return (
        f'<section><h2>{html.escape(heading)}</h2><div class="table" tabindex="0">'
        f"<table>{named}<tbody>{body}</tbody></table></div></section>"
    )


def _header(name: str) -> str:
    text = html.escape(str(name))
    return f'<th scope="col">{text}</th>' if text else "<td></td>"


def _cell(column: int, value: object) -> str:
    text = html.escape(str(value))
    if column == 0 and text:
        return f'<th scope="row">{text}</th>'
    return f'<td class="{text}">{text}</td>' if text in ("met", "missed") else f"<td>{text}</td>"
