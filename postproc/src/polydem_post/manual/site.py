"""Build the site of the manual with MkDocs, in a way that it opens from a folder without a network."""

from __future__ import annotations

import logging
import shutil
import tempfile
from pathlib import Path
from typing import Any

from mkdocs.commands.build import build
from mkdocs.config import load_config
from mkdocs.exceptions import Abort, MkDocsException
from pymdownx.slugs import slugify

from . import mathematics, staging

#: Name of the manual's part for each folder of pages, in the order of the navigation
PARTS = {"inputs": "Running", "postproc": "Results", "src": "Theory and sources", "tests": "Accuracy and tests"}

#: Script that the theme would fetch from the network, and the file in its place
FETCHED, WORKER = "https://unpkg.com/iframe-worker/shim", "offline_worker.js"

#: First page of the sources, which FORD writes
SOURCES = "sources/index.html"

#: What separates words in the search: also underscores, so that the words of `inertial_number` are found one by one
SEPARATOR = r"[\s\-_]+"

#: File that marks a folder as made here
MARK = ".made_by_polydem_manual"

STYLE = """\
.md-typeset p.equation { overflow: auto hidden; margin: 1em 0; padding: 0.3em 0; }
.md-typeset math { font-size: 1.1em; }
.md-typeset small, .md-typeset details.tested { opacity: 0.7; font-size: 0.65rem; }
.md-typeset details.tested { border: none; box-shadow: none; margin: 0; padding: 0; }
.md-typeset details.tested summary { background: none; font-weight: normal; margin: 0; padding: 0; }
.md-typeset details.tested summary::before, .md-typeset details.tested summary::after { display: none; }
.md-typeset pre > code { font-size: 0.75em; }
.md-grid { max-width: 76rem; }
"""


class ManualError(Exception):
    """The manual cannot be built; the message says why."""


def build_site(root: Path, output: Path, sources: bool = False) -> list[Path]:
    """Build the manual of the repository `root` in the folder `output`; returns the pages. Broken links are errors.

    With `sources` the navigation links to the pages of the sources in output/sources, which FORD writes.
    """
    _make_folder(output)
    messages = _Messages()
    with tempfile.TemporaryDirectory(prefix="polydem_manual_") as name:
        folder = Path(name) / "pages"
        pages = staging.stage(root.resolve(), folder)
        (folder / "manual.css").write_text(STYLE, encoding="utf-8")
        shutil.copyfile(Path(__file__).with_name(WORKER), folder / WORKER)
        if sources:
            (folder / SOURCES).parent.mkdir()
            (folder / SOURCES).write_text("FORD replaces this page.\n", encoding="utf-8")
        start = Path(name) / "mkdocs.yml"
        start.write_text("site_name: polydem\n", encoding="utf-8")
        logger = logging.getLogger("mkdocs")
        logger.addHandler(messages)
        try:
            build(load_config(str(start), **_settings(root, folder, output, pages, sources)))
        except (Abort, MkDocsException) as error:
            raise ManualError("\n".join(messages.texts) or str(error)) from None
        finally:
            logger.removeHandler(messages)
    _detach(output)
    (output / MARK).write_text("The verb manual replaces this folder.\n", encoding="utf-8")
    return pages


def _make_folder(output: Path) -> None:
    """Make the folder, or refuse one that holds other files."""
    if output.exists() and not output.is_dir():
        raise ManualError(f"{output} is a file, not a folder")
    if output.is_dir() and any(output.iterdir()) and not (output / MARK).exists():
        raise ManualError(f"{output} has files that are not of a manual; choose another folder by --output")
    output.mkdir(parents=True, exist_ok=True)


def _detach(output: Path) -> None:
    """Let all pages use the script beside them."""
    for page in output.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        up = "../" * (len(page.relative_to(output).parts) - 1)
        page.write_text(text.replace(FETCHED, up + WORKER), encoding="utf-8")


class _Messages(logging.Handler):
    """Collects what MkDocs warns of."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.texts.append(record.getMessage())


def _settings(root: Path, folder: Path, output: Path, pages: list[Path], sources: bool) -> dict[str, Any]:
    """Settings of MkDocs."""
    equations = {"name": "math", "class": "math", "format": mathematics.draw_block}
    return {
        "site_name": "polydem", "docs_dir": str(folder), "site_dir": str(output), "use_directory_urls": False,
        "strict": True, "nav": _navigation(root, pages, sources), "extra_css": ["manual.css"],
        "theme": {"name": "material", "font": False,
                  "features": ["navigation.tabs", "search.highlight", "content.code.copy"],
                  "palette": [{"scheme": "default", "primary": "blue grey"}]},
        "plugins": [{"search": {"separator": SEPARATOR}}, "offline"],
        "markdown_extensions": [
            "tables", "sane_lists", "md_in_html", "pymdownx.inlinehilite", mathematics.__name__,
            {"toc": {"slugify": slugify(case="lower"), "permalink": True}},
            {"pymdownx.highlight": {"use_pygments": True}},
            {"pymdownx.superfences": {"custom_fences": [equations]}}],
        "validation": {"nav": {"omitted_files": "info", "not_found": "warn"},
                       "links": {"not_found": "warn", "anchors": "warn", "absolute_links": "warn",
                                 "unrecognized_links": "warn"}}}


def _navigation(root: Path, pages: list[Path], sources: bool) -> list[dict[str, Any]]:
    """Navigation: the pages of each part in the order in which README.md links to them, then the others."""
    text = (root / "README.md").read_text(encoding="utf-8")
    order = [found.group(1) for found in staging.links_of(text)]

    def place(page: Path) -> tuple[int, str]:
        return order.index(str(page)) if str(page) in order else len(order), str(page)

    entries: list[dict[str, Any]] = []
    for part, name in {"": "polydem", **PARTS}.items():
        chosen = [page for page in pages if (page.parts[0] if len(page.parts) > 1 else "") == part]
        chosen.sort(key=lambda page: (str(page) != "README.md", *place(page)))
        listed: list[Any] = [{staging.title_of(root / page): str(page)} for page in chosen]
        if part == "src" and sources:
            listed.append({"Every module": SOURCES})
        if listed:
            entries.append({name: listed})
    return entries
