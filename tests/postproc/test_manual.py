"""The manual: all pages in one site that opens from a folder, with equations and a search; broken links are errors."""

import json
import re
import shutil
import subprocess

import pytest
from test_pages import PAGES, ROOT

pytest.importorskip("mkdocs", reason="the manual needs pip install -e 'postproc[manual]'")
pytest.importorskip("material", reason="the manual needs pip install -e 'postproc[manual]'")

from polydem_post.manual.site import ManualError, build_site
from polydem_post.manual.sources import build_sources
from polydem_post.manual.staging import stage

#: What a browser would fetch from elsewhere
FETCHED = re.compile(r"""<(script|img|iframe)[^>]*\bsrc=["']?(https?:)?//|<link[^>]*stylesheet[^>]*(https?:)?//""")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The manual of the repository."""
    folder = tmp_path_factory.mktemp("manual")
    build_site(ROOT, folder)
    return folder


def small_root(folder, text):
    """A repository of one page."""
    folder.mkdir()
    (folder / "README.md").write_text(text, encoding="utf-8")
    return folder


def html_of(page, site):
    """Page of the site for a page of the repository."""
    name = page.relative_to(ROOT)
    return site / (name.with_name("index.html") if name.name == "README.md" else name.with_suffix(".html"))


def test_every_page_is_in_the_site_and_in_the_search(site):
    missing = [page for page in PAGES if not html_of(page, site).exists()]
    assert missing == []
    found = {entry["location"].partition("#")[0]
             for entry in json.loads((site / "search" / "search_index.json").read_text(encoding="utf-8"))["docs"]}
    assert {str(html_of(page, site).relative_to(site)) for page in PAGES} <= found


def test_the_search_finds_words_of_names(site):
    """Finds that `inertial_number` is one word, which a search for its words does not meet."""
    index = json.loads((site / "search" / "search_index.json").read_text(encoding="utf-8"))
    plain = {entry["location"]: re.sub(r"<[^>]*>|[^\w\s-]", " ", entry["text"]).lower() for entry in index["docs"]}
    found = {location for location, text in plain.items()
             if {"inertial", "number"} <= set(re.split(index["config"]["separator"], text))}
    assert {"inputs/walls.html#series", "inputs/glossary.html", "inputs/cells.html#a-stress-controlled-cell",
            "postproc/analysis.html"} <= found


def test_the_site_fetches_nothing(site):
    assert [page for page in site.rglob("*.html") if FETCHED.search(page.read_text(encoding="utf-8"))] == []


def test_lists_are_lists_and_tables_are_tables(site):
    for page in PAGES:
        text = re.sub(r"<(pre|code)\b.*?</\1>", "", html_of(page, site).read_text(encoding="utf-8"), flags=re.DOTALL)
        assert not re.search(r"^(<p>)?(\* |\| |```|\|--)", text, re.MULTILINE), page


def test_equations_become_mathml(tmp_path):
    root = small_root(tmp_path / "root", "# Title\n\nAn area $A_1^2$, prices of 2$ and 3$, `$name`.\n\n"
                                         "```math\nF = \\frac{E A}{l}\n```\n")
    build_site(root, tmp_path / "site")
    text = (tmp_path / "site" / "index.html").read_text(encoding="utf-8")
    assert text.count("<math") == 2
    assert "<msubsup>" in text and "<mfrac>" in text and "2$ and 3$" in text and "<code>$name</code>" in text


def test_remarks_on_tests_are_small_print_behind_their_block(tmp_path):
    root = small_root(tmp_path / "root", "# T\n\n```sh\nx\n```\n<!-- tests do not run this: a day on one core -->\n")
    stage(root, tmp_path / "pages")
    text = (tmp_path / "pages" / "README.md").read_text(encoding="utf-8")
    assert text.index("```sh") < text.index("The tests do not run this: a day on one core")


def test_linked_files_and_folders_become_pages(site):
    assert "polygons settle" in (site / "inputs" / "drum.nml.html").read_text(encoding="utf-8")
    assert "stack.nml" in (site / "inputs" / "precision" / "index.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("link", ["other.md", "#nowhere", "picture.png"])
def test_a_broken_link_is_an_error(tmp_path, link):
    root = small_root(tmp_path / "root", f"# Title\n\n[a]({link})\n")
    with pytest.raises(ManualError, match=link.strip("#")):
        build_site(root, tmp_path / "site")


def test_the_navigation_leads_to_the_pages_of_the_sources(tmp_path):
    root = small_root(tmp_path / "root", "# Title\n\n[a](src/page.md)\n")
    (root / "src").mkdir()
    (root / "src" / "page.md").write_text("# Page\n", encoding="utf-8")
    build_site(root, tmp_path / "site", sources=True)
    assert 'href="../sources/index.html"' in (tmp_path / "site" / "src" / "page.html").read_text(encoding="utf-8")


def test_ford_reads_the_sources(tmp_path):
    tools = ROOT / "build" / "ford"
    if not (tools / "version").exists():
        pytest.skip("FORD is not installed; ./polydem manual --sources installs it")
    build_sources(ROOT, tmp_path / "sources", tools, "geometry")
    assert "Sutherland" in (tmp_path / "sources" / "module" / "polydem_clipping.html").read_text(encoding="utf-8")


def test_a_folder_of_others_is_not_replaced(tmp_path):
    root = small_root(tmp_path / "root", "# Title\n")
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "mine.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(ManualError, match="not of a manual"):
        build_site(root, tmp_path / "site")
    assert (tmp_path / "site" / "mine.txt").read_text(encoding="utf-8") == "mine"


def test_the_search_works_from_a_folder(site):
    chromium = shutil.which("chromium") or shutil.which("chromium-headless-shell")
    if not chromium:
        pytest.skip("no Chromium here: the search of the manual is not tried in a browser")
    done = subprocess.run([chromium, "--headless=new", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=10000",
                           "--enable-logging=stderr", "--dump-dom", (site / "index.html").as_uri() + "?q=damping"],
                          capture_output=True, text=True, timeout=600, check=True)
    assert re.search(r"\b[1-9]\d* matching documents", done.stdout)
    assert [line for line in done.stderr.splitlines() if "CONSOLE" in line] == []
