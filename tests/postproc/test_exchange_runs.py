"""Counts of runs on several ranks, from results whose counters are made up."""

import shutil
from dataclasses import replace

import h5py
import numpy as np
import pytest
from polydem_lab.scaling.exchange_runs import COUNTERS, MARGIN, SHAPE, read_run, read_runs, runs_tables, write_runs
from polydem_post.base.result_file import ResultError
from polydem_post.command_line.main import main
from polydem_post.read.trajectory import Trajectory

#: Of 16 ranks, 101 steps, settled three times
VALUES = {
    "redistributions": 3, "partitions of space": 1, "rectangles": 70, "migrations": 1000,
    "migrations at the start": 900, "halo bodies, summed over steps": 10100, "messages": 7000,
    "bytes in messages": 1480000, "messages at the start": 500, "bytes at the start": 900000, "halo messages": 6000,
    "halo bytes": 480000, "maximum per rank: bodies": 3, "maximum per rank: pairs": 20,
    "maximum per rank: halo bodies": 1010, "maximum per rank: messages": 401, "maximum per rank: bytes": 48000,
}


@pytest.fixture
def make_result(finished, tmp_path):
    """Copy the finished result under a name, with these counters."""

    def make(name, counters, margin="0.0"):
        folder = tmp_path / name
        shutil.copytree(finished, folder)
        with h5py.File(folder / "profile.h5", "a") as file:
            group = file.require_group("counters")
            for old in list(group):
                del group[old]
            group["name"] = np.array(list(counters), dtype=h5py.string_dtype())
            group["value"] = np.array(list(counters.values()), dtype=np.int64)
            del file["provenance/resolved_input"]
            file["provenance/resolved_input"] = f"&boxes\n   margin = 7.0\n/\n&decomposition\n   margin = {margin}\n/\n"
        return folder

    return make


@pytest.fixture
def shared(make_result):
    return make_result("shared", {"steps": 101, "pairs": 130, "ranks": 16, **VALUES})


@pytest.fixture
def alone(make_result):
    return make_result("alone", {"steps": 101, "pairs": 80})


def test_all_counters_of_a_run_are_read(shared):
    run = read_run(shared)
    assert {name: getattr(run, field) for field, name in COUNTERS.items()} == VALUES
    result = Trajectory(shared)
    assert run.bodies == int((~result.frame(0).fixed).sum()) > 0
    assert (run.ranks, run.steps, run.pairs) == (16, 101, 130)
    assert run.state_hash == result.state_hash


def test_the_margin_is_that_of_the_group_decomposition(make_result):
    counters = {"steps": 1, "pairs": 1}
    assert read_run(make_result("a", counters)).margin == 0.0
    run = read_run(make_result("b", counters, "9.5E-003"))
    assert (run.margin, run.as_count().margin) == (0.0095, 0.0095)


def test_counts_are_means_of_a_step_and_ghosts_do_not_follow_in_the_first(shared):
    run = replace(read_run(shared), bodies=40)
    count = run.as_count()
    assert (count.shape, count.margin, count.grains, count.ranks) == (SHAPE, MARGIN, 40, 16)
    assert (count.halo_bodies, count.halo_bodies_most, count.messages, count.bytes) == (100, 10, 60, 4800)
    assert (count.messages_most, count.bytes_most, count.rectangles, count.grains_most) == (5, 480, 70, 3)


def test_the_tables_tell_steps_from_redistributions_and_these_from_the_first(shared, alone):
    runs = [replace(read_run(folder), bodies=40) for folder in (shared, alone)]
    steps, redistributing = runs_tables(runs)
    rows = [dict(zip(steps.heading, row)) for row in steps.rows]
    assert [row["ranks"] for row in rows] == ["1", "16"]
    row = next(row for row in rows if row["ranks"] == "16")
    assert (row["halo bodies per body"], row["most halo bodies"], row["pairs per halo body"]) == ("2.50", "10", "0.500")
    assert (row["bodies, most/mean"], row["pairs, most/mean"]) == ("1.200", "2.462")
    expected = ("101", "3", "1", "100", "250", "50000", "500", "900", "500", "900000")
    assert [row[3:] for row in redistributing.rows] == [expected]


def test_a_run_on_one_rank_has_its_bodies_and_tells_nothing(alone):
    run = read_run(alone)
    assert (run.ranks, run.most_bodies, run.most_pairs, run.halo_bodies, run.messages) == (1, run.bodies, 80, 0, 0)
    assert run.later_redistributions == 0


def test_tables_of_runs_name_the_revision_that_counted(shared, alone, tmp_path):
    runs = [read_run(shared), read_run(alone)]
    assert all(run.revision not in ("", "not recorded") for run in runs)
    for table in runs_tables(runs):
        assert runs[0].revision in table.document("markdown")
    write_runs(runs, tmp_path / "runs.csv")
    older = [line.rpartition(",")[0] for line in (tmp_path / "runs.csv").read_text().splitlines()]
    (tmp_path / "runs.csv").write_text("\n".join(older) + "\n")
    assert {run.revision for run in read_runs(tmp_path / "runs.csv")} == {"not recorded"}


def test_what_is_saved_is_read_again_and_nothing_else_is(shared, alone, tmp_path):
    runs = [read_run(shared), read_run(alone)]
    write_runs(runs, tmp_path / "runs.csv")
    assert read_runs(tmp_path / "runs.csv") == runs
    (tmp_path / "other.csv").write_text("shape,grains\nbox,1\n", encoding="utf-8")
    assert read_runs(tmp_path / "other.csv") == []
    damaged = (tmp_path / "runs.csv").read_text(encoding="utf-8").replace(",101,0.0,", ",101,x0.0,", 1)
    (tmp_path / "runs.csv").write_text(damaged, encoding="utf-8")
    with pytest.raises(ResultError, match="runs.csv: is not a file of .*, or was damaged: line 2: margin is 'x"):
        read_runs(tmp_path / "runs.csv")
    with pytest.raises(ResultError, match="none.csv: there is no such file"):
        read_runs(tmp_path / "none.csv")


def test_results_without_these_counts_are_errors(make_result):
    lacking = {name: value for name, value in VALUES.items() if name != "rectangles"}
    with pytest.raises(ResultError, match=r"lacks counts \(rectangles\)"):
        read_run(make_result("old", {"steps": 5, "pairs": 3, "ranks": 4, **lacking}))
    with pytest.raises(ResultError, match="no steps"):
        read_run(make_result("still", {"steps": 0, "pairs": 3}))


def test_the_command_takes_folders_and_saved_files(shared, alone, tmp_path, capsys):
    saved = str(tmp_path / "saved.csv")
    assert main(["scale", str(shared), str(alone), "--save", saved]) == 0
    printed = capsys.readouterr().out
    assert "### Exact counts of runs, means of a step" in printed and "predicted" not in printed
    assert main(["scale", saved, "--body", "1e-6", "--bodies", "1e5,1e6"]) == 0
    again = capsys.readouterr().out
    assert again.startswith(printed) and again.count("| 4096 |") == 2
    assert "### Time of a step of 100000 bodies" in again and "| run | 0 | 1 |" in again
    assert main(["scale", saved, "--body", "1e-6", "--margin", "3"]) == 2
    assert "nothing was counted for run 3" in capsys.readouterr().err
    assert main(["scale", str(alone)]) == 2
    said = capsys.readouterr()
    assert said.out == "" and "a run on one rank exchanges nothing" in said.err
