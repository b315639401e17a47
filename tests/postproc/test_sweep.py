"""Sweeps: tables, folders, several runs at once, what is done after failures and signals, and what is collected."""

import csv
import json
import os
import platform
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import pytest
from polydem_post import Trajectory
from polydem_post.base.result_file import ResultError
from polydem_post.command_line.main import main
from polydem_post.sweep import runner as sweep_run
from polydem_post.sweep.batch import Row, Run, expand, make_sweep, read_table
from polydem_post.sweep.collect import read_outcome, same_states
from polydem_post.sweep.runner import Runner, available_cores, environment, is_running, state_of

#: How long something may take on a busy machine [s]
PATIENCE = 600

#: Stands for the program. The entry toy.does says what a run does; toy.seconds how long it takes: until it is told, or
#: until two are under way.
TOY = """\
#!{python}
import glob, json, os, signal, sys, time
words = sys.argv[1:]
entries = dict(words[k + 1].split("=", 1) for k, word in enumerate(words) if word == "--set")
if "--help" in words:
    print("run FILE.nml {options}")
elif words[0] == "check":
    for key in ("wrong", "false"):
        if "toy." + key in entries:
            sys.exit("polydem: --set toy." + key + "=" + entries["toy." + key] + ": unknown key '" + key + "' in &toy")
else:
    result = entries["output.folder"]
    again = os.path.isdir(result)
    os.makedirs(result, exist_ok=True)
    profile = os.path.join(result, "profile.h5")
    if os.path.exists(profile):
        print("all is done"); sys.exit(0)
    began = time.time()
    def stop(number, _):
        if entries["toy.does"] != "deafen":
            print("stopped"); sys.exit(75)
        signal.signal(number, signal.SIG_DFL)
        open(os.path.join(result, "heard"), "w").close()
    signal.signal(signal.SIGUSR1, stop)
    print("step  100   0:00:03    12.5%", flush=True)
    open(os.path.join(result, "under_way"), "w").close()
    seconds = entries.get("toy.seconds", "0")
    while seconds == "told" and not os.path.exists(os.path.join(result, "told")):
        time.sleep(0.02)
    while seconds == "two" and len(glob.glob(os.path.join(result, "..", "..", "*", "*", "under_way"))) < 2:
        time.sleep(0.02)
    if seconds not in ("told", "two"):
        time.sleep(float(seconds))
    while entries["toy.does"] in ("wait", "deafen") and not again:
        time.sleep(0.02)
    with open(os.path.join(result, "calls"), "a") as file:
        file.write(json.dumps([words, began, time.time(), os.environ.get("OMP_PLACES")]) + "\\n")
    does = entries["toy.does"]
    if does == "fail" or (does == "fail_once" and not again):
        print("polydem: body 7: lost", file=sys.stderr); sys.exit(1)
    if does == "crash" and not again:
        os.kill(os.getpid(), signal.SIGKILL)
    if does == "stop" and not again:
        print("stopped"); sys.exit(75)
    if does == "leave":
        import h5py
        with h5py.File(profile + ".new", "w") as file:
            file.attrs["schema_version"] = 1
            file["status"] = b"finished"
        os.replace(profile + ".new", profile)
"""


@pytest.fixture
def toy(tmp_path):
    """Makes a program that knows --continue or not, and a namelist beside it."""

    def make(options="--continue"):
        program = tmp_path / "polydem"
        program.write_text(TOY.format(python=sys.executable, options=options), encoding="utf-8")
        program.chmod(0o755)
        (tmp_path / "base.nml").write_text("&toy /\n", encoding="utf-8")
        return program

    return make


@pytest.fixture
def sweep_of(tmp_path, toy):
    """Makes a sweep of rows (name, what it does, seconds)."""

    def make(*rows, options="--continue"):
        program = toy(options)
        lines = ["name,toy.does,toy.seconds"] + [",".join(row) for row in rows]
        table = tmp_path / "table.csv"
        table.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return program, make_sweep(tmp_path / "base.nml", tmp_path / "sweep", program, table)

    return make


def calls_of(run):
    path = run.result / "calls"
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def states(sweep):
    return {run.name: state_of(run) for run in sweep.runs}


# --- tables ------------------------------------------------------------------------------------------------------


