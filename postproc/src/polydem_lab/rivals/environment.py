"""The environment of the rivals: a Python with packages of PyPI, and a program made by cargo.

What cannot be installed is missing, which a study tells and goes on without.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from .runs import Missing, told

#: Folder of the sources of the program in Rust
RAPIER = Path(__file__).resolve().parent / "rapier"


def insist_on_package(python: Path, package: str, module: str) -> str:
    """Have a package of PyPI in the environment of a Python; its name and version."""
    name = package.partition("==")[0]
    ask = [python, "-c", f"import {module}; from importlib.metadata import version; print(version('{name}'))"]
    try:
        version = told(ask)
    except Missing:
        version = ""
    if version != package.partition("==")[2]:
        if not python.exists():
            _call([sys.executable, "-m", "venv", python.parents[1]])
        _call([python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", package])
        version = told(ask)
    return f"{name} {version}"


def insist_on_crate(environment: Path, program: str, crate: str) -> tuple:
    """Have a program of cargo; its path, and name and version of the crate that it is about."""
    target = environment / "rapier"
    _call(["cargo", "build", "--release", "--locked", "--quiet", "--manifest-path", RAPIER / "Cargo.toml",
           "--target-dir", target])
    lines = (RAPIER / "Cargo.lock").read_text(encoding="utf-8").splitlines()
    version = lines[lines.index(f'name = "{crate}"') + 1].partition('"')[2].rstrip('"')
    return target / "release" / program, f"{crate} {version}"


def _call(command: list) -> None:
    """Call what installs something; Missing, with its last words, if it fails."""
    words = [str(word) for word in command]
    try:
        done = subprocess.run(words, capture_output=True, text=True, check=False)
    except OSError as error:
        raise Missing(f"{words[0]} cannot be called ({error.strerror})") from error
    if done.returncode != 0:
        lines = (done.stderr or done.stdout).strip().splitlines()
        raise Missing(f"{Path(words[0]).name} failed: {lines[-1] if lines else f'exit code {done.returncode}'}")
