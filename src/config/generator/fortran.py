"""What all generated Fortran has in common: modules, components of types, texts."""

import textwrap

from .table import TEXTS

#: Components: the Fortran type of one value and its value before it is filled
TYPES = {"real": ("real(wp)", "0.0_wp"), "integer": ("integer(ip)", "0_ip"), "logical": ("logical", ".false.")}
#: Longest piece of a text on a line
WIDTH = 90


def is_optional(row):
    """Whether an entry is a single number without a default."""
    return row.type in ("real", "integer") and row.count == 1 and row.default == ""


def literal(text):
    """A Fortran text, broken into lines."""
    pieces = [text[k:k + WIDTH] for k in range(0, len(text), WIDTH)] or [""]
    return "// &\n         ".join("'" + piece.replace("'", "''") + "'" for piece in pieces)


def module(name, purpose, uses, public, body, contains=""):
    """A module that says where it comes from."""
    lines = [f"!> {purpose} Made by make_entries.py from entries.txt.", f"module polydem_{name}"]
    lines += [f"   use polydem_{used}" for used in uses]
    lines += ["   implicit none", "   private", *(f"   public :: {word}" for word in public), "", body.rstrip()]
    if contains:
        lines += ["", "contains", "", contains.rstrip()]
    return "\n".join([*lines, "", f"end module polydem_{name}", ""])


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
