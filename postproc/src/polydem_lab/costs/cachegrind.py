"""Runs a program in cachegrind and in perf, and reads what they counted."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

from polydem_post.base.result_file import ResultError

#: Caches that are simulated unless others are asked for: total bytes, ways, bytes of a line. The first level and the
#: second level of one core of a common server; the same everywhere, so that counts of all machines are the same.
PLAIN_MODEL = {"I1": "32768,8,64", "D1": "32768,8,64", "LL": "1048576,16,64"}

#: Modules outside the layer of the finders that work for them
HELPERS = ("sort", "sort_reals", "finder", "finder_statistics", "pair_changes", "pair_list")

#: Procedures of finders that only report
REPORTS = "survey|report|bytes|pool_bytes"

#: Large arrays begin on a page in runs of any length. Else glibc moves its threshold with what was freed before, arrays
#: lie otherwise towards each other, and the misses of the first step no longer cancel between a short and a long run.
SAME_PLACES = {"MALLOC_MMAP_THRESHOLD_": "65536"}

#: Counters of the hardware that are asked for
HARDWARE = ("instructions", "L1-dcache-load-misses", "LLC-load-misses", "branch-misses")


@dataclass(frozen=True)
class Model:
    """The caches that cachegrind simulates."""

    I1: str
    D1: str
    LL: str

    @property
    def options(self) -> list[str]:
        """Options of valgrind."""
        return [f"--I1={self.I1}", f"--D1={self.D1}", f"--LL={self.LL}"]

    @property
    def text(self) -> str:
        """Like D1 32 KiB 8-way, LL 1 MiB 16-way."""
        return f"D1 {_size(self.D1)}, LL {_size(self.LL)}"


def _size(words: str) -> str:
    size, ways, _ = (int(word) for word in words.split(","))
    return (f"{size // 2**20} MiB" if size % 2**20 == 0 else f"{size // 2**10} KiB") + f" {ways}-way"


def machine_model(folder: Path = Path("/sys/devices/system/cpu/cpu0/cache")) -> Model:
    """First and last level of this machine; the plain model where the system does not tell."""
    found = {}
    for index in sorted(folder.glob("index*")):
        told = {
            name: (index / name).read_text().strip()
            for name in ("level", "type", "size", "ways_of_associativity", "coherency_line_size")
            if (index / name).exists()
        }
        if len(told) == 5 and re.fullmatch(r"\d+K", told["size"]):
            text = f"{1024 * int(told['size'][:-1])},{told['ways_of_associativity']},{told['coherency_line_size']}"
            found[{"1Instruction": "I1", "1Data": "D1"}.get(told["level"] + told["type"], "LL")] = text
    return Model(**{**PLAIN_MODEL, **found})


def finder_functions(sources: Path) -> re.Pattern:
    """What the compiled names of the functions of finders look like; `sources` is the folder of their files."""
    modules = sorted(path.stem for path in sources.rglob("*.f90"))
    if not modules:
        raise ResultError(f"{sources}: the sources of the finders are not there; they name the functions to count")
    names = "|".join(map(re.escape, [*modules, *HELPERS]))
    return re.compile(rf"__polydem_(?:{names})(?:_inlined|_called|_o2)?_MOD_(?!(?:{REPORTS})(?:\W|$))")


def simulate(command: list[str], model: Model | None, functions: re.Pattern, branches: bool = False) -> dict:
    """Event -> number in some functions, while a command runs on one thread; without caches instructions alone."""
    if shutil.which("valgrind") is None:
        raise ResultError("valgrind is not installed; the launcher installs it: ./polydem cache FOLDER")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "cachegrind.out"
        options = [
            "--tool=cachegrind",
            f"--cache-sim={'yes' if model else 'no'}",
            f"--branch-sim={'yes' if branches else 'no'}",
            f"--cachegrind-out-file={out}",
            *(model.options if model else ()),
        ]
        _run(["valgrind", *options, *command])
        return count_events(out.read_text(encoding="utf-8", errors="replace"), functions)


def count_events(text: str, functions: re.Pattern) -> dict:
    """Event -> number, summed over the functions whose names match, in a file that cachegrind wrote."""
    events: list[str] = []
    totals: defaultdict = defaultdict(int)
    counts = False
    for line in text.splitlines():
        if line.startswith("events:"):
            events = line.split()[1:]
        elif line.startswith("fn="):
            counts = functions.match(line[3:].strip()) is not None
        elif counts and line[:1].isdigit():
            for event, value in zip(events, line.split()[1:]):
                totals[event] += int(value)
    if not events:
        raise ResultError("cachegrind left no counts")
    return dict(totals)


def count_hardware(command: list[str]) -> dict:
    """Event -> number of the whole command; empty if there is no perf or this machine has no counters."""
    if shutil.which("perf") is None:
        return {}
    with tempfile.NamedTemporaryFile(mode="r", suffix=".csv") as out:
        done = subprocess.run(
            ["perf", "stat", "-x", ",", "-o", out.name, "-e", ",".join(HARDWARE), *command],
            env=_environment(),
            capture_output=True,
            text=True,
            check=False,
        )
        return _hardware_events(out.read()) if done.returncode == 0 else {}


def _hardware_events(text: str) -> dict:
    fields = [line.split(",") for line in text.splitlines() if line.count(",") >= 2]
    return {words[2].split(":")[0]: int(words[0]) for words in fields if words[0].isdigit()}


def _run(command: list[str]) -> None:
    done = subprocess.run(command, env=_environment(), capture_output=True, text=True, check=False)
    if done.returncode != 0:
        said = (done.stderr or done.stdout).strip().splitlines()
        own = [line for line in said if not re.match(r"==\d+==|--\d+--", line)]  # of the program, not of valgrind
        last = "\n".join((own or said)[-5:])
        hint = ""
        if "SIGILL" in done.stderr or "unrecognised instruction" in done.stderr.lower():
            hint = (
                "\nvalgrind does not know an instruction of this build; use the portable one (POLYDEM_PRESET=release)"
            )
        raise ResultError(f"this failed: {' '.join(command)}\n{last}{hint}")


def _environment() -> dict:
    return {**os.environ, "OMP_NUM_THREADS": "1", "OMP_WAIT_POLICY": "passive", "LC_ALL": "C", **SAME_PLACES}
