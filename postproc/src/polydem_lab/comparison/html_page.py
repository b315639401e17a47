"""One HTML file that needs nothing else: no network, no script, figures inside."""

from __future__ import annotations

import base64
import html
from pathlib import Path

from polydem_post.base.emit import Table, printable

#: Look of a page: readable on screens and on paper
STYLE = """
body { font: 16px/1.5 sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; color: #111; background: #fff; }
h1, h2, h3 { line-height: 1.2; } h2 { margin-top: 2.5rem; border-bottom: 1px solid #ccc; }
figure { margin: 1.5rem 0; } figure img { max-width: 100%; height: auto; } figcaption { color: #333; font-size: 0.9em; }
.scroll { overflow-x: auto; } table { border-collapse: collapse; font-size: 0.85em; }
th, td { padding: 0.15rem 0.6rem; border-bottom: 1px solid #ddd; vertical-align: top; text-align: left; }
td.number, th.number { text-align: right; font-variant-numeric: tabular-nums; } td.number { white-space: nowrap; }
details { margin: 0.6rem 0; } summary { cursor: pointer; font-weight: bold; } .note { color: #333; font-size: 0.85em; }
nav ul { columns: 2; }
@media print {
  details::details-content { content-visibility: visible; } table { font-size: 0.6em; } figure { break-inside: avoid; }
}
"""

#: Kinds of pictures that a page can hold
TYPES = {".svg": "image/svg+xml", ".png": "image/png"}


class Page:
    """A page under construction."""

    def __init__(self, title: str):
        self.title = title
        self._parts: list[str] = []
        self._headings: list[tuple] = []

    def heading(self, text: str) -> None:
        """Begin a section; it appears in the contents."""
        anchor = f"section-{len(self._headings) + 1}"
        self._headings.append((anchor, text))
        self._parts.append(f'<h2 id="{anchor}">{_escaped(text)}</h2>')

    def paragraph(self, text: str, tables: tuple = (), label: str = "") -> None:
        """A paragraph; all its numbers are those of some tables. The label stands before it in bold."""
        source = f' data-table="{" ".join(tables)}"' if tables else ""
        before = f"<b>{_escaped(label)}</b> " if label else ""
        self._parts.append(f"<p{source}>{before}{_escaped(text)}</p>")

    def table(self, table: Table, is_open: bool = False) -> None:
        """A table that unfolds, with its note."""
        head = "".join(f"<th{_kind(table, k)}>{_escaped(word)}</th>" for k, word in enumerate(table.heading))
        rows = "".join(
            "<tr>" + "".join(f"<td{_kind(table, k)}>{_escaped(word)}</td>" for k, word in enumerate(row)) + "</tr>"
            for row in table.rows
        )
        note = f'<p class="note">{_escaped(table.note)}</p>' if table.note else ""
        self._parts.append(
            f'<details id="table-{table.name}"{" open" if is_open else ""}><summary>{_escaped(table.title)}</summary>'
            f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'
            f"{note}</details>"
        )

    def figure(self, name: str, path: Path, caption: str) -> None:
        """A picture inside the page."""
        data = base64.b64encode(path.read_bytes()).decode("ascii")
        self._parts.append(
            f'<figure id="figure-{name}"><img alt="{_escaped(name)}" src="data:{TYPES[path.suffix]};base64,{data}">'
            f"<figcaption>{_escaped(caption)}</figcaption></figure>"
        )

    def written(self) -> str:
        """The whole file."""
        contents = "".join(f'<li><a href="#{anchor}">{_escaped(text)}</a></li>' for anchor, text in self._headings)
        return (
            '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width"><link rel="icon" href="data:,">'
            f"<title>{_escaped(self.title)}</title><style>{STYLE}</style></head>\n<body><h1>{_escaped(self.title)}</h1>"
            f"\n<nav><ul>{contents}</ul></nav>\n" + "\n".join(self._parts) + "\n</body></html>\n"
        )


def _escaped(text) -> str:
    return html.escape(printable(str(text)), quote=True)


def _kind(table: Table, k: int) -> str:
    return ' class="number"' if k >= table.texts else ""