def test_reads_a_table_as_spreadsheets_write_it(tmp_path):
    path = tmp_path / "table.csv"
    path.write_bytes('\ufeffforces.gravity,name, scene.seed\r\n"0, -9.81",a,1\r\n\r\n,b-2.5,\r\n'.encode())
    columns, rows = read_table(path)
    assert columns == ["forces.gravity", "scene.seed"]
    assert [(row.name, row.values) for row in rows] == [("a", ("0, -9.81", "1")), ("b-2.5", ("", ""))]
    assert [row.place for row in rows] == [f"{path}:2", f"{path}:4"]


@pytest.mark.parametrize(
    "text, line, message",
    [
        ("", 0, "is empty"),
        ("scene.seed\n1\n", 1, "needs a column name"),
        ("name,scene.seed,scene.seed\n", 1, "'scene.seed' is there twice"),
        ("name,seed\n", 1, "'seed' is not an entry"),
        ("name,motion.turn.rate.x\na,1\n", 1, "'motion.turn.rate.x' is not an entry"),
        ("name;scene.seed\na;1\n", 1, "separate the columns with commas, as in name,scene.seed"),
        ("name\tscene.seed\na\t1\n", 1, "separate the columns with commas, as in name,scene.seed"),
        ("name,scene.seed,\na,1,\n", 1, "column 3 has no name; remove the comma too many from each line"),
        ("name,scene.seed x\n", 1, "is not an entry"),
        ("name,output.folder\n", 1, "output.folder cannot vary"),
        ("name,scene.seed\n", 0, "has no rows"),
        ("name,scene.seed\na,1\nb\n", 3, "has 1 values, but the table has 2 columns"),
        ("name,forces.gravity\na,0,-9.81\n", 2, "stands in double quotes"),
        ("name,scene.seed\na,1\n\nA,2\n", 4, "the name A is given twice (first in"),
        ("name,scene.seed\n../x,1\n", 2, "'../x' cannot be a name"),
        ("name,scene.seed\n,1\n", 2, "'' cannot be a name"),
        ('name,scene.seed\na,"1\n', 2, "is not CSV"),
        ("name,scene.seed\na,1\nb,2\0\n", 3, "holds a byte 0" if sys.version_info >= (3, 11) else "is not CSV"),
        ("name,scene.seed\nm\xfchle,1\n", 0, "is not text in UTF-8 (byte 17); save it in UTF-8"),
        ("name,scene.seed\n\x00,\x80", 0, ""),
    ],
)
def test_names_file_and_line_of_a_wrong_table(tmp_path, text, line, message):
    path = tmp_path / "table.csv"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(ResultError) as caught:
        read_table(path)
    assert str(caught.value).startswith(f"{path}:{line}: " if line else f"{path}")
    assert message in str(caught.value)


def test_a_table_that_is_not_there_is_named(tmp_path):
    with pytest.raises(ResultError, match="no.csv: there is no such file"):
        read_table(tmp_path / "no.csv")


def test_lists_give_every_combination_with_every_row():
    given = [Row("p", ("7",), "t:2"), Row("q", ("",), "t:3")]
    columns, rows = expand(["a.x"], given, ["b.y=1,2", "c.z=u v,w", "d.e=5"])
    assert columns == ["a.x", "b.y", "c.z", "d.e"]
    assert [row.name for row in rows] == [f"{n}-y_{y}-z_{z}" for n in "pq" for y in "12" for z in ("u_v", "w")]
    assert rows[5].values == ("", "1", "w", "5")
    assert rows[5].place == "t:3"


def test_values_with_commas_stand_between_semicolons():
    _, rows = expand([], [], ["forces.gravity=0,-9.81;0,-1.62"])
    assert [row.values for row in rows] == [("0,-9.81",), ("0,-1.62",)]
    assert [row.name for row in rows] == ["gravity_0_-9.81", "gravity_0_-1.62"]


def test_runs_are_numbered_where_values_make_no_names():
    assert [row.name for row in expand([], [], ["a.x=1"])[1]] == ["run_0001"]
    assert [row.name for row in expand([], [], ["a.x=1 2,1/2"])[1]] == ["run_0001", "run_0002"]


def test_a_group_with_a_name_is_named_in_a_list():
    columns, rows = expand([], [], ["motion.turn.rate=1,2", "motion.shake_2.rate=3,4"])
    assert columns == ["motion.turn.rate", "motion.shake_2.rate"]
    assert rows[1].name == "turn.rate_1-shake_2.rate_4" and rows[1].values == ("1", "4")


