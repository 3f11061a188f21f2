"""Self-contained HTML pages of tables, figures and remarks, to open offline or print."""

import base64
import html
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from steerway.core.extras import install, is_installed
from steerway.core.files import complete_or_absent
from steerway.core.records import Fixes, Motion

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    Drawn = tuple[Figure | bytes, str]

Table = tuple[str, Sequence[str], Sequence[Sequence[Any]]]
"""Heading, column names, rows."""


@dataclass(frozen=True)
class ReportContents:
    """Contents of a report: an estimate and the fixes it was made from.

    tables: the first is shown at the top. remarks: one paragraph each. events: (start, stop, words) each, in Unix s.
    truth: the true motion at the rows of `motion`, in a simulation. lead: a sentence under the title. gate: whether the
    estimate has a rejection gate: with a profile, but not with inferred structures.
    """

    title: str
    fixes: Fixes
    motion: Motion
    tables: Sequence[Table]
    remarks: Sequence[str] = ()
    events: Sequence[tuple[float, float, str]] = ()
    truth: Motion | None = None
    lead: str = ""
    gate: bool = True


_WIDTH = 8.0  # inches
_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 72rem; margin: 2rem auto; padding: 0 1rem; color: #1b2733; }
h1 { font-weight: 600; overflow-wrap: anywhere; } h2 { font-weight: 600; margin-top: 2rem; }
table { border-collapse: collapse; margin: 1rem 0; }
th, td { text-align: left; padding: .25rem .9rem .25rem 0; border-bottom: 1px solid #d8dee4; vertical-align: top; }
th { font-weight: 600; } tbody th { font-weight: 400; }
.table { overflow-x: auto; } figure { margin: 1.5rem 0; } figcaption { color: #52606d; max-width: 60rem; }
figure div { overflow-x: auto; }
img { width: 100%; min-width: 38rem; max-width: 60rem; height: auto; }
.missed { color: #a4262c; font-weight: 600; } .met { color: #1d7a46; }
"""


def write_page(
    path: Path,
    title: str,
    tables: Sequence[Table] = (),
    figures: "Sequence[Drawn] | Callable[[], Sequence[Drawn]]" = (),
    remarks: Sequence[str] = (),
    lead: str = "",
    details: Sequence[Table] = (),
) -> None:
    """Write a page.

    Args:
        path: the file to write; complete or absent.
        tables: (heading, column names, rows) each.
        figures: (matplotlib figure or its `png`, caption) each; or a function that returns them. Without the extra
            `report` the function is not called, and the page contains the command that installs it.
        remarks: one paragraph each.
        lead: a sentence under the title.
        details: tables for the end of a long page; with them, the remarks come before the figures.
    """
    parts = [f"<h1>{html.escape(title)}</h1>"]
    if lead:
        parts.append(f"<p>{html.escape(lead)}</p>")
    parts += [html_table(*table) for table in tables]
    if callable(figures) and not is_installed("report"):
        figures, remarks = (), [*remarks, f"To add figures to this page: {install('report')}."]
    shown = [_figure(figure, caption) for figure, caption in (figures() if callable(figures) else figures)]
    paragraphs = _remarks(remarks) if remarks else []
    parts += [*paragraphs, *shown] if details else [*shown, *paragraphs]
    parts += [html_table(*table) for table in details]
    page = (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{html.escape(title)}</title><style>{_STYLE}</style></head><body><main>{''.join(parts)}</main></body></html>\n"
    )
    with complete_or_absent(path) as file:
        file.write(page.encode())


def _remarks(remarks: Sequence[str]) -> list[str]:
    items = "".join(f"<li>{html.escape(remark)}</li>" for remark in remarks)
    return [f"<h2>Remarks</h2><ul>{items}</ul>"]


def png(figure: "Figure") -> bytes:
    """The figure as PNG, narrow enough that its text is legible on a phone."""
    width, height = figure.get_size_inches()
    shrunk = min(1.0, _WIDTH / width)
    figure.set_size_inches(shrunk * width, shrunk * height)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=165)
    return buffer.getvalue()


def _figure(figure: "Figure | bytes", caption: str) -> str:
    encoded = base64.b64encode(figure if isinstance(figure, bytes) else png(figure)).decode("ascii")
    alt = html.escape(caption, quote=True)
    return (
        f'<figure><div tabindex="0"><img alt="{alt}" src="data:image/png;base64,{encoded}"></div>'
        f"<figcaption>{html.escape(caption)}</figcaption></figure>"
    )


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
