"""Everything that bench folders can give: tables, figures, verdicts, in one folder."""

from __future__ import annotations

from pathlib import Path

from polydem_post.base.emit import Table
from polydem_post.base.result_file import cannot_write

from ..bench.samples import Bench, read_bench
from ..claims.judge import claims_document, judge_all
from ..claims.own_scenes import skipped
from ..claims.targets import targets
from ..claims.verdicts import reasons_table, verdict_table
from ..costs.complexity import SOURCES, complexity_tables
from ..tables.bench_tables import all_tables
from ..tables.fine_grained_tables import fine_grained_tables
from ..tables.slope_tables import local_exponents, slopes
from .files import write_figures, write_tables


def write_report(folders: list, output: Path | None = None, figures: bool = True) -> list[Path]:
    """Write tables/, figures/ and claims.md into `output` (report in the first folder if absent); return the files."""
    bench = read_bench(folders)
    output = Path(output or bench.folders[0] / "report")
    judged = judge_all(bench)
    try:
        drawn = drawings_of(bench) if figures else []
        written = write_tables([*tables_of(bench, judged), skipped(bench, judged, drawn)], output / "tables",
                               bench.origin)
        if figures:
            written += write_figures(drawn, output / "figures")
        claims = output / "claims.md"
        claims.write_text(claims_document(bench, judged), encoding="utf-8")
    except OSError as error:
        raise cannot_write(output, error) from error
    return [*written, claims]


def tables_of(bench: Bench, judged: list) -> list[Table]:
    """All tables of a report that have rows, and those of the verdicts."""
    here = bench.on()
    wanted = [targets(here), slopes(bench), local_exponents(bench), *fine_grained_tables(here)]
    return [*all_tables(bench), *(table for table in wanted if table.rows), *complexity_tables(SOURCES),
            verdict_table(judged), reasons_table(judged)]


def drawings_of(bench: Bench) -> list:
    """All figures of a report."""
    from .bench_figures import bench_drawings  # matplotlib takes long to load and tables do not need it
    from .fine_grained_figures import fine_grained_drawings
    from .own_figures import own_drawings
    from .paper_figures import paper_drawings

    return [*paper_drawings(bench), *bench_drawings(bench), *fine_grained_drawings(bench), *own_drawings(bench)]