@pytest.mark.parametrize("lists", [["a.b.c.d=1"], ["a.x="], ["a.x=1", "a.x=2"], ["output.folder=a,b"]])
def test_refuses_lists_that_are_none(lists):
    with pytest.raises(ResultError):
        expand([], [], lists)


def test_refuses_a_value_that_is_given_twice():
    with pytest.raises(ResultError, match=r"^scene.seed=2,1,2: the value 2 is given twice$"):
        expand([], [], ["scene.seed=2,1,2"])


# --- making ------------------------------------------------------------------------------------------------------


def test_makes_a_frozen_folder_for_every_run(sweep_of, tmp_path):
    _, sweep = sweep_of(("a", "finish", ""), ("b", "fail", "0.5"))
    (tmp_path / "base.nml").write_text("changed", encoding="utf-8")
    folder = tmp_path / "sweep" / "runs"
    assert (folder / "a" / "overrides.txt").read_text() == "toy.does=finish\n"
    assert (folder / "b" / "overrides.txt").read_text() == "toy.does=fail\ntoy.seconds=0.5\n"
    assert (folder / "b" / "input.nml").read_text() == "&toy /\n"
    assert [run.name for run in sweep.choose([2])] == ["b"]
    assert [run.name for run in sweep.choose([2], ["a"])] == ["a", "b"]
    for numbers, names in (([3], None), ([0], None), (None, ["c"])):
        with pytest.raises(ResultError, match="there is no"):
            sweep.choose(numbers, names)


