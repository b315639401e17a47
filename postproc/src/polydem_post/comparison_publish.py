"""Publishes a comparison: one page in Markdown, its figures and its tables, all from the same data."""

from __future__ import annotations

import shutil
from pathlib import Path

from .comparison_report import Contents
from .result_file import cannot_write
from .trajectory import ResultError

#: Page, and folder of the tables beside it
PAGE, TABLES = "README.md", "tables"

#: What stands before the verdicts
HEAD = """# Results of the laboratory on one machine

This page says which claims of Krengel et al. (2026) the laboratory confirms on one machine, with all tables and figures
behind the verdicts. `./polydem paper {mode} --publish` wrote it; do not edit it.

* *Machine*: {machine}; load average of a minute before the samples: least, median, most {load}.
* *Source*: {origin}
* *Comparison*: times of the publication belong to the program and the scenes of its authors, times on this page to
  polydem and its own drums. A verdict judges a statement, not their measurement. Run `./polydem paper` elsewhere, and
  give the folders of both machines to `./polydem tables`: its tables compare them.
* *Elsewhere*: the report of the comparison also holds speed against error and the verification benchmarks, which have
  pages of their own.
"""

#: Beginnings of the names of tables and figures that stand on other pages
ELSEWHERE = ("workprecision", "verification")


def publish(contents: Contents, mode: str, report: Path, folder: Path) -> Path:
    """Write the page of a report, and copy the figures and tables that it shows; return the page."""
    page = folder / PAGE
    if page.exists() and not page.read_text(encoding="utf-8").startswith(HEAD.split("\n", 1)[0]):
        raise ResultError(f"{page}: is another page; choose another folder")
    try:
        (folder / TABLES).mkdir(parents=True, exist_ok=True)
        for old in [*folder.glob("*.png"), *(folder / TABLES).glob("*.csv")]:
            old.unlink()
        for drawing in _here(contents.drawings):
            shutil.copyfile(report / "figures" / f"{drawing.name}.png", folder / f"{drawing.name}.png")
        for name in [*(f"{table.name}.csv" for table in _here(contents.tables)), "revision.txt"]:
            shutil.copyfile(report / "tables" / name, folder / TABLES / name)
        page.write_text(written(contents, mode), encoding="utf-8")
    except OSError as error:
        raise cannot_write(folder, error) from error
    return page


def written(contents: Contents, mode: str) -> str:
    """The page."""
    facts = dict(contents.table("machine").rows)
    machine = ", ".join(facts[name] for name in ("processor", "caches", "compiler", "options") if name in facts)
    load = next((value for name, value in facts.items() if name.startswith("load average")), "not recorded")
    claims = contents.document.split("\n", 2)[2]
    head = HEAD.format(mode=f"--{mode}", machine=machine, load=load, origin=contents.origin)
    lines = [head, claims, "## Figures", ""]
    for drawing in _here(contents.drawings):
        lines += [f"![{drawing.name}]({drawing.name}.png)", "", drawing.caption, ""]
    lines += ["## Tables", "", f"The folder [{TABLES}]({TABLES}) holds all tables as comma-separated values:", "",
              "| file | contents |", "|---|---|"]
    lines += [f"| [{table.name}.csv]({TABLES}/{table.name}.csv) | {table.title} |"
              for table in sorted(_here(contents.tables), key=lambda each: each.name)]
    return "\n".join(lines) + "\n"


def _here(things: list) -> list:
    """Tables or figures that the page shows."""
    return [each for each in things if not each.name.startswith(ELSEWHERE)]
