"""One table, written for people, manuals, papers and spreadsheets."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import dataclass, field

#: Letters that steer a terminal, but for the end of a line and the tabulator
STEERING = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]")

#: How a table can be written
FORMATS = ("text", "markdown", "latex", "csv")

#: End of the name of a file in each form
SUFFIXES = {"text": ".txt", "markdown": ".md", "latex": ".tex", "csv": ".csv"}

#: Longest cell that LaTeX need not break into lines
LONG = 40

#: What LaTeX takes for commands, and how it prints it
LATEX = {
    "\\": r"\textbackslash{}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"$<$",
    ">": r"$>$",
}


def printable(text: str) -> str:
    r"""A text without what steers a terminal, which files may hold: such letters are written as \x1b."""
    text = text.encode("utf-8", errors="backslashreplace").decode("utf-8")
    return STEERING.sub(lambda match: repr(match.group())[1:-1], text)


@dataclass
class Table:
    """Columns and rows of texts."""

    #: Name of its files
    name: str
    #: What it shows
    title: str
    #: Headings of the columns
    heading: tuple
    #: Rows of as many texts as there are headings
    rows: list = field(default_factory=list)
    #: What a reader must know to understand it
    note: str = ""
    #: How many columns, from the left, hold names or sentences; the others hold numbers and stand to the right
    texts: int = 1
    #: What made the numbers: the program and its revision
    origin: str = ""

    def add(self, *cells) -> None:
        """Append a row."""
        row = tuple(printable(str(cell)) for cell in cells)
        if len(row) != len(self.heading):
            raise ValueError(f"table {self.name}: a row of {len(row)} cells under {len(self.heading)} headings")
        self.rows.append(row)

    def written(self, form: str = "text") -> str:
        """The rows in one of FORMATS, without title and note."""
        return {"text": _text, "markdown": _markdown, "latex": _latex, "csv": _csv}[form](self)

    def document(self, form: str) -> str:
        """What a file holds: the rows with title and note, in a form that the reader of that form understands."""
        note = "\n".join(part for part in [self.note, printable(self.origin)] if part)
        if form == "csv":
            return self.written(form) + "\n"
        if form == "markdown":
            parts = [f"### {self.title}", self.written(form), note]
            return "\n\n".join(part for part in parts if part) + "\n"
        if form == "latex":
            comments = [f"% {line}" for line in [self.title, *note.splitlines()] if line]
            return "\n".join([*comments, self.written(form)]) + "\n"
        return "\n".join(part for part in [self.title, self.written(form), note] if part) + "\n"


def _text(table: Table) -> str:
    lines = [table.heading, *table.rows]
    widths = [max(len(row[k]) for row in lines) for k in range(len(table.heading))]
    return "\n".join(_aligned(row, widths, table.texts) for row in lines)


def _aligned(row: tuple, widths: list, texts: int) -> str:
    cells = [cell.ljust(width) if k < texts else cell.rjust(width) for k, (cell, width) in enumerate(zip(row, widths))]
    return "  ".join(cells).rstrip()


def _markdown(table: Table) -> str:
    rule = ["---" if k < table.texts else "---:" for k in range(len(table.heading))]
    return "\n".join(
        "| " + " | ".join(cell.replace("|", r"\|") for cell in row) + " |" for row in [table.heading, rule, *table.rows]
    )


def _latex(table: Table) -> str:
    """A table of the package booktabs."""
    lines = [r"\begin{tabular}{" + "".join(_column(table, k) for k in range(len(table.heading))) + "}", r"\toprule"]
    lines += [" & ".join(map(_printable, table.heading)) + r" \\", r"\midrule"]
    lines += [" & ".join(map(_printable, row)) + r" \\" for row in table.rows]
    lines += [r"\bottomrule", r"\end{tabular}"]
    return "\n".join(lines)


def _column(table: Table, k: int) -> str:
    """Alignment of a column; long sentences are broken."""
    if k >= table.texts:
        return "r"
    return "p{40mm}" if any(len(row[k]) > LONG for row in table.rows) else "l"


def _printable(cell: str) -> str:
    return "".join(LATEX.get(letter, letter) for letter in cell).replace("[us]", r"[$\mu$s]")


def _csv(table: Table) -> str:
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\n").writerows([table.heading, *table.rows])
    return buffer.getvalue().rstrip("\n")