def test_wrong_rows_are_told_with_their_lines_and_nothing_is_made(toy, tmp_path, capsys):
    table = tmp_path / "table.csv"
    table.write_text("name,toy.wrong,toy.false\na,,\nb,1,\nc,2,3\n", encoding="utf-8")
    words = ["make", str(table), str(tmp_path / "base.nml"), "--output", str(tmp_path / "sweep")]
    assert main(["sweep", "--program", str(toy()), *words]) == 2
    said = capsys.readouterr().err.splitlines()
    assert said == [f"error: {table}:3: --set toy.wrong=1: unknown key 'wrong' in &toy",
                    f"{table}:4: --set toy.wrong=2: unknown key 'wrong' in &toy",
                    f"{table}:4: --set toy.false=3: unknown key 'false' in &toy"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["base.nml", "polydem", "table.csv"]


def test_all_errors_of_a_table_and_of_lists_are_told_at_once(tmp_path, capsys):
    table = tmp_path / "table.csv"
    table.write_text("name,seed,scene.seed\na/b,1,1\nc,1\nc,1,2\nC,1,3\n", encoding="utf-8")
    words = ["make", str(table), "none.nml", "output.folder=a,b", "scene.seed=", "--output", str(tmp_path / "sweep")]
    assert main(["sweep", "--program", "none", *words]) == 2
    said = capsys.readouterr().err
    for line, part in enumerate(["none.nml: there is no such file", ":1: 'seed' is not an entry", ":3: has 2 values",
                                 ":2: 'a/b' cannot be a name", ":5: the name C is given twice",
                                 "output.folder cannot vary", "scene.seed=: a value is missing"]):
        assert part in said.splitlines()[line]
    assert len(said.splitlines()) == 7


def test_does_not_mix_with_what_is_there(sweep_of):
    sweep_of(("a", "finish", ""))
    with pytest.raises(ResultError, match="exists already"):
        sweep_of(("b", "finish", ""))


@pytest.mark.parametrize("words", [["make", "a.nml", "b.nml"], ["make", "a.csv", "b.csv", "c.nml"], ["make", "a.csv"]])
def test_make_takes_one_namelist_and_one_table(words, capsys):
    assert main(["sweep", "--program", "none", *words, "--output", "x"]) == 2
    assert "takes one namelist" in capsys.readouterr().err


def test_make_names_the_next_command_as_a_shell_takes_it(toy, tmp_path, capsys):
    words = ["make", str(tmp_path / "base.nml"), "toy.seconds=0,1", "--output", str(tmp_path / "my sweep")]
    assert main(["sweep", "--program", str(toy()), *words]) == 0
    assert capsys.readouterr().out.strip().endswith(f"next: ./polydem sweep run '{tmp_path}/my sweep'")


# --- running -----------------------------------------------------------------------------------------------------


def test_runs_several_at_once_and_never_more(sweep_of):
    # The first two wait for each other.
    program, sweep = sweep_of(*((f"r{k}", "finish", "two" if k < 2 else "0.3") for k in range(6)))
    assert Runner(program, 4, 2, say=lambda _: None).run(sweep.runs) == 0
    assert set(states(sweep).values()) == {"finished"}
    spans = [call[1:3] for run in sweep.runs for call in calls_of(run)]
    at_once = [sum(begin <= moment < end for begin, end in spans) for moment, _ in spans]
    assert max(at_once) == 2
    assert [len(calls_of(run)) for run in sweep.runs] == [1] * 6
    assert sweep.runs[5].values == {"toy.does": "finish", "toy.seconds": "0.3"}
    words = calls_of(sweep.runs[0])[0][0]
    assert words[:4] == ["run", str(sweep.runs[0].folder / "input.nml"), "--threads", "2"]
    assert words[-3:] == ["--set", f"output.folder={sweep.runs[0].result}", "--continue"]


def test_a_sweep_says_how_far_its_runs_are(sweep_of, monkeypatch):
    monkeypatch.setattr(sweep_run, "SILENCE", 0.3)
    program, sweep = sweep_of(("long", "finish", "1.5"), ("next", "finish", "0"))
    said = []
    assert Runner(program, 1, 1, say=said.append).run(sweep.runs) == 0
    progress = [line for line in said if line.startswith("running")]
    assert progress and set(progress) == {"running: long 12.5%; 1 not started"}
    many = sweep.runs[1:] * 10
    assert sweep_run.progress_of(many, 3) == f"running: {', '.join(['next 12.5%'] * 8)}, 2 more; 3 not started"


def test_goes_on_with_what_is_left(sweep_of):
    said = []
    program, sweep = sweep_of(("good", "finish", ""), ("early", "stop", ""), ("bad", "fail_once", ""),
                              ("shot", "crash", ""))
    assert Runner(program, 1, 1, said.append).run(sweep.runs) == 75
    assert states(sweep) == {"good": "finished", "early": "stopped", "bad": "failed", "shot": "interrupted"}
    assert "bad: failed with exit code 1: body 7: lost" in said
    said.clear()
    assert Runner(program, 1, 1, said.append).run(sweep.runs) == 1
    assert states(sweep) == {"good": "finished", "early": "finished", "bad": "failed", "shot": "finished"}
    assert said[0] == "bad: failed with exit code 1: body 7: lost (--retry runs it again)"
    assert Runner(program, 1, 1, said.append).run(sweep.runs, retry=True) == 0
    assert [len(calls_of(run)) for run in sweep.runs] == [1, 2, 2, 2]
    assert [len(run.attempts()) for run in sweep.runs] == [1, 2, 2, 2]
    assert sweep.runs[3].attempts()[0]["exit_code"] == -signal.SIGKILL


def test_begins_anew_where_the_program_cannot_go_on(sweep_of):
    program, sweep = sweep_of(("early", "stop", ""), options="--force")
    assert Runner(program, 1, 1, say=lambda _: None).run(sweep.runs) == 75
    assert Runner(program, 1, 1, say=lambda _: None).run(sweep.runs) == 0
    assert [call[0][-1] for call in calls_of(sweep.runs[0])] == [f"output.folder={sweep.runs[0].result}", "--force"]


def test_binds_runs_to_cores_of_their_own_if_all_are_theirs(monkeypatch):
    monkeypatch.setenv("OMP_PLACES", "cores")
    monkeypatch.setattr("polydem_post.sweep.runner.available_cores", lambda: [2, 3, 6, 7])
    places = [environment(4, 2, slot)["OMP_PLACES"] for slot in range(2)]
    assert places == ["{2},{3}", "{6},{7}"]
    part = environment(2, 1, 0)
    assert ("OMP_PLACES" in part, part["OMP_PROC_BIND"], part["OMP_NUM_THREADS"]) == (False, "false", "1")
    assert environment(8, 1, 0)["OMP_WAIT_POLICY"] == "passive"


def test_threads_must_fit_on_the_cores(toy):
    with pytest.raises(ResultError, match="runs of 3 threads do not fit on 2 cores"):
        Runner(toy(), 2, 3)


def test_a_sweep_that_cannot_go_on_leaves_no_run_behind(sweep_of):
    program, sweep = sweep_of(("a", "wait", ""), ("b", "finish", ""))
    (sweep.runs[1].folder / "attempts.csv").mkdir()
    runner = Runner(program, 2, 1, say=lambda _: None)
    with pytest.raises(ResultError, match="cannot go on: .*attempts.csv"):
        runner.run([sweep.runs[0], BrokenRun(sweep.runs[1].name, sweep.runs[1].folder, {})])
    assert not any(slot.is_busy for slot in runner.slots)


class BrokenRun(Run):
    """A run whose attempts are found to be unwritable only when it starts."""

    def attempts(self):
        return []


def start(program, sweep, *options):
    """A sweep in a process of its own."""
    command = [sys.executable, "-m", "polydem_post", "sweep", "--program", str(program), "run", str(sweep.folder)]
    return subprocess.Popen([*command, *options], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def await_steps(sweep, n):
    """Wait until n runs are under way."""
    for _ in range(PATIENCE * 50):
        if sum((run.folder / "output.txt").exists() and "step" in (run.folder / "output.txt").read_text()
               for run in sweep.runs) == n:
            return
        time.sleep(0.02)
    pytest.fail("the runs did not start")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGUSR1])
