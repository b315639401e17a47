"""Make what follows from the table of namelist entries.

make_entries.py ENTRIES.txt FOLDER: the Fortran sources entry_table.f90 (the table as constants), settings.f90 (one type
per group), fill_groups.f90 (fills these types) and pair_entries.f90 (numbers that pairs of materials may have).
make_entries.py ENTRIES.txt FOLDER --pairs: pair_values.f90, the type of these numbers in a force law.
make_entries.py ENTRIES.txt FOLDER --alone: of a table with one group NAME, which is no group of a run, NAME_table.f90,
NAME_settings.f90 and fill_NAME.f90.
make_entries.py ENTRIES.txt PAGE.md [--check]: the table of the manual, between the lines <!-- entries --> and
<!-- /entries -->; with --check it must be there already.
make_entries.py ENTRIES.txt FOLDER --package [--check]: schema.json and settings.py of the Python package polydem.
"""

import sys
from pathlib import Path

# No compiled files among the sources
sys.dont_write_bytecode = True
from generator.manual import update_manual  # noqa: E402
from generator.package import update_package  # noqa: E402
from generator.pairs import pair_module, value_module  # noqa: E402
from generator.settings import fill_module, lone_modules, settings_module, table_module  # noqa: E402
from generator.table import TableError, read_table  # noqa: E402


def main(table, target, *options):
    """Write the sources or the manual."""
    try:
        groups, rows = read_table(Path(table).read_text(encoding="utf-8"), Path(table).parent)
    except TableError as error:
        sys.exit(f"{table}: {error}")
    if target.endswith(".md"):
        update_manual(target, rows, "--check" in options)
        return
    if "--package" in options:
        stale = update_package(Path(target), groups, rows, "--check" in options)
        if stale and "--check" in options:
            sys.exit(f"{' and '.join(stale)} in {target} are not those of the table; "
                     "cmake --build BUILD --target entries_manual makes them")
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
