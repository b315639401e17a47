"""Everything that bench folders can give: tables, figures, verdicts, in one folder."""

from __future__ import annotations

from pathlib import Path

from .bench import Bench, read_bench
from .bench_tables import all_tables
from .claims import claims_document, judge_all, verdict_table
from .complexity import SOURCES, complexity_tables
from .emit import FORMATS, SUFFIXES, Table, printable
from .slope_tables import slopes
from .targets import targets
from .trajectory import ResultError

#: File that says what made the numbers of the tables beside it, since CSV has no room for that
ORIGIN = "revision.txt"


def write_report(folders: list, output: Path | None = None, figures: bool = True) -> list[Path]:
    """Write tables/, figures/ and claims.md into `output` (report in the first folder if absent); return the files."""
    bench = read_bench(folders)
    output = Path(output or bench.folders[0] / "report")
    try:
        (output / "tables").mkdir(parents=True, exist_ok=True)
        (output / "figures").mkdir(exist_ok=True)
        written = _write_tables(bench, output / "tables")
        if figures:
            written += _write_figures(bench, output / "figures")
        claims = output / "claims.md"
        claims.write_text(claims_document(bench), encoding="utf-8")
    except OSError as error:
        raise ResultError(f"{output}: cannot be written ({error})") from error
    return [*written, claims]


def tables_of(bench: Bench) -> list[Table]:
    """All tables of a report."""
    wanted = [table for table in [targets(bench.on()), slopes(bench)] if table.rows]
    return [*all_tables(bench), *wanted, *complexity_tables(SOURCES), verdict_table(judge_all(bench))]


def _write_tables(bench: Bench, folder: Path) -> list[Path]:
    written = []
    written.append(folder / ORIGIN)
    written[-1].write_text(f"Tables in this folder: {printable(bench.origin)}\n", encoding="utf-8")
    for table in tables_of(bench):
        table.origin = bench.origin
        for form in FORMATS:
            path = folder / (table.name + SUFFIXES[form])
            path.write_text(table.document(form), encoding="utf-8")
            written.append(path)
    return written


def _write_figures(bench: Bench, folder: Path) -> list[Path]:
    from .bench_figures import bench_drawings  # matplotlib takes long to load and tables do not need it
    from .figure_style import save_drawing
    from .paper_figures import paper_drawings

    drawings = [*paper_drawings(bench), *bench_drawings(bench)]
    captions = folder / "captions.md"
    captions.write_text("\n\n".join(f"**{each.name}** {each.caption}" for each in drawings) + "\n", encoding="utf-8")
    return [path for each in drawings for path in save_drawing(each, folder)] + [captions]
