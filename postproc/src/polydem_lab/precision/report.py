"""The report of a study of speed against error: tables, figures and a page that begins with the recommendation."""

from __future__ import annotations

from pathlib import Path

from polydem_post.base.result_file import cannot_write

from ..report.files import write_figures, write_tables
from .samples import ORIGIN
from .tables import all_tables
from .work_precision import read_study

#: Tables that stand on the page itself
ON_THE_PAGE = ("recommendation", "fastest", "overall", "orders", "models", "energy", "left_out", "stopped")


def write_precision_report(folder: Path, figures: bool = True) -> list[Path]:
    """Write report/ in the folder of a study; return the files, the page last."""
    study = read_study(folder)
    output = Path(folder) / "report"
    tables, origin = all_tables(study), origin_of(folder)
    try:
        written = write_tables(tables, output / "tables", origin)
        if figures:
            from .figures import precision_drawings  # matplotlib takes long to load

            written += write_figures(precision_drawings(study), output / "figures")
        page = output / "workprecision.md"
        shown = [table for table in tables if table.name.removeprefix("workprecision_") in ON_THE_PAGE]
        documents = "\n".join(table.document("markdown") for table in shown)
        page.write_text(f"## Speed against error\n\n{origin}\n\n{documents}", encoding="utf-8")
    except OSError as error:
        raise cannot_write(output, error) from error
    return [*written, page]


def origin_of(folder: Path) -> str:
    """Which programs made the samples of a study."""
    try:
        lines = (Path(folder) / ORIGIN).read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    return f"Samples of {'; '.join(lines) or 'a revision that is not recorded'}."
