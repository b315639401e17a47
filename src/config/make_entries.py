"""Make the Fortran sources that follow from the table of namelist entries: make_entries.py ENTRIES.txt FOLDER.

entry_table.f90: the table as constants; group_settings.f90: one type per group; fill_groups.f90: fills these types.
"""

import re
import sys
import textwrap
from collections import namedtuple
from pathlib import Path

Row = namedtuple("Row", "group key type count default unit allowed needs meaning")
#: Components: the Fortran type of one value and its value before it is filled
TYPES = {"real": ("real(wp)", "0.0_wp"), "integer": ("integer(ip)", "0_ip"), "logical": ("logical", ".false.")}
TEXTS = ("word", "path")
#: Group of a bench; all other groups belong to a run
BENCH = "bench"
#: Longest piece of a text on a line
WIDTH = 90


class TableError(Exception):
    """A table that cannot be understood."""


def read_table(text):
    """Meaning of each group, and all rows."""
    groups, lists, rows = {}, {}, []
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        word, _, rest = line.partition(" ")
        if word == "group":
            name, _, meaning = rest.partition(": ")
            groups[name] = meaning
        elif word == "list":
            name, _, words = rest.partition(" = ")
            lists[name] = with_lists(words.strip(), lists, number)
        else:
            fields = ["" if field.strip() == "-" else field.strip() for field in line.split(" | ")]
            if len(fields) != len(Row._fields):
                raise TableError(f"line {number}: {len(fields)} fields, not {len(Row._fields)}")
            if not fields[3].isdigit():
                raise TableError(f"line {number}: {fields[3]} is not a number of values")
            row = Row(*(with_lists(field, lists, number) for field in fields))._replace(count=int(fields[3]))
            if row.group != next(reversed(groups), None):
                raise TableError(f"line {number}: the row is not in its group")
            if row.type not in (*TYPES, *TEXTS) or (row.type == "logical" and row.count != 1):
                raise TableError(f"line {number}: there is no entry of type {row.type} with {row.count} values")
            earlier = [other for other in rows if (other.group, other.key) == (row.group, row.key)]
            if any((other.type, other.count) != (row.type, row.count) for other in earlier):
                raise TableError(f"line {number}: {row.key} has another type in an earlier row")
            rows.append(row)
    return groups, rows


def with_lists(text, lists, number):
    """The text with the words of each {list}."""
    for name in re.findall(r"{(\w+)}", text):
        if name not in lists:
            raise TableError(f"line {number}: there is no list {name} above it")
        text = text.replace(f"{{{name}}}", lists[name])
    return text


def literal(text):
    """A Fortran text, broken into lines."""
    pieces = [text[k:k + WIDTH] for k in range(0, len(text), WIDTH)] or [""]
    return "// &\n         ".join("'" + piece.replace("'", "''") + "'" for piece in pieces)


def first_rows(rows, group):
    """Rows of a group, each key once."""
    return list({row.key: row for row in reversed(rows) if row.group == group}.values())[::-1]


def module(name, purpose, uses, public, body, contains=""):
    """A module that says where it comes from."""
    lines = [f"!> {purpose} Made by make_entries.py from entries.txt.", f"module polydem_{name}"]
    lines += [f"   use polydem_{used}" for used in uses]
    lines += ["   implicit none", "   private", *(f"   public :: {word}" for word in public), "", body.rstrip()]
    if contains:
        lines += ["", "contains", "", contains.rstrip()]
    return "\n".join([*lines, "", f"end module polydem_{name}", ""])


def table_module(groups, rows):
    """The table as constants, one per group: a statement cannot have more than 255 lines."""
    body = ""
    for group in groups:
        entries = []
        for row in rows:
            if row.group == group:
                texts = [literal(field) for field in (row.default, row.unit, row.allowed, row.needs, row.meaning)]
                if row.default == "required":
                    texts[0] = "required"
                entries.append(f"      entry_t('{row.group}', '{row.key}', '{row.type}', {row.count}, {texts[0]}, "
                               f"{texts[1]}, &\n         {texts[2]}, &\n         {texts[3]}, &\n         {texts[4]})")
        body += (f"   !> Group &{group}\n   type(entry_t), parameter :: {group}_entries(*) = [ &\n"
                 + ", &\n".join(entries) + "]\n\n")
    names = ", &\n      ".join(f"{group}_entries" for group in groups)
    body += f"   !> The table of entries\n   type(entry_t), parameter :: entries(*) = [ &\n      {names}]\n"
    return module("entry_table", "Table of namelist entries.", ["namelist_entry, only: entry_t, required"], ["entries"],
                  body)


