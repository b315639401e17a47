"""What the Python package knows of the entries: a JSON Schema, and functions with completion that make groups."""

import json
import keyword
import textwrap

from .table import TEXTS

#: Types of JSON and of Python, by those of the table
JSON_TYPES = {"real": "number", "integer": "integer", "logical": "boolean"}
PYTHON_TYPES = {"real": "float", "integer": "int", "logical": "bool"}
#: Bounds of JSON Schema
BOUNDS = {">=": "minimum", ">": "exclusiveMinimum", "<=": "maximum", "<": "exclusiveMaximum"}
#: Largest magnitude of an integer
HUGE = 2**31 - 1
#: A name of an instance, or an empty text
NAME = {"pattern": "^[A-Za-z0-9_]*$", "maxLength": 64}
WIDTH = 120

SETTINGS = '''"""Groups of a namelist, with completion and checks: {"forces": forces(friction_coefficient=0.4), ...}.

Made from the table of entries (src/config/entries.txt) by src/config/make_entries.py. Each function is a group and
returns its dictionary; an entry that is not given has its default. An unknown entry is a TypeError, a bad value an
`InputError`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, Union

import numpy.typing as npt

from .schema import made

Reals = Union[Sequence[float], npt.NDArray[Any]]
Integers = Union[Sequence[int], npt.NDArray[Any]]
'''


def by_key(rows, group):
    """The rows of each key of a group; the name of an instance is the key of its dictionary."""
    found = {}
    for row in rows:
        if row.group == group:
            found.setdefault(row.key, []).append(row)
    return found


def entries_of(groups, rows, group):
    """Key -> rows of the entries of a group."""
    return {key: same for key, same in by_key(rows, group).items() if key != "name" or not groups[group].is_repeatable}


def number(text):
    """A number of the table."""
    value = float(text)
    return int(value) if value.is_integer() and abs(value) < HUGE else value


def range_of(row):
    """What a value of a row must be: bounds, or a choice."""
    if row.type == "word":
        return {"enum": row.allowed.split()}
    if row.type in TEXTS:
        return {**(NAME if row.type == "name" else {}), **({"minLength": 1} if row.default == "required" else {})}
    words = row.allowed.replace(",", "").split()
    bounds = {BOUNDS[sign]: number(bound) for sign, bound in zip(words[::2], words[1::2])}
    if row.type == "integer":
        bounds = {**({} if "exclusiveMinimum" in bounds else {"minimum": -HUGE}), "maximum": HUGE, **bounds}
    return bounds


def value_schema(same):
    """Schema of one value of an entry, of which there are rows that are used with different choices."""
    ranges = [range_of(row) for row in same]
    kind = {"type": JSON_TYPES.get(same[0].type, "string")}
    if same[0].type == "word":
        return {**kind, "enum": list(dict.fromkeys(word for each in ranges for word in each["enum"]))}
    distinct = [each for k, each in enumerate(ranges) if each not in ranges[:k]]
    if same[0].type in TEXTS:
        return {**kind, **min(distinct, key=len)}
    return {**kind, **distinct[0]} if len(distinct) == 1 else {**kind, "anyOf": distinct}


def default_of(row):
    """The default as a value of JSON; None: there is none."""
    if row.default in ("", "required"):
        return None
    texts = [text.strip() for text in row.default.split(",")]
    convert = {"logical": lambda text: text == ".true.", "real": float, "integer": int}.get(row.type, str)
    values = [convert(text) for text in texts]
    return values[0] if row.count == 1 else values


def meaning_of(same):
    """Meaning, unit, defaults, conditions and ranges, in words."""
    parts = []
    for row in same:
        unit = f" [{row.unit}]" if row.unit else ""
        bounds = f"; {row.allowed}" if row.type in JSON_TYPES and row.allowed else ""
        default = {"": "", "required": "; required"}.get(row.default, f"; default {row.default}")
        key, _, words = row.needs.partition(": ")
        used = f"; used with {key} = {', '.join(words.split())}" if key else ""
        usual = f"; usually {row.usual.partition(': ')[0]}" if row.usual else ""
        parts.append(f"{row.meaning}{unit}{default}{bounds}{usual}{used}.")
    return " ".join(dict.fromkeys(parts))


