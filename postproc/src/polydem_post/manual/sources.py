"""Pages of the Fortran sources, made by FORD in an environment of its own (it needs an older Markdown than MkDocs)."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from .site import ManualError

#: Version of FORD that is tested
FORD = "ford==7.0.13"

#: Settings of FORD; of two implementations of one module it gets one
PROJECT = """\
---
project: polydem
summary: Modules, types and procedures of the sources.
src_dir: {sources}
output_dir: {output}
exclude_dir: {sources}/platform/hdf5/parallel
             {sources}/platform/communicator/mpi
predocmark: >
docmark: <
display: public
preprocess: false
graph: false
source: false
search: true
warn: true
year: ' '
---

Modules, types and procedures of polydem, from the comments of the sources. [Manual](../index.html)
"""


def build_sources(root: Path, output: Path, tools: Path, layers: str = "") -> None:
    """Write the pages of all sources, or of one layer, into `output`. FORD is installed in `tools` at need."""
    project = tools / "ford_project.md"
    ford = _find_ford(tools)
    project.write_text(PROJECT.format(sources=root / "src" / layers, output=output), encoding="utf-8")
    _run([ford, "--quiet", str(project)])


def _find_ford(tools: Path) -> str:
    """Command of FORD, installed at its tested version if it is not there."""
    python, ford, stamp = tools / "bin" / "python", tools / "bin" / "ford", tools / "version"
    if not (stamp.exists() and stamp.read_text(encoding="utf-8") == FORD):
        _run([sys.executable, "-m", "venv", "--clear", str(tools)])
        _run([str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", FORD])
        stamp.write_text(FORD, encoding="utf-8")
    return str(ford)


def _run(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    complaints = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]
    if done.returncode != 0 or any("arning" in line for line in complaints):
        raise ManualError("\n".join([f"this failed: {' '.join(command)}", *complaints[-20:]]))
