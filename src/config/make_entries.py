"""Make what follows from the table of namelist entries.

make_entries.py ENTRIES.txt FOLDER: the Fortran sources entry_table.f90 (the table as constants), settings.f90 (one type
per group), fill_groups.f90 (fills these types) and pair_entries.f90 (numbers that pairs of materials may have).
make_entries.py ENTRIES.txt FOLDER --pairs: pair_values.f90, the type of these numbers in a force law.
make_entries.py ENTRIES.txt FOLDER --alone: of a table with one group NAME, which is no group of a run, NAME_table.f90,
NAME_settings.f90 and fill_NAME.f90.
make_entries.py ENTRIES.txt PAGE.md [--check]: the table of the manual, between the lines <!-- entries --> and
<!-- /entries -->; with --check it must be there already.
"""

import re
import sys
import textwrap
from collections import namedtuple
from pathlib import Path

Row = namedtuple("Row", "group key type count default unit allowed needs meaning usual mixed")
#: Fields that may be left out at the end of a row
LATE = 2
#: A group, whether a file may contain it several times, and the name and the rows of the block that it includes
Group = namedtuple("Group", "meaning is_repeatable block rows", defaults=("", ()))
#: Components: the Fortran type of one value and its value before it is filled
TYPES = {"real": ("real(wp)", "0.0_wp"), "integer": ("integer(ip)", "0_ip"), "logical": ("logical", ".false.")}
TEXTS = ("word", "path", "name")
#: The row of the name of a repeatable group, from its key to what it is used with
NAME_ROW = ("name", "name", 1, "required", "", "", "")
#: A usual range with what may have been meant by a value outside it
BOUND = r"(?:>=|>|<=|<|multiple_of) [-+.0-9e]+"
USUAL = re.compile(rf"{BOUND}(?:(?:, | or | / ){BOUND})*: .+")
#: Groups that a recipe makes, which --expand prints
PARTS = ("grains", "wall")
#: Groups that have the numbers of &forces that are mixed, and how they say it
PAIRS = {"material": "; of two materials: {}", "contact_pair": ""}
#: How numbers a and b of two materials are mixed
MIXED = {"smaller one": "min({a}, {b})", "mean": "0.5_wp*({a} + {b})", "geometric mean": "sqrt({a})*sqrt({b})",
         "harmonic mean": "2.0_wp*min({a}, {b})*(max({a}, {b})/({a} + {b}))"}
#: Longest piece of a text on a line
WIDTH = 90


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
            block, _, meaning = rest.partition(": ")
            blocks[block] = Group(meaning, False)
        elif word == "include":
            if rest not in blocks:
                raise TableError(f"line {number}: there is no block {rest} above it")
            name = next(reversed(groups))
            groups[name] = groups[name]._replace(block=rest, rows=blocks[rest].rows)
            rows += [row._replace(group=name) for row in blocks[rest].rows]
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
    return any(row == other._replace(group=row.group) for other in groups[row.group].rows)


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
    if row.type not in (*TYPES, *TEXTS) or (row.type == "logical" and row.count != 1):
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


def is_optional(row):
    """Whether an entry is a single number without a default."""
    return row.type in ("real", "integer") and row.count == 1 and row.default == ""


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


def table_module(groups, rows, name="entry_table"):
    """The table as constants, one per group: a statement cannot have more than 255 lines."""
    body = ""
    for group in groups:
        entries = []
        for row in rows:
            if row.group == group:
                texts = [literal(field) for field in (row.default, row.unit, row.allowed, row.needs, row.meaning,
                                                      *(row.usual.split(": ", 1) if row.usual else ()))]
                if row.default == "required":
                    texts[0] = "required"
                entries.append(f"      entry_t('{row.group}', '{row.key}', '{row.type}', {row.count}, {texts[0]}, "
                               f"{texts[1]}, &\n         " + ", &\n         ".join(texts[2:]) + ")")
        body += (f"   !> Group &{group}\n   type(entry_t), parameter :: {group}_entries(*) = [ &\n"
                 + ", &\n".join(entries) + "]\n\n")
    names = ", &\n      ".join(f"{group}_entries" for group in groups)
    body += f"   !> The table of entries\n   type(entry_t), parameter :: entries(*) = [ &\n      {names}]\n\n"
    return module(name, "Table of namelist entries.", ["namelist_entry, only: entry_t, required"], ["entries"], body)


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
    if row.count == 0 or is_optional(row):
        return f"{comment}\n      {kind}, allocatable :: {row.key}{'(:)' if row.count == 0 else ''}"
    return f"{comment}\n      {kind} :: {row.key}{f'({row.count})' if row.count > 1 else ''} = {zero}"


