"""Optional packages, which only some functions need."""

from __future__ import annotations

import importlib
import shlex
import sys
from typing import Any

from .result_file import ResultError


def need(package: str, extra: str, purpose: str, project: str = "") -> Any:
    """An optional package; the error names it, or the project that has it, and the command that installs it."""
    project = project or package
    try:
        return importlib.import_module(package)
    except ImportError as error:
        pip = f"{shlex.quote(sys.executable)} -m pip install"
        raise ResultError(f"{purpose} needs the package {project}: install it with {pip} {project}, or all for this "
                          f"with {pip} 'polydem[{extra}]'") from error
