"""A table in all forms."""

import csv
import io

import pytest
from polydem_post.base.emit import FORMATS, Table


@pytest.fixture
def table():
    made = Table("sample", "A sample_table", ("name", "time [us]", "share [%]"), note="A note.")
    made.add("a_b & c", "1.5", 20)
    made.add('comma, "quote" | bar', "<2", "~3^2")
    return made


def test_csv_gives_the_cells_back(table):
    assert list(csv.reader(io.StringIO(table.written("csv")))) == [list(row) for row in [table.heading, *table.rows]]


def test_latex_is_booktabs_and_escapes_what_latex_takes_for_commands(table):
    lines = table.written("latex").splitlines()
    assert lines[:2] == [r"\begin{tabular}{lrr}", r"\toprule"]
    assert lines[2] == r"name & time [$\mu$s] & share [\%] \\"
    assert lines[4] == r"a\_b \& c & 1.5 & 20 \\"
    assert r"$<$2 & \textasciitilde{}3\textasciicircum{}2" in lines[5]
    assert lines[-2:] == [r"\bottomrule", r"\end{tabular}"]


def test_markdown_has_as_many_bars_in_every_row(table):
    lines = table.written("markdown").splitlines()
    assert lines[1] == "| --- | ---: | ---: |"
    assert {line.replace(r"\|", "").count("|") for line in lines} == {4}


def test_text_is_aligned(table):
    lines = table.written("text").splitlines()
    assert len({len(line) for line in lines}) == 1
    assert lines[0].index("time [us]") + len("time [us]") == lines[1].index("1.5") + len("1.5")


def test_sentences_stand_to_the_left_and_are_broken_in_latex():
    table = Table("claims", "Claims", ("claim", "says"), texts=2)
    table.add("C1", "a sentence that is longer than forty letters and needs a break")
    assert r"\begin{tabular}{lp{40mm}}" in table.written("latex")
    assert table.written("markdown").splitlines()[1] == "| --- | --- |"


@pytest.mark.parametrize("form", FORMATS)
def test_documents_end_with_one_newline_and_tell_the_title_where_they_can(table, form):
    text = table.document(form)
    assert text.endswith("\n") and not text.endswith("\n\n")
    assert ("A sample_table" in text) == (form != "csv")


def test_a_row_of_wrong_length_is_refused(table):
    with pytest.raises(ValueError, match="table sample: a row of 2 cells under 3 headings"):
        table.add("a", "b")