def group_types(groups, rows, base=""):
    """One type per block and per group."""
    body = ""
    blocks = {group.block: group.rows for group in groups.values() if group.block}
    for block, members in blocks.items():
        components = "\n".join(component(row) for row in first_rows(members, block))
        body += (f"   !> Entries that several groups include\n   type :: {block}_settings_t\n{components}\n"
                 f"   end type {block}_settings_t\n\n")
    for group, (meaning, _, block, members) in groups.items():
        common = {row.key for row in members}
        components = "\n".join(component(row) for row in first_rows(rows, group) if row.key not in common)
        comment = textwrap.fill(f"Group &{group}" + (f": {meaning}" if meaning else ""), 110,
                                initial_indent="   !> ", subsequent_indent="   !> ")
        kind = f", extends({block}_settings_t)" if block else base
        body += f"{comment}\n   type{kind} :: {group}_settings_t\n{components}\n   end type {group}_settings_t\n\n"
    return body


def settings_module(groups, rows):
    """One type per group, and one of all groups."""
    body = group_types(groups, rows)
    body += "   !> All settings of a run. They do not change after reading\n"
    body += "   type, extends(source_locations_t) :: settings_t\n"
    for group, (_, is_repeatable, *_) in groups.items():
        kind, shape = (", allocatable", "(:)") if is_repeatable else ("", "")
        body += (f"      !> Group{'s' * is_repeatable} &{group}{', in the order of the file' * is_repeatable}\n"
                 f"      type({group}_settings_t){kind} :: {group}{shape}\n")
    body += "   end type settings_t\n"
    blocks = dict.fromkeys(group.block for group in groups.values() if group.block)
    return module("settings", "Settings of a run: one type per namelist group.",
                  ["kinds, only: ip, wp", "source_locations, only: source_locations_t", "strings, only: text_t"],
                  ["settings_t", *(f"{name}_settings_t" for name in (*blocks, *groups))], body)


def assignment(row):
    """Statement that copies the value of an entry to its component."""
    values = {"real": "reals", "integer": "integers", "logical": "flag"}.get(row.type)
    values = values or ("text" if row.count == 1 else "texts")
    first = "(1)" if row.count == 1 and values in ("reals", "integers") else ""
    place = f"instance%values(row_of(instance, '{row.key}'))%{values}"
    given = f"      if (size({place}) > 0) &\n" if is_optional(row) else ""
    return f"{given}      settings%{row.key} = &\n         {place}{first}\n"


def storage(row):
    """Statement that copies a component to the values of its entry."""
    kinds = {"real": "reals", "integer": "integers", "logical": "flag"}
    value = f"settings%{row.key}"
    if row.type in ("real", "integer") and row.count == 1:
        value = f"[{value}]"
    return f"      call store_value(instance, '{row.key}', {kinds.get(row.type, 'text')}={value})\n"


def fill_procedure(rows, group):
    """The procedure that fills the type of a group."""
    copies = "".join(assignment(row) for row in first_rows(rows, group))
    return (f"   !> Fill a group &{group}.\n   pure subroutine fill_{group}(instance, settings)\n"
            "      !> The group with its values\n      type(instance_t), intent(in) :: instance\n"
            f"      !> Settings to fill\n      type({group}_settings_t), intent(inout) :: settings\n\n"
            f"{copies}   end subroutine fill_{group}\n")


def fill_module(groups, rows):
    """Procedures that fill the types, one per group, and the one that fills all groups."""
    allocations, cases = "", ""
    for group in groups:
        place = ""
        if groups[group].is_repeatable:
            place = "(instances(k)%number)"
            allocations += (f"      if (allocated(settings%{group})) deallocate (settings%{group})\n"
                            f"      allocate (settings%{group}(count(instances%group == '{group}')))\n")
        cases += f"         case ('{group}')\n            call fill_{group}(instances(k), settings%{group}{place})\n"
    parts = ["   !> Fill all groups of a run.\n   pure subroutine fill_groups(instances, settings)\n"
             "      !> Instances of all groups\n      type(instance_t), intent(in) :: instances(:)\n"
             "      !> Settings to fill\n      type(settings_t), intent(inout) :: settings\n      integer :: k\n\n"
             f"{allocations}      do k = 1, size(instances)\n         select case (instances(k)%group)\n{cases}"
             "         end select\n      end do\n   end subroutine fill_groups\n"]
    parts += [fill_procedure(rows, group) for group in groups]
    for group in (group for group in PARTS if group in groups):
        copies = "".join(storage(row) for row in first_rows(rows, group))
        parts.append(f"   !> Store a group &{group} in the values of an instance.\n"
                     f"   pure subroutine store_{group}(settings, instance)\n"
                     f"      !> Settings of the group\n      type({group}_settings_t), intent(in) :: settings\n"
                     "      !> The group; its values change\n      type(instance_t), intent(inout) :: instance\n\n"
                     f"{copies}   end subroutine store_{group}\n")
    stores = [f"store_{group}" for group in PARTS if group in groups]
    uses = [f"settings, only: {group}_settings_t" for group in groups]
    used = f"group_instances, only: instance_t, row_of{', store_value' * bool(stores)}"
    return module("fill_groups", "Copies the values of the table of entries to the settings, and those of parts back.",
                  [used, "settings, only: settings_t", *uses],
                  ["fill_groups", *stores], "", "\n".join(parts))


