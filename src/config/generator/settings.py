"""Fortran of the settings: the table as constants, one type per group, and what fills these types."""

import textwrap

from .fortran import component, is_optional, literal, module

#: Groups that a recipe makes, which expand prints
PARTS = ("grains", "wall")


def first_rows(rows, group):
    """Rows of a group, each key once."""
    return list({row.key: row for row in reversed(rows) if row.group == group}.values())[::-1]


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


def blocks_of(groups):
    """Blocks of groups by name, each behind the one that it includes."""
    found = {}
    for group in groups.values():
        chain = [group.block] if group.block else []
        while chain and chain[-1].base:
            chain.append(chain[-1].base)
        found.update((block.name, block) for block in reversed(chain))
    return found


def type_of(name, comment, rows, block, base=""):
    """A type of settings: the components that it has beside those of its block."""
    common = {row.key for row in block.rows} if block else ()
    components = "\n".join(component(row) for row in first_rows(rows, name) if row.key not in common)
    base = f", extends({block.name}_settings_t)" if block else base
    comment = textwrap.fill(comment, 110, initial_indent="   !> ", subsequent_indent="   !> ")
    return f"{comment}\n   type{base} :: {name}_settings_t\n{components}\n   end type {name}_settings_t\n\n"


def group_types(groups, rows, base=""):
    """One type per block and per group."""
    body = "".join(type_of(name, "Entries that several groups include", block.rows, block.base)
                   for name, block in blocks_of(groups).items())
    for name, (meaning, _, block) in groups.items():
        body += type_of(name, f"Group &{name}" + (f": {meaning}" if meaning else ""), rows, block, base)
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
    return module("settings", "Settings of a run: one type per namelist group.",
                  ["kinds, only: ip, wp", "source_locations, only: source_locations_t", "strings, only: text_t"],
                  ["settings_t", *(f"{name}_settings_t" for name in (*blocks_of(groups), *groups))], body)


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