def test_a_signal_ends_the_runs_early_and_the_next_call_goes_on(sweep_of, number):
    program, sweep = sweep_of(("a", "wait", ""), ("b", "wait", ""), ("c", "finish", ""))
    process = start(program, sweep, "--cores", "2")
    await_steps(sweep, 2)
    process.send_signal(number)
    said = process.communicate(timeout=PATIENCE)[0]
    assert process.returncode == 75, said
    assert states(sweep) == {"a": "stopped", "b": "stopped", "c": "not run"}
    assert said.splitlines()[-1] == "the same command continues the remaining runs"
    assert "Traceback" not in said
    process = start(program, sweep, "--cores", "2")
    process.communicate(timeout=PATIENCE)
    assert process.returncode == 0
    assert set(states(sweep).values()) == {"finished"}


def test_a_second_signal_does_not_wait(sweep_of):
    program, sweep = sweep_of(("a", "deafen", ""))
    process = start(program, sweep)
    await_steps(sweep, 1)
    process.send_signal(signal.SIGINT)
    while not (sweep.runs[0].result / "heard").exists():
        time.sleep(0.02)
    assert process.poll() is None
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=PATIENCE)[0]
    assert process.returncode == 75, said
    assert states(sweep) == {"a": "interrupted"}


def await_end(run):
    """Wait until nobody is at a run any more."""
    for _ in range(PATIENCE * 50):
        if not is_running(run):
            return
        time.sleep(0.02)
    pytest.fail("the run does not end")


def test_a_run_that_outlives_its_sweep_is_running_is_not_started_twice_and_counts_when_it_finishes(sweep_of):
    program, sweep = sweep_of(("a", "leave", "told"), ("b", "finish", ""))
    process = start(program, sweep, "--cores", "1")
    await_steps(sweep, 1)
    process.kill()
    process.communicate(timeout=PATIENCE)
    assert states(sweep) == {"a": "running", "b": "not run"}
    process = start(program, sweep, "--cores", "1")
    said = process.communicate(timeout=PATIENCE)[0]
    assert process.returncode == 75, said
    assert "a: left out: another call runs it, or has left it running" in said
    assert states(sweep)["b"] == "finished"
    assert read_outcome(sweep.runs[0]).facts == {"state": "running", "attempts": 0}
    (sweep.runs[0].result / "told").touch()
    await_end(sweep.runs[0])
    assert states(sweep) == {"a": "finished", "b": "finished"}
    assert len(calls_of(sweep.runs[0])) == 1
    process = start(program, sweep, "--cores", "1")
    said = process.communicate(timeout=PATIENCE)[0]
    assert process.returncode == 0, said
    assert [len(calls_of(run)) for run in sweep.runs] == [1, 1]
    assert [attempt["exit_code"] for attempt in sweep.runs[0].attempts()] == [0]


@pytest.mark.parametrize("code", [75, 1, 2, -9])
def test_a_result_that_finished_unseen_is_not_failed_whatever_was_booked_before(sweep_of, code):
    program, sweep = sweep_of(("a", "leave", ""))
    run = sweep.runs[0]
    (run.folder / "attempts.csv").write_text(f"started,seconds,exit_code,threads\nx,1.0,{code},1\n")
    assert states(sweep)["a"] in ("stopped", "failed", "interrupted")
    command = [str(program), "run", "x.nml", "--set", f"output.folder={run.result}", "--set", "toy.does=leave"]
    assert subprocess.run(command, check=False).returncode == 0
    assert states(sweep) == {"a": "finished"}
    assert Runner(program, 1, 1, say=lambda _: None).run(sweep.runs) == 0
    assert [attempt["exit_code"] for attempt in run.attempts()] == [code, 0]
    assert len(calls_of(run)) == 1


