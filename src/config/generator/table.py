"""Reads the table of namelist entries, entries.txt."""

import re
from collections import namedtuple
from pathlib import Path

Row = namedtuple("Row", "group key type count default unit allowed needs meaning usual mixed")
#: Fields that may be left out at the end of a row
LATE = 2
#: A group, whether a file may contain it several times, and the block that it includes
Group = namedtuple("Group", "meaning is_repeatable block", defaults=(None,))
#: A block, the block that it includes, and the rows of both
Block = namedtuple("Block", "name base rows is_repeatable", defaults=(None, (), False))
#: Types of entries: numbers and logicals, and texts
NUMBERS = ("real", "integer", "logical")
TEXTS = ("word", "path", "name")
#: The row of the name of a repeatable group, from its key to what it is used with
NAME_ROW = ("name", "name", 1, "required", "", "", "")
#: A usual range with what may have been meant by a value outside it
BOUND = r"(?:>=|>|<=|<|multiple_of) [-+.0-9e]+"
USUAL = re.compile(rf"{BOUND}(?:(?:, | or | / ){BOUND})*: .+")
#: Groups that have the numbers of &forces that are mixed, and how they say it
PAIRS = {"material": "; of two materials: {}", "contact_pair": ""}
#: How numbers a and b of two materials are mixed
MIXED = {"smaller one": "min({a}, {b})", "mean": "0.5_wp*({a} + {b})", "geometric mean": "sqrt({a})*sqrt({b})",
         "harmonic mean": "2.0_wp*min({a}, {b})*(max({a}, {b})/({a} + {b}))"}


class TableError(Exception):
    """A table that cannot be understood."""


def read_table(text, folder=Path()):
    """Groups by name, and all rows, of a table in a folder."""
    groups, lists, rows, blocks, block = {}, {}, [], {}, ""
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        word, _, rest = line.partition(" ")
        if word == "group":
            name, _, meaning = rest.partition(": ")
            name, mark, _ = name.partition(" *")
            groups[name], block = Group(meaning, mark != ""), ""
        elif word == "block":
            block = rest.partition(": ")[0]
            blocks[block] = Block(block)
        elif word == "include":
            base = included(with_lists(rest, lists, number), blocks, number)
            if block:
                more = tuple(row._replace(group=block) for row in base.rows)
                blocks[block] = Block(block, base, blocks[block].rows + more)
            else:
                name = next(reversed(groups))
                groups[name] = groups[name]._replace(block=base)
                rows += [row._replace(group=name) for row in base.rows]
        elif word == "list":
            read_lists([line], lists, number)
        elif word == "lists":
            read_lists((folder / rest).read_text(encoding="utf-8").splitlines(), lists, number)
        elif block:
            earlier = blocks[block].rows
            blocks[block] = blocks[block]._replace(rows=(*earlier, read_row(line, lists, number, blocks, earlier)))
        else:
            rows.append(read_row(line, lists, number, groups, rows))
    rows = with_pairs(groups, [row for row in rows if not is_replaced(row, groups, rows)])
    for row in rows:
        if row.type == "name" and row.allowed and not groups.get(row.allowed, Group("", False)).is_repeatable:
            raise TableError(f"{row.key} of {row.group} is the name of a group {row.allowed}, which is not repeatable")
    return groups, rows


def read_lists(lines, lists, number):
    """Add the lists among some lines."""
    for line in lines:
        word, _, rest = line.partition(" ")
        if word == "list":
            name, _, words = rest.partition(" = ")
            lists[name] = with_lists(words.strip(), lists, number)


def included(text, blocks, number):
    """The block of a line `include BLOCK`, or `include BLOCK with CONDITION`, with which all of its rows are used."""
    name, _, condition = text.partition(" with ")
    if name not in blocks:
        raise TableError(f"line {number}: there is no block {name} above it")
    block = blocks[name]
    return block._replace(rows=tuple(row._replace(needs=condition) for row in block.rows)) if condition else block


def read_row(line, lists, number, groups, earlier):
    """A row of the last one of the groups, or blocks, behind earlier rows."""
    fields = ["" if field.strip() == "-" else field.strip() for field in line.split(" | ")]
    if not len(Row._fields) - LATE <= len(fields) <= len(Row._fields):
        raise TableError(f"line {number}: {len(fields)} fields, not {len(Row._fields) - LATE}")
    fields += [""] * (len(Row._fields) - len(fields))
    if not fields[3].isdigit():
        raise TableError(f"line {number}: {fields[3]} is not a number of values")
    row = Row(*(with_lists(field, lists, number) for field in fields))._replace(count=int(fields[3]))
    problem = problem_of(row, groups, earlier)
    if problem:
        raise TableError(f"line {number}: {problem}")
    return row


def is_included(row, groups):
    """Whether a row is that of the block that its group includes."""
    block = groups[row.group].block
    return block is not None and any(row == other._replace(group=row.group) for other in block.rows)


def is_replaced(row, groups, rows):
    """Whether a row of a block is not in use, since the group has rows of its own of the same key."""
    own = (other for other in rows if (other.group, other.key) == (row.group, row.key))
    return is_included(row, groups) and not all(is_included(other, groups) for other in own)


def with_pairs(groups, rows):
    """The rows, and those of the numbers of pairs behind the other ones of their groups."""
    for group, ending in PAIRS.items():
        if group in groups:
            place = max(k for k, row in enumerate(rows) if row.group == group) + 1
            rows[place:place] = [row._replace(group=group, default="", needs="", mixed="",
                                              meaning=row.meaning.partition("; ")[0] + ending.format(row.mixed))
                                 for row in rows if row.mixed]
    return rows


def problem_of(row, groups, earlier):
    """What is wrong with a row that follows others; empty if nothing is."""
    if row.group != next(reversed(groups), None):
        return "the row is not in its group"
    if row.type not in (*NUMBERS, *TEXTS) or (row.type == "logical" and row.count != 1):
        return f"there is no entry of type {row.type} with {row.count} values"
    if row.usual and (row.type != "real" or not USUAL.fullmatch(row.usual)):
        return f"{row.usual} is no usual range of {row.key}"
    if row.mixed and (row.mixed not in MIXED or (row.group, row.type, row.count) != ("forces", "real", 1)):
        return f"{row.key} is not mixed: {row.mixed}"
    same = [other for other in earlier if (other.group, other.key) == (row.group, row.key)]
    if any((other.type, other.count) != (row.type, row.count) for other in same):
        return f"{row.key} has another type in an earlier row"
    is_first = all(other.group != row.group for other in earlier)
    if is_first and groups[row.group].is_repeatable and row[1:8] != NAME_ROW:
        return "the first row of a repeatable group is its name, of type name and required"
    return ""


def with_lists(text, lists, number):
    """The text with the words of each {list}."""
    for name in re.findall(r"{(\w+)}", text):
        if name not in lists:
            raise TableError(f"line {number}: there is no list {name} above it")
        text = text.replace(f"{{{name}}}", lists[name])
    return text
