"""Publishes a comparison: one page in Markdown, its figures and its tables, all from the same data."""

from __future__ import annotations

import shutil
from math import exp, log
from pathlib import Path
from textwrap import wrap

from polydem_post.base.result_file import ResultError, cannot_write

from ..bench.series import SWEEP, TREE
from ..bench.statistics import number
from ..claims.rules_structure import FAILS
from ..claims.verdicts import CONFIRMED, CONTRADICTED, NOT_MEASURED, NOT_TESTABLE, OF_PARTS, PARTS_BELOW
from ..fine_grained.model import OBVIOUS
from .report import Contents

#: Page, and folder of the tables beside it
PAGE, TABLES = "README.md", "tables"

#: The title, by which a page is known
TITLE = "# Results of the laboratory on one machine"

#: Figure that stands beside the answers, and one that no claim names; the others are those behind verdicts
FIRST_FIGURE, ALL_SCENES = "finders_over_size", "all_scenes"

#: What stands behind the answers
HEAD = """## Verdicts

`./polydem paper {mode} --publish` wrote this page with all tables and figures behind the verdicts; do not edit it.

* *Machine*: {machine}; load average of a minute before the samples: least, median, most {load}.
* *Source*: {origin}
* *Comparison*: times of the publication belong to the program and the scenes of its authors, times on this page to
  polydem and its own drums. A verdict judges a statement, not their measurement. Run `./polydem paper` elsewhere, and
  give the folders of both machines to `./polydem tables`: its tables compare them.
"""

#: Beginnings of the names of tables and figures that stand on other pages
ELSEWHERE = ("workprecision", "verification")


def publish(contents: Contents, mode: str, report: Path, folder: Path) -> Path:
    """Write the page of a report, and copy the figures and tables that it shows; return the page."""
    page = folder / PAGE
    if page.exists() and not page.read_text(encoding="utf-8").startswith(TITLE):
        raise ResultError(f"{page}: is another page; choose another folder")
    try:
        (folder / TABLES).mkdir(parents=True, exist_ok=True)
        for old in [*folder.glob("*.png"), *(folder / TABLES).glob("*.csv")]:
            old.unlink()
        for drawing in _behind_verdicts(contents):
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
    _, how, judged, rules = contents.document.split("\n\n", 3)
    head = HEAD.format(mode=f"--{mode}", machine=machine, load=load, origin=contents.origin)
    lines = [TITLE, "", *answers(contents.tables), ""]
    for drawing in contents.drawings:
        if drawing.name == FIRST_FIGURE:
            lines += [f"![{drawing.name}]({drawing.name}.png)", "", drawing.caption, ""]
    lines += [judged, "", head, how, "", rules, "## Figures", ""]
    for drawing in _behind_verdicts(contents):
        if drawing.name == FIRST_FIGURE:
            continue
        lines += [f"![{drawing.name}]({drawing.name}.png)", "", drawing.caption, ""]
    links = ", ".join(f"[{table.name}]({TABLES}/{table.name}.csv)"
                      for table in sorted(_here(contents.tables), key=lambda each: each.name))
    lines += ["## Tables", "", *wrap(f"All tables as comma-separated values: {links}.", 120, break_long_words=False)]
    return "\n".join(lines) + "\n"


def answers(tables: list) -> list[str]:
    """The first lines of the page: which finder to use, how many claims hold, which do, and the fine-grained sweep."""
    found = {table.name: [dict(zip(table.heading, row)) for row in table.rows] for table in tables}
    claims = found["claims"]
    lines = which_finder(found.get("scenes", []))
    whole = [row for row in found["verdicts"] if not row["verdict"].startswith(OF_PARTS)]
    parts = [row for row in found["verdicts"] if row["verdict"].startswith(OF_PARTS)]
    tally = ", ".join(f"{row['number']} {row['verdict']} ({row['claims']})" for row in whole)
    number_of = sum(int(row["number"]) for row in whole)
    lines.append(f"* **Verdicts** on {number_of} claims of Krengel et al. (2026): {tally}.")
    if parts:
        tally = ", ".join(f"{row['number']} {row['verdict'].removeprefix(OF_PARTS)}" for row in parts)
        lines[-1] += f" Of their {sum(int(row['number']) for row in parts)} parts: {tally}."
    for verdict, said in ((CONFIRMED, "The paper is right"), (CONTRADICTED, "The paper is not right here")):
        named = "; ".join(f"{row['says']} ({_named(row, verdict)})" for row in claims
                          if row["verdict"] == verdict and row["claim"][1:].isdigit())
        lines.append(f"* **{said}**: {named or 'no claim as a whole'}.")
    failing = [(row["says"].removeprefix(FAILS), row["verdict"]) for row in claims if row["says"].startswith(FAILS)]
    if failing:
        lines.append("* **The fine-grained parallel sweep fails** (C5): "
                     + "; ".join(f"{verdict} for {what}" for what, verdict in failing) + ".")
    return lines


def _named(row: dict, verdict: str) -> str:
    """A claim, and what was found in its place if it is not right."""
    return f"{row['claim']}: {row['ours']}" if verdict == CONTRADICTED and row["ours"] != PARTS_BELOW else row["claim"]


def which_finder(scenes: list[dict]) -> list[str]:
    """Which finder of runs was the fastest on most scenes, on one thread, and where another one was."""
    names = [name for row in scenes[:1] for name in row
             if name not in ("scene", "boxes", *OBVIOUS) and not name.endswith(("_o2", "_called"))]
    times = {row["scene"]: {name: float(row[name].rstrip("*")) for name in names if row[name] != "-"}
             for row in scenes}
    fastest = {scene: min(here, key=lambda name: here[name]) for scene, here in times.items() if here}
    if not fastest:
        return []
    best = max(names, key=list(fastest.values()).count)
    there = [row for row in scenes if best in times[row["scene"]]]
    won = {name: [row["scene"] for row in there if fastest[row["scene"]] == name] for name in names}
    others = "; ".join(f"`{name}` on {', '.join(found)}" for name, found in won.items() if found and name != best)
    ratios = [here[best] / min(time for name, time in here.items() if name != best)
              for here in times.values() if best in here and len(here) > 1]
    largest = max(there, key=lambda row: int(row["boxes"]))
    told = ", ".join(f"{name} {largest[name].rstrip('*')}" for name in (best, "verlet", SWEEP, TREE)
                      if largest.get(name, "-") != "-")
    lines = [f"* **Which finder**: `{best}`. On one thread it is the fastest on {len(won[best])} of the {len(there)} "
             f"scenes on which it was measured{f'; {others}' if others else ''}."]
    if ratios:
        mean = exp(sum(map(log, ratios)) / len(ratios))
        lines.append(f"* **Why**: it takes {number(mean, 2)} of the time of the best other one (geometric mean of "
                     f"these scenes); on the largest, {largest['scene']}, ns per box and step: {told}.")
    return lines


def _behind_verdicts(contents: Contents) -> list:
    """Figures that the page shows: those that a claim with a verdict names, and two others."""
    named = {FIRST_FIGURE, ALL_SCENES}
    for *_, verdict, where in contents.table("claims").rows:
        if verdict not in (NOT_MEASURED, NOT_TESTABLE):
            named |= set(where.split(", "))
    return [each for each in _here(contents.drawings) if each.name in named]


def _here(things: list) -> list:
    """Tables, or figures, that are not of other pages."""
    return [each for each in things if not each.name.startswith(ELSEWHERE)]
