"""Run a tool on the tracked sources: ruff on Python, shellcheck on shell scripts, fortitude on Fortran.

usage: run_tool.py ROOT TOOL

The tool is that of ROOT/.venv, in the version of postproc/pyproject.toml. Without .venv it is skipped (code 77).
"""

import subprocess
import sys
from pathlib import Path

from check_style import files_of

SKIPPED = 77
#: Arguments of each tool, and the suffix of what it reads
TOOLS = {
    "ruff": (["check", "--no-cache", "--output-format", "concise"], ".py"),
    "shellcheck": ([], None),
    "fortitude": (["check", "--quiet", "--output-format", "concise"], ".f90"),
}


def main():
    root, tool = Path(sys.argv[1]).resolve(), sys.argv[2]
    options, suffix = TOOLS[tool]
    command = root / ".venv/bin" / tool
    if not command.exists():
        print(f"{command} is missing; ./polydem test installs it")
        return 1 if (root / ".venv").exists() else SKIPPED
    names = [name for name in files_of(root) if name.endswith(suffix or "")]
    if suffix is None:
        names = [name for name in names if (root / name).read_bytes()[:100].split(b"\n")[0].endswith((b"bash", b"/sh"))]
    if not names:
        print(f"no sources for {tool}")
        return 1
    return subprocess.run([command, *options, *names], cwd=root, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
