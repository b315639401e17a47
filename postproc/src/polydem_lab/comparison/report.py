"""The report of the comparison: all tables and figures in all forms, and one page that needs nothing else."""

from __future__ import annotations

import csv
from dataclasses import dataclass, field
from pathlib import Path

from polydem_post.base.emit import Table
from polydem_post.base.result_file import ResultError, cannot_write

from ..bench.samples import read_bench
from ..bench.statistics import number
from ..claims.judge import claims_document, judge_all
from ..claims.own_scenes import skipped
from ..claims.verdicts import counts_table, of_quick
from ..precision.report import origin_of
from ..report.bench_report import drawings_of, tables_of
from ..report.files import write_figures, write_tables
from .bench_file import BenchFile
from .html_page import Page
from .published import published_table
from .run import Comparison

#: Benches whose times mean nothing
UNTIMED = ("verify",)

#: Sections of the page: title, tables and figures by their names or the beginnings of these
SECTIONS = (
    ("Finders over size", ("slopes", "local_exponents", "times", "phases", "counters", "targets", "live", "scale",
                           "figure_09", "figure_10", "finders_over_size", "work_over_size", "figure_01")),
    ("Scenes and motion", ("scenes", "first_step", "own_over_size", "all_scenes")),
    ("Threads: the fine-grained sweep beside the tree", ("fine_grained", "waiting", "speed_up")),
    ("Structure, inlining and memory", ("table_2", "table_3", "complexity", "list_cost", "cache", "figure_11",
                                        "figure_12", "builds")),
    ("Machines", ("machine", "table_1", "figure_08_13")),
    ("Speed against error", ("workprecision_recommendation", "workprecision")),
    ("Verification", ("verification",)),
    ("What was made, and what was not", ("pieces", "skipped", "published_points")),
)

#: Tables whose contents the first section has
FIRST = ("claims", "reasons", "verdicts")

#: Beginnings of what the page says of the machine at its head
SHORTLY = ("processor", "caches", "cores used", "compiler", "load average")


@dataclass
class Contents:
    """Everything that stands in a report."""

    origin: str
    judged: list
    tables: list = field(default_factory=list)
    drawings: list = field(default_factory=list)
    document: str = ""

    def table(self, name: str) -> Table:
        """A table by its name."""
        return next(table for table in self.tables if table.name == name)


def write_comparison(comparison: Comparison, contents: Contents, output: Path) -> Path:
    """Write tables/, figures/, claims.md and report.html of what has been made; return the page."""
    try:
        write_tables(contents.tables, output / "tables", contents.origin)
        write_figures(contents.drawings, output / "figures")
        (output / "claims.md").write_text(contents.document, encoding="utf-8")
        page = output / "report.html"
        page.write_text(page_of(contents, comparison, output / "figures"), encoding="utf-8")
    except OSError as error:
        raise cannot_write(output, error) from error
    return page


def collect(comparison: Comparison, others=()) -> Contents:
    """Read what the pieces left, as far as they are there, and the benches of other machines behind them."""
    folders = [comparison.folder / piece.name for piece in comparison.pieces
               if isinstance(piece.bench, BenchFile) and piece.name not in UNTIMED
               and any((comparison.folder / piece.name / "samples").glob("*.h5"))]
    if not folders:
        raise ResultError(f"{comparison.folder}: no bench has left samples, so there is nothing to report")
    for other in others:
        found = sorted(path.parent for path in other.glob("*/*/samples") if path.parent.name not in UNTIMED)
        if not found:
            raise ResultError(f"{other}: holds no benches of ./polydem paper (MODE/BENCH/samples)")
        folders += found
    bench = read_bench(folders)
    judged = judge_all(bench)
    if comparison.mode != "full":
        judged = of_quick(judged)
    contents = Contents(bench.origin, judged, document=claims_document(bench, judged))
    contents.drawings = drawings_of(bench)
    contents.tables = [*tables_of(bench, judged), skipped(bench, judged, contents.drawings), counts_table(judged),
                       published_table(bench), machine_table(bench, comparison), pieces_table(comparison)]
    _add_precision(contents, comparison.folder / "precision")
    _add_verification(contents, comparison.folder / "verification" / "results" / "verify" / "table.csv", comparison)
    return contents


def _add_precision(contents: Contents, folder: Path) -> None:
    """Tables and figures of speed against error."""
    if not (folder / "samples.csv").exists():
        return
    from ..precision.figures import precision_drawings
    from ..precision.tables import all_tables
    from ..precision.work_precision import read_study

    try:
        study = read_study(folder)
        tables, drawings = all_tables(study), precision_drawings(study)
    except ResultError:
        return  # a study that was cut off before it had a reference; the table of pieces says so
    for table in tables:
        table.origin = origin_of(folder)
    contents.tables += tables
    contents.drawings += drawings


