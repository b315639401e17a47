"""Published tables name the revision of the program that made their numbers, and it is one of this repository."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from polydem_lab.comparison.publish import TITLE, answers
from polydem_lab.report.fine_grained_figures import sixteen, what_fails
from polydem_post.base.emit import Table
from published_numbers import REVISION, disagreements, rows_of

ROOT = Path(os.environ["POLYDEM_SOURCE_DIR"])

#: Pages with numbers that a run of the program made, and files beside tables that have no room for words
PAGES = [
    "inputs/beverloo.md",
    "inputs/biaxial.md",
    "inputs/performance.md",
    "postproc/verdicts/README.md",
    "postproc/verdicts/precision/README.md",
    "postproc/verdicts/rivals/tables.md",
    "postproc/verdicts/rivals/tables/revision.txt",
    "postproc/verdicts/scale/README.md",
    "postproc/verdicts/tables/revision.txt",
    "tests/equality/bits.md",
    "tests/ranks/equality.md",
    "tests/verification/README.md",
]

#: Pages whose tables hold no measured numbers of one run: manuals, and lists of cases with the tests that check them
OTHERS = {
    "README.md",
    "inputs/README.md",
    "inputs/accuracy.md",
    "inputs/bench/README.md",
    "inputs/bench/entries.md",
    "inputs/checks.md",
    "inputs/entries.md",
    "inputs/glossary.md",
    "inputs/how_to.md",
    "inputs/actions.md",
    "inputs/library.md",
    "inputs/log.md",
    "inputs/parts.md",
    "inputs/stages.md",
    "inputs/walls.md",
    "postproc/verdicts/rivals/README.md",
    "src/README.md",
    "src/algorithms.md",
    "src/contributing.md",
    "src/packaging/README.md",
    "src/recipes.md",
    "src/recipes_scenes.md",
    "src/theory.md",
    "src/theory_motion.md",
    "tests/README.md",
    "tests/faults.md",
    "tests/hard_cases.md",
    "tests/invariances/README.md",
}

@pytest.mark.parametrize("page", PAGES)
def test_a_page_with_measured_tables_names_a_revision_of_this_repository(page):
    found = REVISION.findall((ROOT / page).read_text(encoding="utf-8"))
    assert found, page
    asked = subprocess.run(["git", "-C", str(ROOT), "rev-parse", "--verify", "HEAD"], capture_output=True, check=False)
    if asked.returncode != 0 or (ROOT / ".git" / "shallow").exists():
        pytest.skip("not a whole clone of the repository: whether the revision is one of it cannot be asked")
    for revision in found:
        command = ["git", "-C", str(ROOT), "cat-file", "-e", f"{revision}^{{commit}}"]
        assert subprocess.run(command, check=False).returncode == 0, revision


def test_no_page_with_tables_is_forgotten():
    folders = [ROOT / name for name in ("inputs", "postproc/verdicts", "src", "tests")]
    pages = [ROOT / "README.md", *(page for folder in folders for page in folder.rglob("*.md"))]
    pages = [page for page in pages if re.search(r"^\|[ :-]*---", page.read_text(encoding="utf-8"), re.MULTILINE)]
    with_tables = {str(page.relative_to(ROOT)) for page in pages}
    assert with_tables == {page for page in PAGES if page.endswith(".md")} | OTHERS


# --- Tables and texts agree -------------------------------------------------------------------------------------------

VERDICTS = ROOT / "postproc" / "verdicts"


def test_the_page_of_verdicts_says_what_its_tables_say():
    assert disagreements(VERDICTS) == []


@pytest.mark.parametrize("name, old, new", [
    ("README.md", "| confirmed |", "| contradicted |"),
    ("README.md", "*Verdict:* confirmed.", "*Verdict:* undecided."),
    ("README.md", "](tables/times.csv)", "](tables/other.csv)"),
    ("tables/claims.csv", ",confirmed,", ",undecided,"),
    ("tables/reasons.csv", "C2,", "C2,not "),
    ("tables/revision.txt", "revision ", "revision 0123456, revision "),
])
def test_a_page_that_its_tables_contradict_is_found(tmp_path, name, old, new):
    shutil.copytree(VERDICTS, tmp_path / "verdicts")
    path = tmp_path / "verdicts" / name
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    assert disagreements(tmp_path / "verdicts") != []


def test_the_page_of_verdicts_begins_with_the_answers_that_follow_from_its_tables():
    tables = []
    for name in ("claims", "verdicts", "scenes"):
        rows = rows_of(VERDICTS / "tables" / f"{name}.csv")
        tables.append(Table(name, "", tuple(rows[0]), [tuple(row.values()) for row in rows]))
    found = answers(tables)
    page = (VERDICTS / "README.md").read_text(encoding="utf-8")
    assert page.splitlines()[: 2 + len(found)] == [TITLE, "", *found] and len(found) <= 8
    assert found[0].startswith("* **Which finder**: `two_level`")
    after = page.splitlines()[3 + len(found):]
    assert after[0] == "![finders_over_size](finders_over_size.png)" and after[4].startswith("| claim |")


def test_claims_of_several_parts_follow_from_the_verdicts_on_them():
    rows = rows_of(VERDICTS / "tables" / "claims.csv")
    for row in rows:
        parts = [part["verdict"] for part in rows if re.fullmatch(row["claim"] + "[a-z]", part["claim"])]
        if parts:
            assert row["ours"] == "by part"
            both = {"confirmed", "contradicted"} <= set(parts)
            one = parts[0] if len(set(parts)) == 1 else "undecided"
            assert row["verdict"] == ("confirmed in part" if both else one), row["claim"]
    assert sum(len(row["claim"]) > 3 or row["claim"][-1].isalpha() for row in rows) >= 25


def test_the_fine_grained_sweeps_are_judged_and_drawn_from_one_machine():
    """Finds gains of four threads beside a figure in which four threads lose, and numbers of a model in its caption."""
    rows = rows_of(VERDICTS / "tables" / "claims.csv")
    gains = rows_of(VERDICTS / "tables" / "fine_grained_gains.csv")
    judged = [row for row in rows if row["says"].startswith("it fails: ")]
    assert [row["claim"] for row in judged] == ["C5a", "C5b", "C5c", "C5d"]
    for row in judged:
        finder, told = row["ours"].split(" ", 1)
        expected = ", ".join(f"{gain['boxes']} boxes, {gain['threads']} threads: {gain['times as fast']}"
                             for gain in gains if gain["finder"] == finder and gain["scene"].endswith("_normal")
                             and gain["threads"] == gain["processors"])
        assert told == expected
    page = (VERDICTS / "README.md").read_text(encoding="utf-8")
    table = Table("fine_grained_gains", "", tuple(gains[0]), [tuple(row.values()) for row in gains])
    assert what_fails(table).caption in page.splitlines()


def test_the_page_says_from_which_size_on_the_tree_wins():
    claim, = (row for row in rows_of(VERDICTS / "tables" / "claims.csv") if row["claim"] == "C2")
    told = dict(re.findall(r"(\d+) boxes ([\d.]+)", claim["ours"].split("tree wins): ")[1]))
    for row in rows_of(VERDICTS / "tables" / "scenes.csv"):
        if re.fullmatch(r"drum_\d+", row["scene"]) and row["boxes"] in told:
            ratio = float(row["quadtree"].rstrip("*")) / float(row["sort_and_sweep"].rstrip("*"))
            assert float(told[row["boxes"]]) == pytest.approx(ratio, rel=0.05)
    assert [size for size, ratio in told.items() if float(ratio) < 1.0] == ["300000", "1000000"]
    assert claim["ours"] in (VERDICTS / "README.md").read_text(encoding="utf-8").split("![")[0]


def test_times_on_sixteen_threads_are_those_of_the_page_that_they_name():
    text = (ROOT / "inputs" / "performance.md").read_text(encoding="utf-8")
    assert len(sixteen()) == 20
    for boxes in ("12 651", "100 000"):
        for finder in ("quadtree", "partitioned_sweep"):
            drum = (boxes.replace(" ", ""), finder)
            times = [row["ns"] for row in sixteen() if (row["boxes"], row["finder"]) == drum]
            assert f"| {boxes}, `{finder}` | {' | '.join(times)} |" in text


def test_the_exponents_in_the_text_on_performance_are_those_of_the_published_table():
    text = (ROOT / "inputs" / "performance.md").read_text(encoding="utf-8")
    tree, sweep = re.search(r"give N\^([\d.]+) and N\^([\d.]+) \(\[all exponents\]", " ".join(text.split())).groups()
    slopes = {row["finder"]: row for row in rows_of(VERDICTS / "tables" / "slopes.csv") if row["scenes"] == "drum"}
    for said, finder in ((tree, "quadtree"), (sweep, "sort_and_sweep")):
        assert float(said) == pytest.approx(float(slopes[finder]["all sizes"].split()[0]) - 1.0, abs=0.006)


def test_the_error_of_the_model_of_the_fine_grained_sweep_in_the_text_is_that_of_its_table():
    page = (VERDICTS / "README.md").read_text(encoding="utf-8")
    rows = rows_of(VERDICTS / "tables" / "fine_grained_error.csv")
    most = max(int(row["threads"]) for row in rows)
    errors = ", ".join(f"{row['finder']} {row['and fetching']}" for row in rows if int(row["threads"]) == most)
    # In C5; the figure is of another machine, which has no model.
    assert len(re.findall(re.escape(f"of the model with {most} threads: {errors}."), page)) == 1
    limits = rows_of(VERDICTS / "tables" / "fine_grained_limits.csv")
    for row in limits:
        said = re.search(rf"\b{row['scene']} (?:not|from \d+) \(model: ([^)]*)\)", page)
        assert said[1] == row["loses from, model"].replace("from ", ""), row["scene"]
