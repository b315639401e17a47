"""The page of file formats says what is in the files that the program writes."""

import os
import re

import h5py
import pytest
from file_format_tables import FILES, ON_THE_PAGE, PAGE, part_of, table_of, write_file

PROGRAM = os.environ["POLYDEM_PROGRAM"]


@pytest.mark.parametrize("table", ON_THE_PAGE)
def test_the_table_of_a_file_is_that_of_the_page(table, tmp_path):
    """After a change: python3 tests/postproc/file_format_tables.py PROGRAM."""
    path = write_file(PROGRAM, table, tmp_path)
    assert part_of(PAGE.read_text(encoding="utf-8"), table).group(2) == table_of(path)
    with h5py.File(path, "r") as file:
        version = file.attrs["schema_version"]
    assert re.search(rf"`schema_version` \({version}\)", PAGE.read_text(encoding="utf-8"))


@pytest.mark.parametrize("table", sorted(FILES.keys() - set(ON_THE_PAGE)))
def test_a_file_without_a_table_explains_its_data_sets(table, tmp_path):
    rows = table_of(write_file(PROGRAM, table, tmp_path)).splitlines()[2:]
    assert len(rows) > 5 and all(row.split(" | ")[-1].strip(" |") for row in rows)