def lone_modules(groups, rows):
    """Table, settings and filling of a group that is none of a run."""
    (name,) = groups
    body = group_types(groups, rows, ", extends(source_locations_t)")
    kinds = ", ".join(kind for kind in ("ip", "wp") if f"({kind})" in body)
    settings = module(f"{name}_settings", f"Settings of a {name}.",
                      [f"kinds, only: {kinds}", "source_locations, only: source_locations_t", "strings, only: text_t"],
                      [f"{name}_settings_t"], body)
    fill = module(f"fill_{name}", "Copies the values of the table of entries to the settings.",
                  [f"{name}_settings, only: {name}_settings_t", "group_instances, only: instance_t, row_of"],
                  [f"fill_{name}"], "", fill_procedure(rows, name))
    return {f"{name}_table": table_module(groups, rows, f"{name}_table"), f"{name}_settings": settings,
            f"fill_{name}": fill}


def pair_module(rows):
    """Numbers of &forces that pairs of materials may have: their names, where they stand, and how they are mixed."""
    keys = [row.key for row in rows if row.mixed]
    names = ", &\n".join(f"      '{key}'" for key in keys)
    body = (f"   !> How many there are\n   integer, parameter :: n_pair_entries = {len(keys)}\n"
            "   !> Their keys\n   character(len=*), parameter :: pair_entries(n_pair_entries) = &\n"
            f"      [character(len={max(map(len, keys))}) :: &\n{names}]\n")
    for k, key in enumerate(keys, 1):
        body += f"   !> Place of {key}\n   integer, parameter :: at_{key} = {k}\n"
    common = ", &\n".join(f"         forces%{key}" for key in keys)
    parts = ["   !> Numbers that are those of all pairs if no group gives others\n"
             "   pure function common_values(forces) result(values)\n      !> Group &forces\n"
             "      type(forces_settings_t), intent(in) :: forces\n      real(wp) :: values(n_pair_entries)\n\n"
             f"      values = [ &\n{common}]\n   end function common_values\n"]
    for group in PAIRS:
        takes = "".join(f"      if (allocated(group%{key})) values({k}) = group%{key}\n"
                        for k, key in enumerate(keys, 1))
        parts.append(f"   !> Take what a group &{group} gives.\n"
                     f"   pure subroutine take_{group}(group, values)\n      !> The group\n"
                     f"      type({group}_settings_t), intent(in) :: group\n"
                     "      !> The numbers\n      real(wp), intent(inout) :: values(n_pair_entries)\n\n"
                     f"{takes}   end subroutine take_{group}\n")
    mixes = "".join(f"      mixed({k}) = {MIXED[row.mixed].format(a=f'a({k})', b=f'b({k})')}\n"
                    for k, row in enumerate((row for row in rows if row.mixed), 1))
    parts.append("   !> Numbers of the contacts of two materials. Equal ones are not changed, not even by rounding,\n"
                 "   !> and both orders give the same bits.\n   pure function mixed_values(a, b) result(mixed)\n"
                 "      !> Numbers of both materials\n"
                 "      real(wp), intent(in) :: a(n_pair_entries), b(n_pair_entries)\n"
                 "      real(wp) :: mixed(n_pair_entries)\n\n"
                 f"{mixes}      where (abs(a - b) <= 0.0_wp) mixed = a\n   end function mixed_values\n")
    groups = ["forces", *PAIRS]
    return module("pair_entries", "Numbers of &forces that pairs of materials may have.",
                  ["kinds, only: wp", *(f"settings, only: {group}_settings_t" for group in groups)],
                  ["n_pair_entries", "pair_entries", *(f"at_{key}" for key in keys), "common_values", "mixed_values",
                   *(f"take_{group}" for group in PAIRS)], body, "\n".join(parts))


