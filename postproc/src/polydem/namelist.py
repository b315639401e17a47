"""A namelist as text from a dictionary."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .errors import InputError


def to_text(value: Any) -> str:
    """A value as a namelist has it: numbers with all digits, words in quotes, lists with commas."""
    if isinstance(value, (bool, np.bool_)):
        return ".true." if value else ".false."
    if isinstance(value, str):
        return "'" + value.replace("'", "''") + "'"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    if isinstance(value, np.ndarray):
        value = value.ravel().tolist()
    if isinstance(value, (list, tuple)):
        return ", ".join(to_text(each) for each in value)
    raise InputError(f"a value of a namelist is a number, a text, a truth value or a list of them, not {value!r}")


def write_namelist(groups: Mapping[str, Any]) -> str:
    """The text of `{"forces": {"gravity": (0, -9.81)}, "wall": {"floor": {"outline": "rectangle", ...}}}`.

    A group that may be there several times has its instances by their names.
    """
    lines = []
    for group, entries in groups.items():
        if not isinstance(entries, Mapping):
            raise InputError(f"the group &{group} must be a dictionary of its entries, not {entries!r}")
        instances = [{"name": name, **each} for name, each in entries.items() if isinstance(each, Mapping)]
        if instances and len(instances) != len(entries):
            raise InputError(f"the group &{group} mixes entries and instances")
        for each in instances or [dict(entries)]:
            lines.append(f"&{group}")
            lines += [f"   {key} = {to_text(value)}" for key, value in each.items()]
            lines.append("/")
    return "\n".join(lines) + "\n"


def override(entry: str, value: Any) -> str:
    """An override of the command line."""
    return f"{entry}={value if isinstance(value, str) else to_text(value)}"
