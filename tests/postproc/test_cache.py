"""Counting cache misses, with a stand-in for valgrind where there is none and with the real one where there is."""

import re
import shutil
import subprocess
import sys

import h5py
import numpy as np
import pytest
from polydem_lab.costs import cache, cachegrind
from polydem_lab.costs.cachegrind import PLAIN_MODEL, Model, count_events, finder_functions, machine_model
from polydem_lab.costs.complexity import SOURCES
from polydem_post.base.result_file import ResultError

MODEL = Model(**PLAIN_MODEL)

COUNTS = """desc: D1 cache: 32768 B, 64 B, 8-way associative
cmd: polydem replay
events: Ir I1mr ILmr Dr D1mr DLmr Dw D1mw DLmw
fl=???
fn=__polydem_quadtree_MOD_find
0 100 1 1 50 4 2 20 2 1
12 10 0 0 5 1 0 2 0 0
fn=__polydem_replay_MOD_replay_once
0 9999 9 9 9999 99 99 9999 99 99
fn=???
0 7777 7 7 7777 77 77 7777 77 77
fn=__polydem_sort_MOD_sort_keys
0 1000 0 0 0 0 0 0 0 0
fn=__polydem_quadtree_inlined_MOD_survey
0 5555 5 5 5555 55 55 5555 55 55
fn=__polydem_quadtree_called_MOD_update_tree._omp_fn.0
0 20 0 0 0 0 0 0 0 0
fn=__polydem_sort_and_sweep_o2_MOD_find
0 10 0 0 0 0 0 0 0 0
fn=__polydem_finder_meter_MOD_read
0 4444 4 4 4444 44 44 4444 44 44
summary: 18886 17 17 17831 181 178 17798 178 177
"""

#: Prints what a replay of so many steps would make cachegrind write
FAKE_VALGRIND = """#!{python}
import sys
words = sys.argv
out = next(word.split("=")[1] for word in words if word.startswith("--cachegrind-out-file="))
steps = int(words[words.index("--steps") + 1])
assert words[words.index("--threads") + 1] == "1"
with open(out, "w") as file:
    file.write("events: Ir I1mr ILmr Dr D1mr DLmr Dw D1mw DLmw\\nfn=__polydem_quadtree_MOD_find\\n")
    file.write("0 " + " ".join(str(900 + 100 * k * steps) for k in range(1, 10)) + "\\n")
with open("{log}", "a") as file:
    file.write(" ".join(words) + "\\n")
"""


@pytest.fixture
def bench(tmp_path):
    """A bench folder with two traces."""
    for name, boxes in (("drum_100", 100), ("drum_50", 50)):
        folder = tmp_path / "bench" / "traces" / name
        folder.mkdir(parents=True)
        with h5py.File(folder / "trace.h5", "w") as file:
            file["aabb"] = np.zeros((8, boxes, 4))
    return tmp_path / "bench"


@pytest.fixture
def fake_valgrind(tmp_path, monkeypatch):
    """Commands among which valgrind is a stand-in and perf is not; returns the log of its calls."""
    log, commands = tmp_path / "calls", tmp_path / "commands"
    commands.mkdir()
    (commands / "valgrind").write_text(FAKE_VALGRIND.format(python=sys.executable, log=log), encoding="utf-8")
    (commands / "valgrind").chmod(0o755)
    monkeypatch.setenv("PATH", str(commands))
    return log


def test_only_functions_of_the_finder_count():
    assert count_events(COUNTS, finder_functions(SOURCES)) == {
        "Ir": 1140,
        "I1mr": 1,
        "ILmr": 1,
        "Dr": 55,
        "D1mr": 5,
        "DLmr": 2,
        "Dw": 22,
        "D1mw": 2,
        "DLmw": 1,
    }


def test_counts_are_differences_per_box_and_step(bench, fake_valgrind):
    records = cache.count_misses(bench, "polydem", ["quadtree"], MODEL, (2, 12), say=lambda _: None)
    assert [record.scene for record in records] == ["drum_50", "drum_100"]
    for record in records:
        assert (record.few, record.more) == (2, 8)
        assert record.instructions == pytest.approx(100 / record.boxes)
        assert record.accesses == pytest.approx((400 + 700) / record.boxes)
        assert record.first_level == pytest.approx((500 + 800) / record.boxes)
        assert record.last_level == pytest.approx((600 + 900) / record.boxes)
        assert (record.hardware, record.model) == ("not available", "D1 32 KiB 8-way, LL 1 MiB 16-way")
    assert "--D1=32768,8,64" in fake_valgrind.read_text(encoding="utf-8")


