"""The pages of the manual: README.md is one screen, every page can be reached from it, and links lead somewhere."""

import os
import re
from pathlib import Path

import pytest

ROOT = Path(os.environ["POLYDEM_SOURCE_DIR"])
FOLDERS = ("src", "tests", "inputs", "postproc")
PAGES = [*sorted(ROOT.glob("*.md")), *sorted(page for name in FOLDERS for page in (ROOT / name).rglob("*.md")
                                     if not any(part.startswith(".") for part in page.relative_to(ROOT).parts))]
MOST_LINES = 60
LINK = re.compile(r"\]\(([^)\s]+)\)")
CODE = re.compile(r"^```.*?^```|^    .*?$|`[^`\n]*`", re.MULTILINE | re.DOTALL)


def links_of(page):
    """Targets of the links to files of the repository."""
    links = LINK.findall(CODE.sub("", page.read_text(encoding="utf-8")))
    return [link for link in links if not re.match(r"\w+:", link)]


def anchors_of(page):
    """Anchors of the headings, as GitHub makes them."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    headings = re.findall(r"^#+ +(.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


def broken_links(page):
    """Links of a page to a file or heading that does not exist."""
    broken = []
    for link in links_of(page):
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        if not target.exists() or (anchor and anchor not in anchors_of(target)):
            broken.append(link)
    return broken


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_of_a_page_lead_somewhere(page):
    assert broken_links(page) == []


def test_a_link_to_nowhere_is_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# One: two, three\n[a](#one-two-three) [b](#four) [c](page.md) [d](other.md)\n"
                    "[e](https://example.org)\n\n    [f](code.md)\n", encoding="utf-8")
    assert broken_links(page) == ["#four", "other.md"]


def test_the_readme_is_one_screen():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= MOST_LINES


def test_the_page_of_the_log_explains_every_counter_and_stage():
    sources = [path.read_text(encoding="utf-8") for path in (ROOT / "src").rglob("*.f90")]
    named = {name for text in sources for name in re.findall(r"counters%set\('([^']*[^ '])'", text)}
    for prefix, constant in (("finder ", "count_names(n_counts)"), ("", "stage_names(n_stages)")):
        lists = re.findall(rf":: {re.escape(constant)} = &\n *\[[^]:]*::([^]]*)\]", "".join(sources))
        assert len(lists) == 1
        named |= {prefix + name for name in re.findall(r"'([^']+)'", lists[0])}
    assert len(named) > 40
    page = (ROOT / "inputs/log.md").read_text(encoding="utf-8")
    most = "maximum per rank: "
    assert {name for name in named if f"`{name}`" not in page and f"`{name.removeprefix(most)}`" not in page} == set()


def test_every_page_can_be_reached_from_the_readme():
    reached, new = set(), {ROOT / "README.md"}
    while new:
        page = new.pop()
        reached.add(page)
        targets = {(page.parent / link.partition("#")[0]).resolve() for link in links_of(page) if link[0] != "#"}
        new |= {target for target in targets if target.suffix == ".md" and target.exists()} - reached
    assert {str(page.relative_to(ROOT)) for page in PAGES if page.resolve() not in reached} == set()