def entry_schema(same):
    """Schema of an entry."""
    row, value = same[0], value_schema(same)
    if row.count != 1:
        several = {"minItems": row.count, "maxItems": row.count} if row.count else {"minItems": 1}
        # A list may be a single value.
        value = {"type": "array", "items": value, **several} if row.count else {
            **value, "type": [value["type"], "array"], "items": value, **several}
    defaults = [default_of(row) for row in same]
    common = {} if defaults[0] is None or any(each != defaults[0] for each in defaults) else {"default": defaults[0]}
    return {**value, **common, "description": meaning_of(same)}


def schema(groups, rows):
    """JSON Schema of the dictionary of a namelist, a line for each entry."""
    lines = []
    for name, group in groups.items():
        entries = ",\n".join(f"{json.dumps(key)}: {json.dumps(entry_schema(same))}"
                             for key, same in entries_of(groups, rows, name).items())
        meaning = json.dumps(group.meaning[:1].upper() + group.meaning[1:] or f"Group &{name}")
        of_entries = f'"type": "object", "additionalProperties": false, "properties": {{\n{entries}}}'
        if group.is_repeatable:
            names = json.dumps({**NAME, "minLength": 1})
            of_entries = (f'"type": "object", "minProperties": 1, "propertyNames": {names}, '
                          f'"additionalProperties": {{{of_entries}}}')
        lines.append(f'"{name}": {{"description": {meaning}, {of_entries}}}')
    groups_text = ",\n\n".join(lines)
    return ('{"$schema": "https://json-schema.org/draft/2020-12/schema",\n"title": "Settings of polydem",\n'
            '"description": "The dictionary of a namelist: groups with their entries; of a group that may be there '
            'several times, instances by their names. Values are in SI units. Entries that may be given as overrides '
            'are not required.",\n'
            f'"type": "object", "additionalProperties": false, "properties": {{\n\n{groups_text}}}}}\n')


def python_type(row, value):
    """Type of an entry in Python."""
    if row.type == "word":
        one = f"Literal[{', '.join(json.dumps(word) for word in value['enum'])}]"
    else:
        one = PYTHON_TYPES.get(row.type, "str")
    if row.count == 1:
        return one
    many = {"real": "Reals", "integer": "Integers"}.get(row.type, f"Sequence[{one}]")
    return many if row.count else f"{one} | {many}"


def wrapped(text, first, indent):
    """A text in lines."""
    return textwrap.fill(text, WIDTH, initial_indent=first, subsequent_indent=indent, break_long_words=False,
                         break_on_hyphens=False)


def settings_source(groups, rows):
    """Python source of the functions."""
    text = SETTINGS
    for name, group in groups.items():
        entries = entries_of(groups, rows, name)
        arguments, meanings = [], []
        for key, same in entries.items():
            argument = f"{key}_" if keyword.iskeyword(key) else key
            kind = python_type(same[0], value_schema(same))
            arguments.append(wrapped(f"{argument}: {kind} | None = None,", "    ", "        "))
            meanings.append(wrapped(f"{argument}: {meaning_of(same)}", "    ", "        "))
        summary = f"An instance of the group &{name}." if group.is_repeatable else f"The group &{name}."
        about = wrapped(f"{group.meaning[:1].upper()}{group.meaning[1:]}.\n\n", "    ", "    ") + "\n\n"
        text += (f'\n\ndef {name}(\n    *,\n{{}}\n) -> dict[str, Any]:\n    """{summary}\n\n{{}}{{}}\n    """\n'
                 f'    return made("{name}", locals())\n').format(
                     "\n".join(arguments), about if group.meaning else "", "\n".join(meanings).replace("\\", "\\\\"))
    return text


def update_package(folder, groups, rows, checks):
    """Write the files of the package, or return the names of those that are not as they must be."""
    stale = []
    for name, text in (("schema.json", schema(groups, rows)), ("settings.py", settings_source(groups, rows))):
        path = folder / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            stale.append(name)
            if not checks:
                path.write_text(text, encoding="utf-8")
    return stale
