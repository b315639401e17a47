"""The report of a comparison with other codes: tables, figures and a page."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

from polydem_post.base.result_file import cannot_write

from ..report.files import ORIGIN as REVISION
from ..report.files import write_figures, write_tables
from .points import Comparison, read_comparison
from .tables import all_tables

#: Tables that are too long for the page, which links to them
NOT_ON_THE_PAGE = ("rivals_cheapest", "rivals_stiffness", "rivals_collective", "rivals_spread", "rivals_points",
                   "rivals_seeds")

#: Name of the page in a report, and of the one that is published; the figures that are
PAGE, PUBLISHED = "rivals.md", "tables.md"
PUBLISHED_FIGURES = ("rivals_all", "rivals_profile", "rivals_collective", "rivals_requested")


def write_rivals_report(folder: Path, figures: bool = True) -> list[Path]:
    """Write report/ in the folder of a study; return the files, the page last."""
    found = read_comparison(folder)
    output = Path(folder) / "report"
    tables, origin = all_tables(found, folder), origin_of(found)
    try:
        written = write_tables(tables, output / "tables", origin)
        if figures:
            from .figures import rivals_drawings  # matplotlib takes long to load

            written += write_figures(rivals_drawings(found, folder), output / "figures")
        page = output / PAGE
        shown = [replace(table, origin="").document("markdown") for table in tables
                 if table.name not in NOT_ON_THE_PAGE]
        page.write_text("# Tables of speed against error beside other codes\n\n`./polydem rivals` made this page. The "
                        "folder [tables](tables) has all tables, also times for an error, errors over stiffness, "
                        f"means over\nseeds, and every point. {origin}\n\n"
                        + "\n".join(shown).replace("\n### ", "\n## ").replace("### ", "## ", 1), encoding="utf-8")
    except OSError as error:
        raise cannot_write(output, error) from error
    return [*written, page]


def origin_of(found: Comparison) -> str:
    """Which programs made the points."""
    return f"Points of {'; '.join(found.versions)}."


def publish(folder: Path, place: Path) -> Path:
    """Copy page, tables (CSV) and some figures (PNG) of a report to where the manual shows them; the page."""
    report = Path(folder) / "report"
    try:
        (place / "tables").mkdir(parents=True, exist_ok=True)
        for path in [*sorted((report / "tables").glob("*.csv")), report / "tables" / REVISION]:
            shutil.copyfile(path, place / "tables" / path.name)
        for name in PUBLISHED_FIGURES:
            if (report / "figures" / f"{name}.png").exists():
                shutil.copyfile(report / "figures" / f"{name}.png", place / f"{name}.png")
        shutil.copyfile(report / PAGE, place / PUBLISHED)
    except OSError as error:
        raise cannot_write(place, error) from error
    return place / PUBLISHED