def _add_verification(contents: Contents, path: Path, comparison: Comparison) -> None:
    """The rows of the verification benchmarks."""
    if not path.exists():
        return
    with path.open(newline="", encoding="utf-8") as file:
        heading, *rows = list(csv.reader(file))
    table = Table("verification", "Verification: runs against theory and publications", tuple(heading), texts=2)
    table.note = "Good: within its tolerance; shown: a number without a tolerance, to be looked at."
    for row in rows:
        table.add(*row)
    verdicts = [row[-1] for row in rows]
    summary = Table("verification_summary", "Verification: rows by result", ("result", "rows"))
    for verdict in dict.fromkeys(verdicts):
        summary.add(verdict, verdicts.count(verdict))
    summary.note = table.note
    for each in (summary, table):
        each.origin = f"Benchmarks of {comparison.state['base']['program']}."
    contents.tables += [summary, table]


def machine_table(bench, comparison: Comparison) -> Table:
    """The machine on which all was measured."""
    table = Table("machine", "The machine", ("what", "value"), texts=2)
    facts = bench.cases[0].provenance
    for name in ("host", "processor", "processors", "caches", "memory", "clock", "compiler", "options", "build_type",
                 "instruction_set", "precision", "binding", "wait_policy", "hdf5", "version", "revision"):
        if facts.get(name) not in (None, ""):
            table.add(name.replace("_", " "), facts[name])
    loads = [float(sample.case["load"]) for case in bench.select() for sample in case.samples if "load" in sample.case]
    if loads:
        table.add("load average of a minute before the samples: least, median, most",
                  ", ".join(number(sorted(loads)[k], 2) for k in (0, len(loads) // 2, -1)))
    table.add("cores used", comparison.cores)
    return table


def pieces_table(comparison: Comparison) -> Table:
    """What was made, and how long it took."""
    table = Table("pieces", f"Pieces of the {comparison.mode} comparison", ("piece", "what", "state", "seconds"),
                  texts=3)
    for piece in comparison.pieces:
        table.add(piece.name, piece.purpose, comparison.status(piece), number(comparison.seconds(piece), 3))
    table.note = (
        "cut: the time was over, and what had been measured counts; missing: there was no time for it; "
        "left out: by --without."
    )
    return table


# --- The page ---------------------------------------------------------------------------------------------------------


def page_of(contents: Contents, comparison: Comparison, figures: Path) -> str:
    """report.html"""
    page = Page(f"Neighbour search in 2-D DEM: the {comparison.mode} comparison")
    page.paragraph(contents.origin)
    page.paragraph(". ".join(f"{name[0].upper()}{name[1:]}: {value}" for name, value in contents.table("machine").rows
                             if name.startswith(SHORTLY)) + ".", ("machine",))
    page.paragraph("The claims are those of Krengel, Watanabe, Kandori, Chen and Matuttis (2026), tree codes and "
                   "sort-and-sweep algorithms for neighbourhood computation. A verdict judges a statement by samples "
                   "of this program on this machine, not their measurement.")
    page.heading("Verdicts on the claims")
    counts = contents.table("verdicts")
    for verdict, count, named in counts.rows:
        page.paragraph(f"{count} ({named})", ("verdicts",), f"{verdict}:")
    page.table(contents.table("claims"), is_open=True)
    for each, finding in contents.judged:
        page.paragraph(f"{each.text}. Rule: {each.threshold}. {finding.reason}", ("claims", "reasons"),
                       f"{each.id}, {finding.verdict}.")
    shown = set(FIRST)
    for title, names in SECTIONS:
        _add_section(page, contents, title, names, figures, shown)
    rest = [table.name for table in contents.tables if table.name not in shown]
    rest += [drawing.name for drawing in contents.drawings if drawing.name not in shown]
    if rest:
        _add_section(page, contents, "Further tables and figures", tuple(rest), figures, shown)
    return page.written()


def _add_section(page: Page, contents: Contents, title: str, names: tuple, figures: Path, shown: set) -> None:
    """Figures, then tables, whose names begin as the section says and that no earlier section has."""
    drawings = [each for each in contents.drawings if each.name.startswith(names) and each.name not in shown]
    tables = [each for each in contents.tables if each.name.startswith(names) and each.name not in shown and each.rows]
    if not drawings and not tables:
        return
    page.heading(title)
    for drawing in drawings:
        page.figure(drawing.name, figures / f"{drawing.name}.svg", drawing.caption)
    for table in tables:
        page.table(table, is_open=len(table.rows) <= 12)
    shown.update(each.name for each in (*drawings, *tables))