def test_an_orphan_that_fails_or_is_killed_runs_again(sweep_of):
    program, sweep = sweep_of(("a", "fail_once", "told"), ("b", "wait", ""))
    process = start(program, sweep, "--cores", "2")
    await_steps(sweep, 2)
    process.kill()
    process.communicate(timeout=PATIENCE)
    assert states(sweep) == {"a": "running", "b": "running"}
    (sweep.runs[0].result / "told").touch()
    await_end(sweep.runs[0])
    subprocess.run(["pkill", "-9", "-f", str(sweep.runs[1].result)], check=True)
    await_end(sweep.runs[1])
    assert states(sweep) == {"a": "not run", "b": "not run"}
    assert Runner(program, 2, 1, say=lambda _: None).run(sweep.runs) == 0
    assert states(sweep) == {"a": "finished", "b": "finished"}


@pytest.mark.parametrize("text, holds", [("{own} {host}", True), ("{own} elsewhere", True), ("999999999 {host}", False),
                                         ("", False), ("x y", False), ("99999999999999999999999 {host}", False)])
def test_a_result_that_somebody_writes_is_running(sweep_of, text, holds):
    program, sweep = sweep_of(("a", "finish", ""))
    run = sweep.runs[0]
    run.result.mkdir()
    (run.result / "running.lock").write_text(text.format(own=os.getpid(), host=platform.node()))
    assert states(sweep) == {"a": "running" if holds else "not run"}
    assert Runner(program, 1, 1, say=lambda _: None).run(sweep.runs) == (75 if holds else 0)
    assert len(calls_of(run)) == (0 if holds else 1)


def test_a_finished_run_of_bodies_from_a_file_is_asked_again(sweep_of):
    program, sweep = sweep_of(("a", "leave", ""))
    run = sweep.runs[0]
    assert Runner(program, 1, 1, say=lambda _: None).run(sweep.runs) == 0
    assert Runner(program, 1, 1, say=lambda _: None).run(sweep.runs) == 0
    assert len(run.attempts()) == 1
    with h5py.File(run.result / "profile.h5", "a") as file:
        file["provenance/resolved_input"] = "&scene\n   bodies_file = 'a.h5'\n/\n"
    assert Runner(program, 1, 1, say=lambda _: None).run(sweep.runs) == 0
    assert len(run.attempts()) == 2


def test_two_calls_share_the_runs(sweep_of):
    program, sweep = sweep_of(*((f"r{k}", "finish", "0.2") for k in range(4)))
    processes = [start(program, sweep, "--cores", "1") for _ in range(2)]
    said = [process.communicate(timeout=PATIENCE)[0] for process in processes]
    assert [len(calls_of(run)) for run in sweep.runs] == [1] * 4, said


def test_what_is_no_sweep_is_told(tmp_path, capsys):
    assert main(["sweep", "--program", "none", "run", str(tmp_path)]) == 2
    assert "is not a sweep" in capsys.readouterr().err


# --- with the program --------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def heights(tmp_path_factory):
    """A sweep of the program itself: two heights of a stack, one that fails, one that is not run."""
    program, root = Path(os.environ["POLYDEM_PROGRAM"]), Path(os.environ["POLYDEM_SOURCE_DIR"])
    folder = tmp_path_factory.mktemp("heights")
    table = folder / "table.csv"
    table.write_text("name,scene.bodies\nlow,2\nhigh,4\nwild,3\nlater,3\n", encoding="utf-8")
    made = make_sweep(root / "inputs" / "stack.nml", folder / "sweep", program, table)
    for run in made.runs:
        with (run.folder / "overrides.txt").open("a", encoding="utf-8") as file:
            file.write("integrate.duration=2\nintegrate.dt=1\n" if run.name == "wild" else "integrate.duration=0.01\n")
    code = Runner(program, 2, 1, say=lambda _: None).run(made.choose([1, 2, 3]))
    return made, code


