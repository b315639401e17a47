"""Tables and figures of a report, each in all its forms, in folders of their own."""

from __future__ import annotations

from pathlib import Path

from polydem_post.base.emit import FORMATS, SUFFIXES, printable

#: File that says what made the numbers of the tables beside it, since CSV has no room for that
ORIGIN = "revision.txt"


def write_tables(tables: list, folder: Path, origin: str) -> list[Path]:
    """Write tables in all forms; each names what made its numbers."""
    folder.mkdir(parents=True, exist_ok=True)
    written = [folder / ORIGIN]
    written[0].write_text(f"Tables in this folder: {printable(origin)}\n", encoding="utf-8")
    for table in tables:
        table.origin = table.origin or origin
        for form in FORMATS:
            written.append(folder / (table.name + SUFFIXES[form]))
            written[-1].write_text(table.document(form), encoding="utf-8")
    return written


def write_figures(drawings: list, folder: Path) -> list[Path]:
    """Write figures in all forms, and their captions."""
    from .style import save_drawing  # matplotlib takes long to load and tables do not need it

    folder.mkdir(parents=True, exist_ok=True)
    captions = folder / "captions.md"
    captions.write_text("\n\n".join(f"**{each.name}** {each.caption}" for each in drawings) + "\n", encoding="utf-8")
    return [path for each in drawings for path in save_drawing(each, folder)] + [captions]
