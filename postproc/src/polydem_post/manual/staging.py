"""Gather the pages of the repository, and the files that they link to, in one folder that MkDocs can read.

Pages keep their paths, so their links stay right. A linked text file that is no page, a namelist for example, becomes a
page that shows it; a linked folder becomes a page that lists it.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

#: Folders with pages; README.md and the other pages at the top belong to the manual, too
FOLDERS = ("inputs", "postproc", "src", "tests")

#: Languages of files that become a page, by their suffix
LANGUAGES = {".f90": "fortran", ".nml": "fortran", ".py": "python", ".sh": "bash", ".txt": "text", ".cff": "yaml",
             "": "text", ".toml": "toml", ".csv": "text"}

#: Lines of a file that a page shows
MOST_LINES = 2000

CODE = re.compile(r"^```.*?^```|`[^`\n]*`", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\((?!\w+:|#)([^)\s#]+)")
NOTE = re.compile(r"^<!-- (tests run|tests do not run this): (.*?)\s+-->\n", re.MULTILINE | re.DOTALL)


def find_pages(root: Path) -> list[Path]:
    """All pages of the repository, as paths below its root."""
    pages = [*root.glob("*.md"), *(page for name in FOLDERS for page in (root / name).rglob("*.md"))]
    below = (page.relative_to(root) for page in pages)
    return sorted(page for page in below if not any(part.startswith(".") or part.endswith(".egg-info")
                                                    for part in page.parts))


def title_of(page: Path) -> str:
    """First heading of a page."""
    found = re.search(r"^# +(.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return found.group(1) if found else page.stem


def without_code(text: str) -> str:
    """Text with blanks instead of code, of the same length."""
    return CODE.sub(lambda found: re.sub(r"[^\n]", " ", found.group(0)), text)


def links_of(text: str) -> list[re.Match[str]]:
    """Links of a page to files of the repository; group 1 is the path."""
    return list(LINK.finditer(without_code(text)))


def stage(root: Path, folder: Path) -> list[Path]:
    """Write all pages, and what they link to, into an empty folder. Returns the pages of the repository."""
    pages = find_pages(root)
    linked: set[Path] = set()
    for page in pages:
        text = (root / page).read_text(encoding="utf-8")
        _write(folder / page, _show_notes(_redirect(root, page, text, linked)))
    for target in sorted(linked):
        _stage_linked(root, target, folder)
    return pages


def _redirect(root: Path, page: Path, text: str, linked: set[Path]) -> str:
    """Text of a page whose links lead to what is staged; collects the targets that are no pages."""
    for found in reversed(links_of(text)):
        target = (root / page).parent.joinpath(found.group(1)).resolve()
        if target.suffix == ".md" or not target.is_relative_to(root) or not target.exists():
            continue
        linked.add(target.relative_to(root))
        text = text[:found.end(1)] + _suffix(target) + text[found.end(1):]
    return text


def _suffix(target: Path) -> str:
    """What the name of the staged page has more than that of the target."""
    if target.is_dir():
        return "/README.md"
    return ".md" if target.suffix in LANGUAGES else ""


def _stage_linked(root: Path, target: Path, folder: Path) -> None:
    """Stage a folder, a text file or a picture."""
    source = root / target
    if source.is_dir():
        if not (source / "README.md").exists():
            files = sorted(path for path in source.iterdir() if path.is_file() and path.suffix in LANGUAGES)
            for path in files:
                _stage_linked(root, path.relative_to(root), folder)
            _write_page(folder / target / "README.md", f"Files of {target}",
                        "\n".join(f"* [{path.name}]({path.name}.md)" for path in files))
    elif source.suffix in LANGUAGES:
        lines = source.read_text(encoding="utf-8").splitlines()
        rest = "" if len(lines) <= MOST_LINES else f"\nThe first {MOST_LINES} of {len(lines)} lines.\n"
        code = "\n".join(lines[:MOST_LINES])
        _write_page(folder / f"{target}.md", str(target),
                    f"{rest}\n``````{LANGUAGES[source.suffix]}\n{code}\n``````")
    else:
        (folder / target).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, folder / target)


def _write_page(path: Path, title: str, text: str) -> None:
    """Write a page that is made here, and that the search does not find."""
    _write(path, f"---\nsearch:\n  exclude: true\n---\n\n# {title}\n\n{text}\n")


def _show_notes(text: str) -> str:
    """Text in which the notes on tests below command blocks, which are comments, are small print."""
    return NOTE.sub(lambda found: "\n" + _small_print(found.group(1), found.group(2)) + "\n", text)


def _small_print(kind: str, words: str) -> str:
    lines = [line.strip() for line in words.strip().splitlines()]
    if kind == "tests run":
        commands = "\n".join(lines)
        return ('<details class="tested" markdown><summary>shortened for the tests</summary>\n\n'
                f"```sh\n{commands}\n```\n\n</details>\n")
    return f"<small markdown>The {kind}: {' '.join(lines)}</small>\n"


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