def value_module(rows):
    """The type of these numbers in a force law, and what fills it from their table."""
    pairs = [row for row in rows if row.mixed]
    components = "".join(f"{component(row._replace(meaning=row.meaning.partition('; ')[0], default='0'))}\n"
                         .replace(f"real(wp) :: {row.key} = 0.0_wp", f"type(pair_value_t) :: {row.key}")
                         for row in pairs)
    body = ("   !> Parameters of contacts, as in the namelist, but for the tangential stiffness: it is in N/m2\n"
            "   type :: pair_parameters_t\n"
            "      !> Number of materials besides number 0\n      integer(ip) :: n_materials = 0_ip\n"
            f"{components}   end type pair_parameters_t\n")
    sets = "".join(f"      pairs%{row.key} = new_pair_value(table(:, :, {k}), one({k}))\n"
                   for k, row in enumerate(pairs, 1))
    cases = "".join(f"      case ({k})\n         value = pairs%{row.key}\n" for k, row in enumerate(pairs, 1))
    contains = ("   !> Set all parameters.\n   pure subroutine set_parameters(pairs, table, one)\n"
                "      !> The parameters\n      type(pair_parameters_t), intent(inout) :: pairs\n"
                "      !> Values of each pair of materials, (0:n, 0:n, parameter)\n"
                "      real(wp), intent(in) :: table(0:, 0:, :)\n"
                "      !> Common factor of each parameter if its values differ, positive\n"
                "      real(wp), intent(in) :: one(:)\n\n"
                f"      pairs%n_materials = ubound(table, 1, kind=ip)\n{sets}   end subroutine set_parameters\n\n"
                "   !> A parameter by its place in `pair_entries`\n"
                "   pure type(pair_value_t) function parameter_at(pairs, place) result(value)\n"
                "      type(pair_parameters_t), intent(in) :: pairs\n      !> Its place\n"
                "      integer, intent(in) :: place\n\n"
                f"      select case (place)\n{cases}      end select\n   end function parameter_at\n")
    return module("pair_values", "Parameters of contacts that may differ between pairs of materials.",
                  ["kinds, only: ip, wp", "pair_value, only: new_pair_value, pair_value_t"],
                  ["pair_parameters_t", "set_parameters", "parameter_at"], body, contains)


def manual(rows):
    """The table of entries in Markdown."""
    text = ("| group | key | type | unit | default | range | used with | meaning |\n"
            "|---|---|---|---|---|---|---|---|\n")
    for row in rows:
        kind = f"{row.count} {row.type}s" if row.count > 1 else row.type + (" list" if row.count == 0 else "")
        is_text = row.type in TEXTS and row.count > 0
        default = f"`'{row.default}'`" if is_text and row.default != "required" else row.default
        allowed = ", ".join(row.allowed.split()) if row.type == "word" else row.allowed
        if row.type == "name":
            allowed = f"name of a &{row.allowed}" if row.allowed else "at most 64 letters, digits, _"
        if row.usual:
            allowed += f"; usual: {row.usual.partition(': ')[0]}"
        key, _, words = row.needs.rpartition(":")
        used = ", ".join(words.split())
        cells = [f"&{row.group}", f"`{row.key}`", kind, row.unit, default, allowed,
                 f"{key} = {used}" if key not in ("", "name") else used, row.meaning]
        text += "|" + "".join(f" {cell} |" if cell else " |" for cell in cells) + "\n"
    return text


def update_manual(page, rows, checks):
    """Replace the table in the manual, or check that it is there."""
    path, opening, closing = Path(page), "<!-- entries -->\n", "<!-- /entries -->\n"
    before, _, rest = path.read_text(encoding="utf-8").partition(opening)
    present, mark, after = rest.partition(closing)
    if not mark:
        sys.exit(f"{page} has no lines {opening}and {closing}")
    if present == manual(rows):
        print(f"{page} has the table of entries")
    elif checks:
        sys.exit(f"the table of entries in {page} is not that of the code; "
                 "cmake --build BUILD --target entries_manual makes it")
    else:
        path.write_text(before + opening + manual(rows) + closing + after, encoding="utf-8")
        print(f"{page} has a new table of entries")


def main(table, target, *options):
    """Write the sources or the manual."""
    try:
        groups, rows = read_table(Path(table).read_text(encoding="utf-8"), Path(table).parent)
    except TableError as error:
        sys.exit(f"{table}: {error}")
    if target.endswith(".md"):
        update_manual(target, rows, "--check" in options)
        return
    if "--pairs" in options:
        made = {"pair_values": value_module(rows)}
    elif "--alone" in options:
        made = lone_modules(groups, rows)
    else:
        made = {"entry_table": table_module(groups, rows), "settings": settings_module(groups, rows),
                "fill_groups": fill_module(groups, rows), "pair_entries": pair_module(rows)}
    Path(target).mkdir(parents=True, exist_ok=True)
    for name, text in made.items():
        (Path(target) / f"{name}.f90").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
