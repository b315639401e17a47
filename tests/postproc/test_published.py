"""Published tables name the revision of the program that made their numbers, and it is one of this repository."""

import os
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(os.environ["POLYDEM_SOURCE_DIR"])

#: Pages with numbers that a run of the program made, and files beside tables that have no room for words
PAGES = [
    "inputs/bench/README.md",
    "inputs/performance.md",
    "postproc/verdicts/README.md",
    "postproc/verdicts/precision/README.md",
    "postproc/verdicts/scale/README.md",
    "postproc/verdicts/tables/revision.txt",
    "tests/equality/bits.md",
    "tests/ranks/equality.md",
    "tests/verification/README.md",
    "tests/verification/results.md",
]

#: Pages whose tables hold no measured numbers of one run: manuals, and lists of cases with the tests that check them
OTHERS = {
    "inputs/README.md",
    "inputs/getting_started.md",
    "src/README.md",
    "src/algorithms.md",
    "tests/README.md",
    "tests/faults.md",
    "tests/hard_cases.md",
    "tests/verification/reference/README.md",
}

REVISION = re.compile(r"(?:revision|git|with|polydem [\d.]+ \(revision)[:\s]+([0-9a-f]{7,40})\b", re.IGNORECASE)


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
