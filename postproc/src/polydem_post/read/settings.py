"""The settings of a run, as its result stores them: all entries of the namelist, with defaults filled in."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any, Union

from ..base.result_file import ResultError

Scalar = Union[str, bool, int, float]
Value = Union[Scalar, list[Scalar]]

#: One value of an entry: a quoted string, in which '' is a quote, or a word
_WORD = re.compile(r"'(?:[^']|'')*'|[^,\s]+")


class Group(Mapping[str, Value]):
    """The entries of one group: group.key or group["key"]."""

    def __init__(self, name: str, entries: dict[str, Value]):
        self._name, self._entries = name, entries

    def __getitem__(self, key: str) -> Value:
        """Value of an entry."""
        return self._entries[key]

    def __iter__(self) -> Iterator[str]:
        """Names of the entries."""
        return iter(self._entries)

    def __len__(self) -> int:
        """Number of entries."""
        return len(self._entries)

    def __getattr__(self, key: str) -> Any:
        if not key.startswith("_") and key in self._entries:
            return self._entries[key]
        raise AttributeError(f"&{self._name} has no entry {key}; it has {', '.join(self._entries)}")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._entries]

    def __repr__(self) -> str:
        lines = [f"   {key} = {_text(value)}" for key, value in self._entries.items()]
        return "\n".join([f"&{self._name}", *lines, "/"])


class Settings(Mapping[str, Group]):
    """All settings of a run: settings.forces.stiffness or settings["forces"]["stiffness"]; printed as a namelist.

    Values are text, bool, int or float, or lists of these where an entry has several. Units are those of the table of
    namelist entries in the manual. An entry that the run did not use is absent.
    """

    def __init__(self, text: str):
        self._groups = {name: Group(name, entries) for name, entries in _parse(text).items()}

    def __getitem__(self, name: str) -> Group:
        """A group of entries."""
        return self._groups[name]

    def __iter__(self) -> Iterator[str]:
        """Names of the groups."""
        return iter(self._groups)

    def __len__(self) -> int:
        """Number of groups."""
        return len(self._groups)

    def __getattr__(self, name: str) -> Group:
        if not name.startswith("_") and name in self._groups:
            return self._groups[name]
        raise AttributeError(f"there is no group &{name}; there are {', '.join('&' + each for each in self._groups)}")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._groups]

    def __repr__(self) -> str:
        return "\n".join(map(repr, self._groups.values()))


def _parse(text: str) -> dict[str, dict[str, Value]]:
    """Group -> key -> value of the text that a run writes: one entry per line."""
    found: dict[str, dict[str, Value]] = {}
    group = ""
    for number, line in enumerate(text.splitlines(), 1):
        words = line.strip()
        if words.startswith("&"):
            group = words[1:].strip()
            found.setdefault(group, {})
        elif words not in ("", "/"):
            key, equals, value = words.partition("=")
            if not (group and equals):
                raise ResultError(f"line {number} of the stored input is not an entry of a namelist: {words[:80]!r}")
            values = [_value(word) for word in _WORD.findall(value)]
            found[group][key.strip()] = values[0] if len(values) == 1 else values
    return {name: entries for name, entries in found.items() if entries}


def _value(word: str) -> Scalar:
    if word.startswith("'"):
        return word[1:-1].replace("''", "'")
    if word.lower() in (".true.", ".false."):
        return word.lower() == ".true."
    try:
        return int(word)
    except ValueError:
        pass
    try:
        return float(word.lower().replace("d", "e"))
    except ValueError:
        return word


def _text(value: Value) -> str:
    if isinstance(value, list):
        return ", ".join(map(_text, value))
    if isinstance(value, bool):
        return ".true." if value else ".false."
    if isinstance(value, str):
        return "'" + value.replace("'", "''") + "'"
    return repr(value)
