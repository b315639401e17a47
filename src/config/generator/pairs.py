"""Fortran of the parameters of contacts that pairs of materials may have."""

from .fortran import component, module
from .table import MIXED, PAIRS


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
