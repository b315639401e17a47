"""Namelists of benches: read, narrowed down to some scenes, and written for another folder."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

from polydem_post.base.result_file import ResultError, cannot_read, insist_on_file

#: Words of a namelist: texts in quotes, comments, and what stands between blanks and commas
WORD = re.compile(r"'(?:[^']|'')*'|![^\n]*|[^\s,='!/]+|[=/]")

#: A trace that another bench records
RECORDED = re.compile(r"^results/bench_(\w+)/traces/(\w[\w.]*)/trace\.h5$")


@dataclass(frozen=True)
class BenchFile:
    """The group &bench."""

    name: str
    #: Runs before all scenes, and name -> scene: a namelist with entries of its own, or a trace
    prepare: tuple
    scenes: dict
    finders: tuple
    threads: tuple = (1,)
    repeats: int = 7
    #: Steps of a sample; 0: all of the trace
    steps: int = 0
    mode: str = "replay"

    def only(self, names=None, finders=None, **changes) -> BenchFile:
        """The same bench with some of its scenes and finders, in its own order."""
        scenes = {name: text for name, text in self.scenes.items() if names is None or name in names}
        kept = tuple(finder for finder in self.finders if finders is None or finder in finders)
        return replace(self, scenes=scenes, finders=kept, **changes)

    def with_entries(self, *entries: str) -> BenchFile:
        """The same bench with more entries behind each scene that is a namelist."""
        words = "".join(f" {entry}" for entry in entries)
        return replace(self, scenes={name: text if text.endswith(".h5") else text + words
                                     for name, text in self.scenes.items()})

    def sources(self) -> set[str]:
        """Names of the benches whose traces this one needs."""
        return {match[1] for match in map(RECORDED.match, self.scenes.values()) if match}

    def written(self, folder: Path) -> str:
        """The namelist that takes the samples into a folder."""
        entries = {
            "folder": [str(folder)], "prepare": self.prepare, "scenes": list(self.scenes.values()),
            "names": list(self.scenes), "finders": self.finders, "threads": self.threads, "repeats": [self.repeats],
            "steps": [self.steps], "mode": [self.mode],
        }
        lines = []
        for key, values in entries.items():
            words = [f"'{value}'" if isinstance(value, str) else str(value) for value in values]
            if words and not (key == "steps" and self.steps == 0):
                lines.append(f"   {key} = " + ",\n      ".join(words))
        return "&bench\n" + "\n".join(lines) + "\n/\n"


def read_bench_file(path: Path) -> BenchFile:
    """Read the group &bench of a namelist file."""
    try:
        insist_on_file(Path(path))
        text = Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise cannot_read(path, error) from error
    values = _entries(text)
    try:
        return BenchFile(
            Path(path).stem.removeprefix("bench_"),
            tuple(values.get("prepare", [])),
            dict(zip(values["names"], values["scenes"], strict=False)),
            tuple(values["finders"]),
            tuple(int(word) for word in values.get("threads", ["1"])),
            int(values.get("repeats", ["7"])[0]),
            int(values.get("steps", ["0"])[0]),
            values.get("mode", ["replay"])[0],
        )
    except (KeyError, ValueError) as error:
        raise ResultError(f"{path}: is not a namelist of a bench ({error})") from error


def _entries(text: str) -> dict[str, list[str]]:
    """Key -> values of the first group of a namelist."""
    words = [word for word in WORD.findall(text) if not word.startswith("!")]
    found: dict[str, list[str]] = {}
    key = None
    for word, following in zip(words, [*words[1:], "/"]):
        if word == "/":
            break
        if following == "=":
            key = word.lower()
            found[key] = []
        elif word != "=" and key is not None:
            found[key].append(word[1:-1].replace("''", "'") if word.startswith("'") else word)
    return found


def number_of(scene: str, entry: str, root: Path) -> float | None:
    """A number in the text of a scene: among its entries, else in its namelist file; None if it is in neither."""
    path, *entries = scene.split()
    for word in reversed(entries):
        name, _, value = word.partition("=")
        if name == entry:
            return float(value.lower().replace("d", "e"))
    group, _, key = entry.partition(".")
    try:
        text = (root / path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return None
    block = re.search(rf"&{group}\b(.*?)^/", text, re.DOTALL | re.MULTILINE | re.IGNORECASE)
    found = block and re.search(rf"^\s*{key}\s*=\s*([-+\d.eEdD]+)", block[1], re.MULTILINE)
    return float(found[1].lower().replace("d", "e")) if found else None