def test_what_is_counted_is_read_back_and_not_counted_again(bench, fake_valgrind):
    first = cache.count_misses(bench, "polydem", ["quadtree"], MODEL, (2, 12), say=lambda _: None)
    calls = fake_valgrind.read_text(encoding="utf-8").count("\n")
    assert cache.read_records([bench]) == first
    again = cache.count_misses(bench, "polydem", ["quadtree", "verlet"], MODEL, (2, 12), say=lambda _: None)
    assert len(again) == 4
    assert fake_valgrind.read_text(encoding="utf-8").count("\n") == 2 * calls
    assert not list(bench.glob("*.unfinished"))


def test_errors_say_what_is_missing(bench, fake_valgrind, tmp_path):
    with pytest.raises(ResultError, match="has no trace of gas; there are drum_100, drum_50"):
        cache.count_misses(bench, "polydem", ["quadtree"], MODEL, (2, 12), ["gas"])
    with pytest.raises(ResultError, match="has 8 steps; more than 8 are needed"):
        cache.count_misses(bench, "polydem", ["quadtree"], MODEL, (8, 12))
    with pytest.raises(ResultError, match="holds no traces"):
        cache.count_misses(tmp_path / "nothing", "polydem", ["quadtree"], MODEL, (2, 12))
    (bench / "cache.csv").write_text("scene,boxes\na,b\n", encoding="utf-8")
    with pytest.raises(ResultError, match="is not a file of ./polydem cache"):
        cache.read_records([bench])


def test_without_valgrind_the_launcher_is_named(monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(ResultError, match="./polydem cache"):
        cachegrind.simulate(["true"], MODEL, re.compile(""))


def test_a_program_that_fails_is_heard_through_the_lines_of_valgrind(monkeypatch, tmp_path):
    valgrind = tmp_path / "valgrind"
    valgrind.write_text("#!/bin/sh\necho 'no such finder: foo' >&2\n"
                        "for k in 1 2 3 4 5 6; do echo '==12== LL refs: 1' >&2; done\nexit 2\n", encoding="utf-8")
    valgrind.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    with pytest.raises(ResultError, match="no such finder: foo") as failure:
        cachegrind.simulate(["program"], MODEL, re.compile(""))
    assert "==12==" not in str(failure.value)


def test_the_caches_of_the_machine_are_read_from_the_system(tmp_path):
    facts = {
        0: (1, "Data", "48K", 12),
        1: (1, "Instruction", "32K", 8),
        2: (2, "Unified", "2048K", 16),
        3: (3, "Unified", "65536K", 16),
    }
    for number, values in facts.items():
        folder = tmp_path / f"index{number}"
        folder.mkdir()
        for name, value in zip(("level", "type", "size", "ways_of_associativity"), values):
            (folder / name).write_text(f"{value}\n", encoding="utf-8")
        (folder / "coherency_line_size").write_text("64\n", encoding="utf-8")
    assert machine_model(tmp_path) == Model("32768,8,64", "49152,12,64", "67108864,16,64")
    assert machine_model(tmp_path / "nothing") == MODEL


def test_counters_of_the_hardware_are_read_and_missing_ones_left_out():
    text = "# started\n\n1234,,instructions:u,100,100.00,,\n<not supported>,,LLC-load-misses:u,0,100.00,,\n"
    assert cachegrind._hardware_events(text) == {"instructions": 1234}


@pytest.mark.skipif(shutil.which("valgrind") is None or shutil.which("cc") is None, reason="no valgrind or no compiler")
def test_a_walk_through_memory_misses_once_per_line(tmp_path):
    (tmp_path / "walk.c").write_text(
        "#include <stdlib.h>\n"
        "double walk(volatile double *a, int n) { double s = 0; for (int k = 0; k < n; k++) s += a[k]; return s; }\n"
        "int main(int c, char **v) { int n = 1 << 16; double *a = calloc(n, 8); double s = 0;\n"
        "for (int k = 0; k < atoi(v[1]); k++) s += walk(a, n); return s != 0; }\n",
        encoding="utf-8",
    )
    subprocess.run(["cc", "-O1", "-fno-inline", "-o", tmp_path / "walk", tmp_path / "walk.c"], check=True)
    few, more = (cachegrind.simulate([str(tmp_path / "walk"), str(n)], MODEL, re.compile("walk")) for n in (2, 5))
    assert more["D1mr"] - few["D1mr"] == pytest.approx(3 * 2**16 / 8, rel=0.01)
    assert more["DLmr"] - few["DLmr"] < 100
