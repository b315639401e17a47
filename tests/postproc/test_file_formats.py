"""The page of file formats says what is in the files that the program writes."""

import os
import re

import h5py
import pytest
from file_format_tables import FILES, PAGE, part_of, table_of, write_file

PROGRAM = os.environ["POLYDEM_PROGRAM"]


@pytest.mark.parametrize("table", FILES)
def test_the_table_of_a_file_is_that_of_the_page(table, tmp_path):
    """After a change: python3 tests/postproc/file_format_tables.py PROGRAM."""
    path = write_file(PROGRAM, table, tmp_path)
    assert part_of(PAGE.read_text(encoding="utf-8"), table).group(2) == table_of(path)
    with h5py.File(path, "r") as file:
        version = file.attrs["schema_version"]
    assert re.search(rf"`schema_version` \({version}\)", PAGE.read_text(encoding="utf-8"))
