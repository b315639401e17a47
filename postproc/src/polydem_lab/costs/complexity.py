"""Cyclomatic complexity of the finders, counted by the tool lizard (https://github.com/terryyin/lizard).

A finder is made of the file that has its name, of the files whose modules that one uses, directly or not, and of
the files they include. What all finders share (the list of pairs, the counters) is no part of any of them.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from polydem_post.base.emit import Table

from ..bench.paper import COMPLEXITY

#: Where the sources of the finders are: this package stands beside them in the repository
SOURCES = Path(__file__).resolve().parents[4] / "src" / "neighbours" / "finders"

#: What to do when the tool is not there
HOW_TO_GET = "the tool lizard: .venv/bin/pip install --editable './postproc[complexity]'"

#: What lizard does not see, found by trial with version 1.24
BLIND_SPOTS = (
    "Blind spots of lizard: `else if` in two words, `select type` and `where` are not counted; `select case` counts "
    "every case, the default too, and one more; .and. and .or. count. A procedure in an included file is counted once "
    "for every finder that includes it."
)

#: Modules that all finders share, or that only variants of a finder use
SHARED = {"finder_factory", "neighbours", "filtered_candidates"}

#: Part of Table 3 -> beginnings of the names of procedures; what is of no part updates the structure
INITIALIZATION = re.compile(r"(start|begin|build|new_|make|prepare|set_up|reserve|first|finest|initial|choose|create)")
LIST = re.compile(
    r"(search|judge|meet|compare|replace|is_new|ancestor|partners|record|candidates|scan|test|visit|walk|"
    r"filter|overlap|find_pairs|list|collect|drop|keep|look|enter)"
)
#: Files that are about the list as a whole
LIST_FILES = re.compile(r"candidates|.*search")
#: Procedures that only report
REPORTING = re.compile(r"survey|bytes")

USE = re.compile(r"^\s*use\s*(?:,\s*intrinsic\s*::)?\s*polydem_(\w+)", re.IGNORECASE | re.MULTILINE)
INCLUDE = re.compile(r"^\s*include\s+['\"]([^'\"]+)['\"]", re.IGNORECASE | re.MULTILINE)


@dataclass(frozen=True)
class Procedure:
    """One counted procedure."""

    file: str
    name: str
    complexity: int

    @property
    def part(self) -> str:
        """Part of Table 3 that it belongs to, judged by its name."""
        if REPORTING.match(self.name):
            return ""
        if INITIALIZATION.match(self.name):
            return "initialization"
        of_list = LIST_FILES.match(self.file) or LIST.match(self.name)
        return "updating contact list" if of_list else "updating data structure"


def counter():
    """The tool, or nothing if it is not installed."""
    try:
        import lizard
    except ImportError:
        return None
    return lizard


def sources_of(finder: str, folder: Path) -> list[Path]:
    """The files that make a finder, its own first; empty if there is no such finder."""
    files = {path.name: path for path in folder.rglob("*") if path.is_file()}
    found, waiting = [], [f"{finder}.f90"]
    while waiting:
        path = files.get(waiting.pop(0))
        if path in found or path is None:
            continue
        found.append(path)
        text = path.read_text(encoding="utf-8")
        waiting += INCLUDE.findall(text)
        waiting += [f"{name}.f90" for name in USE.findall(text) if name not in SHARED]
    return found


@cache
def procedures_of(path: Path) -> list[Procedure]:
    """The procedures of a file, included ones not among them."""
    tool = counter()
    # The name tells lizard the language, also that of an included piece of a module.
    counted = tool.analyze_file.analyze_source_code(f"{path.stem}.f90", path.read_text(encoding="utf-8"))
    return [
        Procedure(path.name, function.name.split("::")[-1], function.cyclomatic_complexity)
        for function in counted.function_list
    ]


def count_finder(finder: str, folder: Path) -> list[Procedure]:
    """The procedures of all files of a finder."""
    return [procedure for path in sources_of(finder, folder) for procedure in procedures_of(path)]


def finders_in(folder: Path) -> list[str]:
    """Finders that have a file of their own."""
    types = re.compile(r"extends\(finder_t\)", re.IGNORECASE)
    found = []
    for path in sorted(folder.rglob("*.f90"), key=lambda path: path.name):
        texts = [path.read_text(encoding="utf-8")]
        texts += [
            (path.parent / name).read_text(encoding="utf-8")
            for name in INCLUDE.findall(texts[0])
            if (path.parent / name).is_file()
        ]
        if path.stem not in SHARED and any(types.search(text) for text in texts):
            found.append(path.stem)
    return found


def totals(finder: str, folder: Path) -> dict:
    """Part of Table 3 -> sum over the procedures of a finder; empty if it cannot be counted."""
    if counter() is None:
        return {}
    procedures = count_finder(finder, folder)
    sums = {part: sum(p.complexity for p in procedures if p.part == part) for part in COMPLEXITY}
    sums["total"] = sum(p.complexity for p in procedures)
    return sums if procedures else {}


def complexity_tables(folder: Path) -> list[Table]:
    """Table 3 with ours beside the paper's, and all finders by file; only a note if lizard is missing."""
    tool = counter()
    table = Table(
        "table_3",
        "Table 3: cyclomatic complexity of the paper's programs and of ours",
        ("part", "sweep, paper", "sort_and_sweep", "tree inlined, paper", "tree not inlined, paper", "quadtree"),
    )
    if tool is None:
        table.note = f"It needs {HOW_TO_GET}"
        return [table]
    if not folder.is_dir():
        table.note = f"The sources of the finders are not where this package expects them: {folder}"
        return [table]
    sweep, tree = totals("sort_and_sweep", folder), totals("quadtree", folder)
    for part, (a, b, c) in COMPLEXITY.items():
        table.add(part, a, sweep.get(part, "-"), b, c, tree.get(part, "-"))
    version = getattr(tool, "version", "of unknown version")
    table.note = (
        f"Counted by lizard {version}. Our procedures are assigned to the parts by their files and the beginnings "
        "of their names, reporting ones only to the total. quadtree inlined or not is one source: the compiler "
        "inlines, so "
        f"both have the same complexity. The filter of filtered_quadtree does not count. {BLIND_SPOTS}"
    )
    return [table, _by_file(folder, version)]


def _by_file(folder: Path, version: str) -> Table:
    table = Table(
        "complexity",
        "Cyclomatic complexity of all finders, by file",
        ("finder", "file", "procedures", "sum", "greatest", "most complex procedure"),
    )
    for finder in finders_in(folder):
        everything = count_finder(finder, folder)
        rows = [(path.name, [p for p in everything if p.file == path.name]) for path in sources_of(finder, folder)]
        for name, procedures in [("all", everything), *rows]:
            if procedures:
                worst = max(procedures, key=lambda p: p.complexity)
                table.add(
                    finder, name, len(procedures), sum(p.complexity for p in procedures), worst.complexity, worst.name
                )
    table.note = f"Counted by lizard {version}. {BLIND_SPOTS}"
    return table
