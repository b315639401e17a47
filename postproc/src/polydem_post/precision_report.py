"""The report of a study of speed against error: tables, figures and a page that begins with the recommendation."""

from __future__ import annotations

from pathlib import Path

from .emit import FORMATS, SUFFIXES
from .precision_samples import ORIGIN
from .precision_tables import all_tables
from .trajectory import ResultError
from .work_precision import read_study

#: Tables that stand on the page itself
ON_THE_PAGE = ("recommendation", "fastest", "overall", "orders", "models", "energy", "left_out", "stopped")


def write_precision_report(folder: Path, figures: bool = True) -> list[Path]:
    """Write report/ in the folder of a study; return the files, the page last."""
    study = read_study(folder)
    output = Path(folder) / "report"
    tables, origin = all_tables(study), origin_of(folder)
    written = []
    try:
        for name in ("tables", "figures"):
            (output / name).mkdir(parents=True, exist_ok=True)
        for table in tables:
            table.origin = origin
            for form in FORMATS:
                written.append(output / "tables" / (table.name + SUFFIXES[form]))
                written[-1].write_text(table.document(form), encoding="utf-8")
        if figures:
            written += _write_figures(study, output / "figures")
        page = output / "workprecision.md"
        shown = [table for table in tables if table.name.removeprefix("workprecision_") in ON_THE_PAGE]
        documents = "\n".join(table.document("markdown") for table in shown)
        page.write_text(f"## Speed against error\n\n{origin}\n\n{documents}", encoding="utf-8")
    except OSError as error:
        raise ResultError(f"{output}: cannot be written ({error})") from error
    return [*written, page]


def origin_of(folder: Path) -> str:
    """Which programs made the samples of a study."""
    try:
        lines = (Path(folder) / ORIGIN).read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    return f"Samples of {'; '.join(lines) or 'a revision that is not recorded'}."


def _write_figures(study, folder: Path) -> list[Path]:
    from .figure_style import save_drawing  # matplotlib takes long to load and tables do not need it
    from .precision_figures import precision_drawings

    drawings = precision_drawings(study)
    captions = folder / "captions.md"
    captions.write_text("\n\n".join(f"**{each.name}** {each.caption}" for each in drawings) + "\n", encoding="utf-8")
    return [path for each in drawings for path in save_drawing(each, folder)] + [captions]