def component(row):
    """Declaration of the component that holds an entry, with its comment."""
    unit = f" [{row.unit}]" if row.unit else ""
    shape = f", ({row.count})" if row.count > 1 else ", (value)" if row.count == 0 else ""
    comment = textwrap.fill(f"{row.meaning}{shape}{unit}", 110, initial_indent="      !> ",
                            subsequent_indent="      !> ")
    if row.type in TEXTS:
        kind = "character(len=:), allocatable :: " if row.count == 1 else "type(text_t), allocatable :: "
        return f"{comment}\n      {kind}{row.key}{'' if row.count == 1 else '(:)'}"
    kind, zero = TYPES[row.type]
    if row.count == 0:
        return f"{comment}\n      {kind}, allocatable :: {row.key}(:)"
    return f"{comment}\n      {kind} :: {row.key}{f'({row.count})' if row.count > 1 else ''} = {zero}"


def settings_module(groups, rows):
    """One type per group, and one of all groups of a run."""
    body = ""
    for group, meaning in groups.items():
        components = "\n".join(component(row) for row in first_rows(rows, group))
        comment = textwrap.fill(f"Group &{group}" + (f": {meaning}" if meaning else ""), 110,
                                initial_indent="   !> ", subsequent_indent="   !> ")
        body += f"{comment}\n   type :: {group}_settings_t\n{components}\n   end type {group}_settings_t\n\n"
    run = [group for group in groups if group != BENCH]
    body += "   !> All groups of a run\n   type :: group_settings_t\n"
    body += "".join(f"      !> Group &{group}\n      type({group}_settings_t) :: {group}\n" for group in run)
    body += "   end type group_settings_t\n"
    return module("group_settings", "Settings: one type per namelist group.",
                  ["kinds, only: ip, wp", "strings, only: text_t"],
                  ["group_settings_t", *(f"{group}_settings_t" for group in groups)], body)


def fill_module(groups, rows):
    """Procedures that fill the types, one per group."""
    run = [group for group in groups if group != BENCH]
    parts = ["   !> Fill all groups of a run.\n   pure subroutine fill_groups(values, settings)\n"
             "      !> Values, (row of the table)\n      type(value_t), intent(in) :: values(:)\n"
             "      !> Settings to fill\n      type(group_settings_t), intent(inout) :: settings\n\n"
             + "".join(f"      call fill_{group}(values, settings%{group})\n" for group in run)
             + "   end subroutine fill_groups\n"]
    for group in groups:
        calls = "".join(f"      call take(values, '{group}.{row.key}', settings%{row.key})\n"
                        for row in first_rows(rows, group))
        parts.append(f"   !> Fill group &{group}.\n   pure subroutine fill_{group}(values, settings)\n"
                     "      !> Values, (row of the table)\n      type(value_t), intent(in) :: values(:)\n"
                     f"      !> Settings to fill\n      type({group}_settings_t), intent(inout) :: settings\n\n"
                     f"{calls}   end subroutine fill_{group}\n")
    uses = ["group_settings, only: group_settings_t"]
    uses += [f"group_settings, only: {group}_settings_t" for group in groups]
    return module("fill_groups", "Copies the values of the table of entries to the settings.",
                  [*uses, "namelist_values, only: value_t", "take_entry, only: take"],
                  ["fill_groups", f"fill_{BENCH}"], "", "\n".join(parts))


def main(table, folder):
    """Write the sources."""
    try:
        groups, rows = read_table(Path(table).read_text(encoding="utf-8"))
    except TableError as error:
        sys.exit(f"{table}: {error}")
    Path(folder).mkdir(parents=True, exist_ok=True)
    for name, make in (("entry_table", table_module), ("group_settings", settings_module),
                       ("fill_groups", fill_module)):
        (Path(folder) / f"{name}.f90").write_text(make(groups, rows), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
