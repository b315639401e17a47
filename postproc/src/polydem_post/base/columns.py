"""Units and meanings of columns, read from the docstrings of the classes that have them: they are said once."""

from __future__ import annotations

import inspect
import re
from dataclasses import dataclass, fields, is_dataclass
from functools import cached_property

#: A line of a class docstring that describes a field: name, unit in brackets, meaning
_FIELD = re.compile(r"^ +(\w+) +\[([^]]*)\] +(.+)$", re.MULTILINE)

#: The unit in the docstring of a property
_UNIT = re.compile(r"\[([^]]*)\]")


@dataclass(frozen=True)
class Column:
    """What a column of numbers is."""

    name: str
    unit: str
    meaning: str


def columns_of(kind: type) -> dict[str, Column]:
    """All documented columns of a class: its fields, and its properties with a unit in their docstring."""
    found = {name: Column(name, unit, meaning.strip())
             for name, unit, meaning in _FIELD.findall(inspect.getdoc(kind) or "")}
    for name, entry in vars(kind).items():
        if isinstance(entry, (property, cached_property)) and not name.startswith("_"):
            first = (entry.__doc__ or "").split("\n\n")[0]
            unit = _UNIT.search(first)
            if unit:
                found[name] = Column(name, unit.group(1), " ".join(_UNIT.sub("", first).split()).replace(" ,", ","))
    return found


def field_names(kind: type) -> list[str]:
    """Names of the public fields of a data class."""
    return [field.name for field in fields(kind) if not field.name.startswith("_")] if is_dataclass(kind) else []
