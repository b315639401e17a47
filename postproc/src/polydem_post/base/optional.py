"""Optional packages, which only some functions need."""

from __future__ import annotations

import importlib
from typing import Any

from .result_file import ResultError


def need(package: str, extra: str, purpose: str, project: str = "") -> Any:
    """An optional package; the error names it, or the project that has it, and the command that installs it."""
    project = project or package
    try:
        return importlib.import_module(package)
    except ImportError as error:
        raise ResultError(f"{purpose} needs the package {project}: install it with pip install {project}, or with "
                          f"pip install 'polydem[{extra}]'") from error
