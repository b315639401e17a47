"""The settings of a run, as its result stores them: all entries of the namelist, with defaults filled in."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any, Union

from ..base.result_file import ResultError

Scalar = Union[str, bool, int, float]
Value = Union[Scalar, list[Scalar]]

#: The only group with a `name` that is there once
_SINGLE = "scene"

#: One value of an entry: a quoted string, in which '' is a quote, or a word
_WORD = re.compile(r"'(?:[^']|'')*'|[^,\s]+")


class _Items(Mapping[str, Any]):
    """Items by name: items.name or items["name"]."""

    def __init__(self, items: dict[str, Any]):
        self._items = items

    def __getitem__(self, name: str) -> Any:
        """The item of a name."""
        return self._items[name]

    def __iter__(self) -> Iterator[str]:
        """Names of the items."""
        return iter(self._items)

    def __len__(self) -> int:
        """Number of items."""
        return len(self._items)

    def __getattr__(self, name: str) -> Any:
        if not name.startswith("_") and name in self._items:
            return self._items[name]
        raise AttributeError(self._unknown(name))

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._items]

    def __repr__(self) -> str:
        return "\n".join(map(repr, self._items.values()))

    def _unknown(self, name: str) -> str:
        """What is said of an unknown name."""
        raise NotImplementedError


class Group(_Items):
    """The entries of one group: group.key or group["key"]."""

    def __init__(self, name: str, entries: dict[str, Value]):
        super().__init__(entries)
        self._name = name

    def __repr__(self) -> str:
        lines = [f"   {key} = {_text(value)}" for key, value in self._items.items()]
        return "\n".join([f"&{self._name}", *lines, "/"])

    def _unknown(self, name: str) -> str:
        return f"&{self._name} has no entry {name}; it has {', '.join(self._items)}"


class Groups(_Items):
    """The groups of one kind by name, in the order of the namelist: motion.turn or motion["turn"]."""

    def __init__(self, kind: str):
        super().__init__({})
        self._kind = kind

    def add(self, group: Group) -> None:
        """Append a group, which has a name."""
        self._items[group["name"]] = group

    def _unknown(self, name: str) -> str:
        return f"there is no &{self._kind} {name}; there are {', '.join(self._items)}"


class Settings(_Items):
    """All settings of a run: settings.forces.stiffness or settings["forces"]["stiffness"]; printed as a namelist.

    Values are text, bool, int or float, or lists of these where an entry has several. Units are those of the table of
    namelist entries in the manual. An entry that the run did not use is absent. A group that may be there several times
    has a name: settings.motion.turn.rate or settings["motion"]["turn"]["rate"].
    """

    def __init__(self, text: str):
        super().__init__({})
        for kind, entries in _parse(text):
            group = Group(kind, entries)
            if "name" in entries and kind != _SINGLE:
                self._items.setdefault(kind, Groups(kind)).add(group)
            else:
                self._items[kind] = group

    def _unknown(self, name: str) -> str:
        return f"there is no group &{name}; there are {', '.join('&' + each for each in self._items)}"


def _parse(text: str) -> list[tuple[str, dict[str, Value]]]:
    """Groups, each with key -> value, of the text that a run writes: one entry per line."""
    found: list[tuple[str, dict[str, Value]]] = []
    for number, line in enumerate(text.splitlines(), 1):
        words = line.strip()
        if words.startswith("&"):
            found.append((words[1:].strip(), {}))
        elif words not in ("", "/"):
            key, equals, value = words.partition("=")
            if not (found and equals):
                raise ResultError(f"line {number} of the stored input is not an entry of a namelist: {words[:80]!r}")
            values = [_value(word) for word in _WORD.findall(value)]
            found[-1][1][key.strip()] = values[0] if len(values) == 1 else values
    return [(name, entries) for name, entries in found if entries]


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
