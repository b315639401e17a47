"""Time on many ranks, from counts that are made up."""

import math
from dataclasses import astuple, fields, replace

import pytest
from polydem_lab.scaling.exchange_model import (
    RANKS,
    Count,
    Machine,
    fit_law,
    predict,
    read_counts,
    scale_table,
    strip_table,
)
from polydem_post.base.result_file import ResultError
from polydem_post.command_line.main import main

MACHINE = Machine(body=1e-6, latency=1e-6, bandwidth=1e9)


def counted(ranks, grains=1000000, strip=1.5, **others):
    """A count of squares with a strip of halo bodies all around."""
    halo_bodies = round(4 * strip * math.sqrt(grains / ranks) + 4 * strip**2)
    plain = Count("drum", grains, ranks, 0.2, grains // ranks, ranks * halo_bodies, halo_bodies,
                  5 * ranks, 8, 48 * ranks * halo_bodies, 48 * halo_bodies, 2 * ranks)
    return replace(plain, **others)


def write(path, counts):
    names = [field.name for field in fields(Count)]
    lines = [",".join([*names, "neighbours"])] + [",".join(map(str, [*astuple(count), 5.0])) for count in counts]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.fixture
def law():
    return fit_law([counted(ranks) for ranks in (16, 32, 64)], "drum", 0.2)


def test_the_law_finds_the_strip_that_the_counts_were_made_with(law):
    assert law.strip == pytest.approx(1.5, rel=0.01)
    assert law.spread[0] <= law.strip <= law.spread[1]
    assert (law.messages, law.halo_bytes, law.rectangles, law.counts) == (8, 48.0, 2.0, 3)
    assert law.halo_bodies(10000.0) == pytest.approx(600 + 9, rel=0.01)


def test_few_ranks_do_not_count_and_are_not_enough():
    narrow = [counted(ranks, strip=0.1) for ranks in (1, 2, 4, 8)]
    assert fit_law([*narrow, counted(16)], "drum", 0.2).counts == 1
    with pytest.raises(ResultError, match="at least 9 ranks"):
        fit_law(narrow, "drum", 0.2)
    with pytest.raises(ResultError, match="nothing was counted for box 0.2; there are drum 0.2"):
        fit_law(narrow, "box", 0.2)


def test_one_rank_costs_its_bodies_and_nothing_else(law):
    assert predict(law, MACHINE, 1e6, 1).total == pytest.approx(1.0)


def test_every_part_of_the_time_is_what_it_was_made_of(law):
    machine = replace(MACHINE, halo_body=0.25, imbalance=1.2, sums=3, interval=10.0, redistribution=0.5,
                      redistributed_bytes=100.0)
    step = predict(law, machine, 1e6, 64)
    halo_bodies = law.halo_bodies(1e6 / 64)
    assert step.bodies == pytest.approx(1.2 * 1e6 / 64 * 1e-6)
    assert step.halo_bodies == pytest.approx(0.25 * halo_bodies * 1e-6)
    assert step.neighbours == pytest.approx(8e-6 + halo_bodies * 48 / 1e9)
    assert step.everyone == pytest.approx(3 * 6e-6)
    waits = (13 * 6 + 9 * 8) * 1e-6
    told = 64 * 2 * 32 + 100 * halo_bodies
    assert step.redistributing == pytest.approx((waits + told / 1e9 + 0.5e-6 * 1e6 / 64) / 10.0)
    parts = (step.bodies, step.halo_bodies, step.neighbours, step.everyone, step.redistributing)
    assert step.total == pytest.approx(sum(parts))
    assert predict(law, machine, 1e6, 2).neighbours == pytest.approx(1e-6 + law.halo_bodies(5e5) * 48 / 1e9)


def test_the_time_falls_until_latency_stops_it(law):
    table = scale_table(law, MACHINE, 1e5)
    steps = [float(row[8]) for row in table.rows]
    assert [int(row[0]) for row in table.rows] == list(RANKS)
    assert steps[:8] == sorted(steps[:8], reverse=True)
    assert min(steps) > 8.0
    efficiencies = [float(row[10]) for row in table.rows]
    assert efficiencies[0] == 100.0 and efficiencies == sorted(efficiencies, reverse=True)
    for word in ("1.50 mean distances", "latency 1 us", "1 GB/s", "8 messages", "every 40 steps", "Left out"):
        assert word in table.note


def test_few_ranks_make_no_row_of_strips():
    assert strip_table([counted(2), counted(8)]).rows == []


def test_files_are_read_and_joined(tmp_path):
    counts = [counted(16), counted(64, margin=1.0)]
    paths = [write(tmp_path / f"{k}.csv", [count]) for k, count in enumerate(counts)]
    assert read_counts(paths) == counts
    assert [row[:2] for row in strip_table(counts).rows] == [("drum", "0.2"), ("drum", "1")]


def test_damaged_and_missing_files_are_errors(tmp_path):
    with pytest.raises(ResultError, match="none.csv: there is no such file"):
        read_counts([tmp_path / "none.csv"])
    (tmp_path / "bad.csv").write_text("shape,grains\nbox,many\n", encoding="utf-8")
    with pytest.raises(ResultError, match="is not a file of count_exchange"):
        read_counts([tmp_path / "bad.csv"])
    with pytest.raises(ResultError, match="is not a file of count_exchange"):
        read_counts([write(tmp_path / "zero.csv", [replace(counted(16), ranks=0)])])
    (tmp_path / "empty.csv").write_text("", encoding="utf-8")
    with pytest.raises(ResultError, match="there are no counts"):
        read_counts([tmp_path / "empty.csv"])


def test_the_command_prints_markdown(tmp_path, capsys):
    path = write(tmp_path / "a.csv", [counted(16), counted(64)])
    assert main(["scale", str(path), "--body", "1.5e-6", "--bodies", "1e6", "--shape", "drum"]) == 0
    printed = capsys.readouterr().out
    assert "### Time of a step of 1e+06 bodies, predicted" in printed and "| 4096 |" in printed
    assert "1.5 us per body" in printed and "| drum | 0.2 | 2 |" in printed
    assert main(["scale", str(path), "--body", "1e-6", "--bodies", "1e6", "--margin", "0.3"]) == 2
    assert "nothing was counted" in capsys.readouterr().err