def test_collects_what_the_program_left(heights, capsys):
    sweep, code = heights
    assert code == 1
    assert main(["sweep", "collect", str(sweep.folder)]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith("wild: failed with exit code 1: ")
    assert said[1:3] == ["later: not run", "2 of 4 runs are finished"]
    with (sweep.folder / "results.csv").open(newline="", encoding="utf-8") as file:
        rows = {row["name"]: row for row in csv.DictReader(file)}
    high = Trajectory(sweep.runs[1].result)
    assert rows["high"]["state_hash"] == high.state_hash != rows["low"]["state_hash"]
    assert float(rows["high"]["energy_balance.kinetic"]) == high.energy_balance["kinetic"][-1]
    assert float(rows["high"]["stage.all"]) == high.profile["seconds"]
    assert int(rows["high"]["counter.steps"]) == high.counters["steps"]
    assert (rows["high"]["revision"], rows["high"]["threads"]) == (high.provenance["revision"], "1")
    assert float(rows["high"]["wall"]) >= high.profile["seconds"]
    assert (rows["later"]["state"], rows["later"]["exit_code"], rows["later"]["state_hash"]) == ("not run", "", "")
    assert (rows["wild"]["state"], rows["wild"]["exit_code"]) == ("failed", "1")
    with h5py.File(sweep.folder / "results.h5", "r") as file:
        assert list(file["name"].asstr()) == ["low", "high", "wild", "later"]
        assert list(file["parameter/scene.bodies"]) == [2, 4, 3, 3]
        assert list(file["state_hash"].asstr())[1] == high.state_hash
        assert file["energy_balance/kinetic"][1] == high.energy_balance["kinetic"][-1]
        assert file["energy_balance/kinetic"].attrs["unit"] == high.balance_units["kinetic"] == "J/m"
        assert file["stage/all"].attrs["unit"] == "s"
        assert str(file["exit_code"][3]) == "nan"


def test_warnings_of_runs_are_reported_and_collected(tmp_path, capsys):
    """Two soft blocks that meet sink into each other; the sweep says so, and its exit code stays 0."""
    program, base = Path(os.environ["POLYDEM_PROGRAM"]), tmp_path / "blocks.nml"
    block = ("&grains name = '{}' region = 'at' at = {}, 0 shape = 'rectangle' width = 0.02 height = 0.02 "
             "velocity = {}, 0 /")
    base.write_text("\n".join([block.format("a", -0.02, 1), block.format("b", 0.02, -1), "&forces gravity = 0, 0 /",
                               "&integrate duration = 0.04 dt = 1e-5 /\n"]), encoding="utf-8")
    made = make_sweep(base, tmp_path / "sweep", program, None, ["forces.stiffness=1e7,1e4"])
    firm, soft = made.runs
    said = []
    assert Runner(program, 2, 1, say=said.append).run(made.runs) == 0
    (line,) = [line for line in said if line.startswith(f"{soft.name}: finished")]
    assert re.search(r" with warnings: .*[1-9]\d* steps with a contact that was too deep", line), said
    assert not any("warnings" in line for line in said if line.startswith(f"{firm.name}: finished")), said
    assert said[-1].startswith("1 of 2 runs have warnings") and said[-1].endswith(f": {soft.name}"), said
    assert main(["sweep", "collect", str(made.folder)]) == 0
    assert said[-1] in capsys.readouterr().out.splitlines()
    with (made.folder / "results.csv").open(newline="", encoding="utf-8") as file:
        rows = {row["name"]: row for row in csv.DictReader(file)}
    assert rows[firm.name]["warnings"] == "" and "a contact that was too deep" in rows[soft.name]["warnings"]
    log = (soft.result / "log.txt").read_text(encoding="utf-8")
    counts = re.findall(r"^warnings: (.*)$", log, re.MULTILINE)
    assert rows[soft.name]["warnings"] == "; ".join(counts), (rows[soft.name], counts)
    with h5py.File(made.folder / "results.h5", "r") as file:
        assert list(file["warnings"].asstr()) == ["", rows[soft.name]["warnings"]]


def test_collect_tells_of_a_seed_without_effect(tmp_path, capsys):
    """Finds runs that pass for independent ones, and a warning about runs that differ, or only in their finder."""
    program = Path(os.environ["POLYDEM_PROGRAM"])
    base = tmp_path / "own.nml"
    base.write_text("&grains name = 'g' seed = 7 region = 'box' low = 0, 0 high = 0.1, 0.1 number = 5 speed = 1 /\n"
                    "&integrate duration = 1e-3 dt = 1e-4 /\n", encoding="utf-8")
    made = make_sweep(base, tmp_path / "sweep", program, None,
                      ["scene.seed=1,2", "neighbours.finder=quadtree,all_pairs", "grains.g.number=5,6"])
    assert Runner(program, 2, 1, say=lambda _: None).run(made.runs) == 0
    assert main(["sweep", "collect", str(made.folder)]) == 0
    told = [line for line in capsys.readouterr().out.splitlines() if "state hash" in line]
    assert [line.count("seed_1") for line in told] == [2, 2] and "number_6" in told[1]
    assert told[0].endswith(": the same state hash: scene.seed had no effect (a group with a seed of its own does not "
                            "use it); error bars must count them as one run")
    few = [read_outcome(run) for run in made.runs if run.values["scene.seed"] == "1"]
    assert same_states(few) == []
    assert same_states([few[0], few[0]])[0].endswith("hash: their entries are the same; error bars must count them as "
                                                     "one run")


@pytest.mark.parametrize(("words", "parts"), [
    (["forces.gravity=0,-9.81"], ["takes 2 values, but 1 value is given", "semicolons if they have commas"]),
    (["forces.friction_coefficient=[0.1,0.2]"], ["values stand without brackets, as in"]),
    (["forces.gravity=(0,-9.81),(0,-1)"], ["values stand without brackets", "'forces.gravity=0,-9.81;0,-1'"]),
    (["forces.friction_coefficient=0.1:0.5:0.1"], ["is no range; write the values out, as in"]),
    (["list.csv"], ["list.csv:2: ", "takes 1 value, but 2 values are given", "lists of values stand behind"]),
])
def test_a_list_that_was_meant_otherwise_is_explained(words, parts, tmp_path, monkeypatch, capsys):
    program, root = os.environ["POLYDEM_PROGRAM"], Path(os.environ["POLYDEM_SOURCE_DIR"])
    monkeypatch.chdir(tmp_path)
    (tmp_path / "list.csv").write_text('name,forces.friction_coefficient\na,"0.1,0.2"\n', encoding="utf-8")
    base = str(root / "inputs" / "stack.nml")
    assert main(["sweep", "--program", program, "make", base, *words, "--output", "o"]) == 2
    said = capsys.readouterr().err
    assert all(part in said for part in parts), said
    assert not (tmp_path / "o").exists()


def test_the_program_finds_the_wrong_entry(tmp_path, capsys):
    program, root = os.environ["POLYDEM_PROGRAM"], Path(os.environ["POLYDEM_SOURCE_DIR"])
    table = tmp_path / "table.csv"
    table.write_text("name,forces.fricton_coefficient\na,0.1\n", encoding="utf-8")
    words = ["make", str(table), str(root / "inputs" / "stack.nml"), "--output", str(tmp_path / "sweep")]
    assert main(["sweep", "--program", program, *words]) == 2
    message = capsys.readouterr().err
    assert message.startswith(f"error: {table}:2: --set forces.fricton_coefficient=0.1")
    assert "did you mean 'friction_coefficient'" in message


def test_tables_of_motions_go_with_the_namelist(tmp_path):
    """Finds runs that look for a table beside the copy of the namelist, where none is."""
    program = Path(os.environ["POLYDEM_PROGRAM"])
    (tmp_path / "tables").mkdir()
    for name in ("tables/a.csv", "b.csv"):
        (tmp_path / name).write_text("time,y\n0,0\n1,-0.001\n", encoding="utf-8")
    base = tmp_path / "plate.nml"
    base.write_text("&wall name = 'plate' outline = 'line' from = -0.1, 0 to = 0.1, 0 thickness = 0.01 /\n"
                    "&grains name = 'g' region = 'box' low = -0.1, 0 high = 0.1, 0.1 number = 2 /\n"
                    "&motion name = 'm' wall = 'plate' kind = 'table' file = 'none.csv' / ! file = 'b.csv'\n"
                    "&integrate duration = 1e-3 /\n", encoding="utf-8")
    made = make_sweep(base, tmp_path / "sweep", program, None, ["motion.m.file=tables/a.csv,b.csv"])
    assert Runner(program, 2, 1, say=lambda _: None).run(made.runs) == 0


def test_knows_the_cores_of_this_process():
    only = str(available_cores()[0])
    code = "from polydem_post.sweep.runner import available_cores; print(available_cores())"
    command = ["taskset", "-c", only, sys.executable, "-c", code]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip() == f"[{only}]"
