"""Simulations that processes share through mpi4py: the bits of one process, actions, exceptions on all, no waiting."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from polydem_post import Trajectory
from runs import ENVIRONMENT, MPIRUN, contents, differences, frames, run, state_hash
from scenes import write_scene

pytest.importorskip("mpi4py")

HERE = Path(__file__).parent
INPUTS = HERE.parents[1] / "inputs"
#: Scenes with all that is gathered: a heap; walls with loads and a series; a sheared cell with sources; pieces
WATCHED = ("drum", "walls", "border", "pieces")


def play(case, out, words=(), ranks=None, code=0):
    """Play a case on some processes, or on one without MPI; give what each has seen, and standard error."""
    command = [sys.executable, str(HERE / "shared_cases.py"), case, str(out), *map(str, words)]
    if ranks is not None:
        command = [*MPIRUN, "-n", str(ranks), *command]
    told = subprocess.run(command, env=ENVIRONMENT, capture_output=True, text=True, timeout=300, check=False)
    assert (told.returncode == 0) == (code == 0), told.stderr
    seen = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(out.parent.glob(f"{out.name}.*"))]
    assert len(seen) == (ranks or 1) or code != 0
    return seen, told.stderr


@pytest.mark.parametrize("scene", WATCHED)
def test_all_that_can_be_asked_has_the_bits_of_one_process(scene, tmp_path):
    namelist = tmp_path / "scene.nml"
    write_scene(namelist, scene)
    (expected,), _ = play("watch", tmp_path / "one", [namelist])
    program, _ = run(namelist, tmp_path / "result")
    seen, observed = expected
    assert seen[-1]["hash"] == state_hash(program)
    assert len({each["contacts"] for each in seen + observed}) > 1
    assert len(observed) >= 7
    for ranks in (1, 2, 3):
        root, *others = play("watch", tmp_path / f"{ranks}", [namelist], ranks)[0]
        assert root == expected
        assert all(other == [seen, []] for other in others)


@pytest.mark.parametrize("scene", ("first", "biaxial", "steady_hopper"))
def test_actions_of_the_root_are_those_of_one_process(scene, tmp_path):
    namelist = INPUTS / f"{scene}.nml"
    (expected,), _ = play("act", tmp_path / "one", [namelist, tmp_path / "result"])
    assert len(expected[0]["actions"]) > 20 and expected[1]
    for ranks in (2, 3):
        folder = tmp_path / f"result_{ranks}"
        root, *others = play("act", tmp_path / f"{ranks}", [namelist, folder], ranks)[0]
        assert root == expected
        assert all(other == root[:1] for other in others)
        assert differences(contents(tmp_path / "result"), contents(folder)) == []
        assert (folder / "actions.txt").read_bytes() == (tmp_path / "result" / "actions.txt").read_bytes()
        assert Trajectory(folder).status == "finished"
    output, _ = run(namelist, tmp_path / "again", 2, options=("--set", "output.contacts=T", "--actions",
                                                            str(tmp_path / "result_3" / "actions.txt")))
    assert state_hash(output) == expected[0]["hash"]


def test_a_result_goes_on_with_other_processes(tmp_path):
    namelist, folder = tmp_path / "scene.nml", tmp_path / "shared"
    write_scene(namelist, "drum")
    run(namelist, tmp_path / "whole")
    for k, (ranks, steps) in enumerate(((2, 200), (None, 200), (3, 0))):
        (step, *_), *_ = play("write", tmp_path / f"{k}", [namelist, folder, steps], ranks)[0]
        assert steps in (0, step // (k + 1))
    assert differences(frames(tmp_path / "whole"), frames(folder)) == []
    assert Trajectory(folder).state_hash == Trajectory(tmp_path / "whole").state_hash


def test_a_result_with_actions_goes_on_with_other_processes(tmp_path):
    (*_, last), = play("react", tmp_path / "one", [tmp_path / "whole", 0])[0]
    for k, (ranks, steps) in enumerate(((2, 220), (3, 200), (None, 130), (2, 0))):
        seen, _ = play("react", tmp_path / f"{k}", [tmp_path / "parts", steps], ranks)
        assert all(each == seen[0] for each in seen)
        assert seen[0][2] == (0, 12, 24, 33)[k], seen
    assert seen[0][-1] == last
    assert differences(frames(tmp_path / "whole"), frames(tmp_path / "parts")) == []
    again, message = play("react", tmp_path / "again", [tmp_path / "parts", 0], 2, code=1)
    assert not again and "the run is finished; resume it with a longer integrate.duration" in message


def test_exceptions_reach_all_processes(tmp_path):
    (expected,), _ = play("fail", tmp_path / "one")
    root, *others = play("fail", tmp_path / "shared", ranks=3)[0]
    assert "an observer runs on the root alone" in root.pop(5)
    assert root == expected
    for other in others:
        assert other.pop(5).startswith("InputError: an observer runs on the root alone")
        # This one cannot travel.
        assert other[1] == "PolydemError: an observer has failed on the root: Own: 1 2"
        assert [other[0], *other[2:]] == [root[0], *root[2:]]


@pytest.mark.parametrize("way, message", (
    ("steps", "process 0 makes run(10, None, None) of simulation 1, process 1 run(11, "),
    ("alone", "process 0 makes integer(contacts) of simulation 1, process 1 run(20, "),
    ("action", "process 0 makes act(drag, "),
    ("error", "process 0 makes run(20, None, None) of simulation 1, process 1 close after an error()"),
    ("exit", "process 0 makes run(20, None, None) of simulation 1, process 1 close after an error()"),
    ("late", "process 0 makes close() of simulation 1, process 1 close after an error()"),
    ("observer", "an observer runs on the root alone"),
))
def test_processes_that_part_get_an_error(way, message, tmp_path):
    told = play("part", tmp_path / "out", [way], 3, code=1)[1]
    assert message in told
    assert ("ZeroDivisionError: of one process" in told) == (way in ("error", "late"))


def test_what_nobody_closes_is_closed_at_the_end(tmp_path):
    play("part", tmp_path / "none", ["none"], 3)
    first, second = play("forget", tmp_path / "out", ["late"], 2)[0]
    assert first == second
    assert "process 1 exit()" in play("forget", tmp_path / "early", ["early"], 2, code=1)[1]


def test_groups_of_processes_have_simulations_of_their_own(tmp_path):
    seen, _ = play("divide", tmp_path / "out", [tmp_path / "result"], 4)
    assert [number for number, *_ in seen] == [0, 1, 0, 1]
    hashes = [text for _, text, _ in seen]
    assert hashes[:2] == hashes[2:] and hashes[0] != hashes[1]
    assert all("communicator of all processes" in message for *_, message in seen)
    assert not (tmp_path / "result").exists()
