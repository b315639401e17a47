"""Small runs that are interrupted at every step, or killed at calls to the system, and then continued.

Rows of the series, frames and checkpoints have coprime intervals, so every one of them comes first somewhere. The
continued run has the series.csv and the data sets of the undisturbed one, bit by bit. The scenes share the steps from
which a run goes on to its end, and the kinds of calls; with POLYDEM_FULL=1 in the environment each scene tries all.
"""

import os
import shutil
import signal
import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest
from check_writes import Call, sample

PROGRAM = os.path.abspath(os.environ["POLYDEM_PROGRAM"])
FAILING = os.environ.get("POLYDEM_FAILING_CALLS", "")
FULL = bool(os.environ.get("POLYDEM_FULL"))

#: Exit codes of a run, as inputs/getting_started.md lists them
DONE, FAILED, EARLY = 0, 1, 75

GRAINS = """\
&wall name = 'floor' outline = 'rectangle' low = -0.1, -0.02 high = 0.1, 0 /
&grains name = 'g' region = 'box' low = -0.05, 0.001 high = 0.05, 0.03 number = 3 speed = 0.5 /
"""
#: The longest names that there may be
FEED, DRAIN, FLOOR = (word.ljust(64, "_") for word in ("feed", "drain", "floor"))
SOURCE_AND_SINK = f"""\
&source name = '{FEED}' low = -0.05, 0.05 high = 0.05, 0.1 rate = 4e5 interval = 9
   short_axis = 4e-3 long_axis = 4e-3, 4e-3 /
&sink name = '{DRAIN}' low = -0.2, -0.1 high = 0.2, 0.012 interval = 6 /
&sample area = 'rectangle' low = -0.05, 0 high = 0.05, 0.1 /
"""
LID = """\
&wall name = 'lid' outline = 'rectangle' low = -0.1, 0.04 high = 0.1, 0.05 /
&load name = 'press' wall = 'lid' direction = 'y' force = -50 mass = 0.01 /
"""
OUTPUT = ("&output frame_interval = 5e-5 series_interval = 3e-5 csv = .true. frames_per_segment = 2\n"
          "   contacts = .true. /\n&checkpoint steps = 7 at_end = {} /\n")
STEPS = "&integrate dt = 1e-5 {} /\n"
DURATION = STEPS.format("duration = 2.3e-4")

#: Scenes by how the run ends, with the exit code
ENDS = {
    "duration": (GRAINS + DURATION, DONE),
    "sources_and_sinks": (GRAINS.replace("floor", FLOOR) + SOURCE_AND_SINK + DURATION, DONE),
    "condition": (GRAINS + LID + STEPS.format("") + "&stage name = 'fall' duration = 8e-5 /\n"
                  "&stage name = 'rest' until = 'kinetic' above = 1e-9 check = 7 hold = 9e-5 longest = 1e-3 /\n",
                  DONE),
    "limit": (GRAINS + STEPS.format("") + "&stage name = 'rest' until = 'kinetic' below = 1e-30 check = 10 "
              "longest = 2.2e-4 /\n", FAILED),
    "guard": (GRAINS + LID.replace("-50", "-150") + DURATION + "&guards displacement_limit = 2e-3 /\n", FAILED),
}


def start(folder, *options, before=None, **hostile):
    """Exit code, output and message of a run; its process first executes `before`."""
    done = subprocess.run([PROGRAM, "run", "scene.nml", "--threads", "1", "--set", f"output.folder={folder}", *options],
                          capture_output=True, text=True, timeout=600, check=False, preexec_fn=before,
                          env={**os.environ, "OMP_NUM_THREADS": "1", **hostile})
    return done.returncode, done.stdout, done.stderr


def is_complete(folder):
    done = subprocess.run([PROGRAM, "info", "--check", folder], capture_output=True, timeout=600, check=False)
    return done.returncode == DONE


def ask_for_an_end():
    """Leave a pending signal, which ends a run after its first step."""
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGUSR1])
    os.kill(os.getpid(), signal.SIGUSR1)


def contents(folder):
    """Bytes of series.csv, and the rows of all data sets of all segments, joined."""
    joined = {}
    paths = sorted(Path(folder).glob("trajectory_*.h5"))
    for path in paths:
        with h5py.File(path) as file:
            parts = {}
            file.visititems(lambda name, item: parts.update({name: item[()]})
                            if isinstance(item, h5py.Dataset) and not name.startswith("provenance") else None)
        for name, part in parts.items():
            # Constant in all segments; and the places of rows, which count from the start of a segment.
            if name.startswith(("bodies/", "cell/")) or name == "walls/id":
                joined.setdefault(name, part)
            elif name in ("contacts/start", "frames/start"):
                joined[name] = np.concatenate((joined.get(name, part[:0]), np.diff(part)))
            else:
                joined[name] = np.concatenate((joined.get(name, part[:0]), part))
    return (Path(folder) / "series.csv").read_bytes(), joined


def assert_equal(folder, whole):
    """Compare a result with the undisturbed one, also the names of its data sets."""
    table, joined = contents(folder)
    assert table.count(b"\n") > 5 and table == whole[0], folder
    assert joined.keys() == whole[1].keys(), folder
    for name, values in joined.items():
        if whole[2] and name.startswith("bodies/"):
            continue
        assert values.tobytes() == whole[1][name].tobytes(), (folder, name)


def write_scene(end):
    # With and without a checkpoint at the end
    output = OUTPUT.format((".true.", ".false.")[list(ENDS).index(end) % 2])
    Path("scene.nml").write_text(ENDS[end][0] + output, encoding="utf-8")


@pytest.fixture(params=ENDS)
def end(request):
    """How the scene of a test ends."""
    return request.param


@pytest.fixture
def run(end, tmp_path, monkeypatch):
    """The undisturbed run in the folder `whole`: exit code, message, contents."""
    monkeypatch.chdir(tmp_path)
    write_scene(end)
    code = ENDS[end][1]
    found, _, message = start("whole")
    assert found == code, message
    return code, message, (*contents("whole"), end == "sources_and_sinks")


@pytest.fixture(scope="module")
def points(tmp_path_factory):
    """The first and the last call of each kind, by scene: each in one of the scenes that have it, in turn."""
    folder, before = tmp_path_factory.mktemp("counted"), os.getcwd()
    os.chdir(folder)
    having = {}
    for end in ENDS:
        write_scene(end)
        code, _, message = start("counted", LD_PRELOAD=FAILING, POLYDEM_FAIL_FOLDER=f"{folder}/counted",
                                 POLYDEM_FAIL_LOG=f"{folder}/{end}")
        assert code == ENDS[end][1], message
        shutil.rmtree("counted")
        lines = Path(end).read_text(encoding="utf-8").splitlines()
        chosen, seen = sample([Call(0, *line.split(" ", 2)) for line in lines]), set()
        assert len(chosen) > 20, chosen
        for call in chosen:
            having.setdefault((call.kind(), call.kind() in seen), []).append((end, call))
            seen.add(call.kind())
    os.chdir(before)
    shared = {end: [] for end in ENDS}
    for number, calls in enumerate(having.values()):
        for end, call in calls if FULL else [calls[number % len(calls)]]:
            shared[end].append(call)
    return shared


def finish(folder, run):
    code, message, whole = run
    found, _, told = start(folder, "--continue")
    assert found == code and told.replace(folder, "whole") == message, (folder, found, told)
    assert is_complete(folder)
    assert_equal(folder, whole)


def test_a_signal_at_every_step_changes_nothing(run, end):
    """Finds state that a checkpoint lacks when the next frame comes before the next row, or the end before both."""
    steps = 0
    while True:
        code, _, message = start("chain", "--continue", before=ask_for_an_end)
        steps += 1
        if FULL or steps % len(ENDS) == list(ENDS).index(end):
            shutil.copytree("chain", f"from_{steps}")
            finish(f"from_{steps}", run)
        if code != EARLY:
            break
        assert f"at step {steps} of" in message, message
    assert steps > 10, steps
    assert code == run[0]
    assert_equal("chain", run[2])


@pytest.mark.skipif(not FAILING, reason="the library of failing_calls.c is not there")
def test_a_kill_at_a_call_changes_nothing(run, end, points):
    """Before the first and the last call of each kind that changes files, a kill leaves what can be continued."""
    here = os.path.realpath(".")
    for point in points[end]:
        folder = f"killed_{point.number}"
        code, _, message = start(folder, LD_PRELOAD=FAILING, POLYDEM_FAIL_HOW="kill",
                                 POLYDEM_FAIL_FOLDER=f"{here}/{folder}", POLYDEM_FAIL_CALL=str(point.number))
        assert code == -signal.SIGKILL, (str(point), code, message)
        finish(folder, run)
        shutil.rmtree(folder)


def damage(path, how):
    """Damage a file as a loss of power or a hand may do."""
    data = path.read_bytes()
    if how == "delete":
        path.unlink()
    else:
        path.write_bytes({"empty": b"", "cut": data[:len(data) // 2], "zeros": bytes(len(data)),
                          "longer": data + b"1"}[how])


@pytest.mark.parametrize("code", (DONE, EARLY), ids=("finished", "interrupted"))
@pytest.mark.parametrize("name", ("series.csv", "overlaps.csv"))
def test_tables_are_made_again(name, code, tmp_path, monkeypatch):
    """They follow from the segments and the scene: no damage of them blocks a result."""
    monkeypatch.chdir(tmp_path)
    deep = ("&scene name = 'gas' bodies = 6 solid_fraction = 0.8 overlap = .true. speed = 0.5 spin = 20 /\n"
            "&forces stiffness = 1e6 /\n")
    Path("scene.nml").write_text(deep + DURATION + OUTPUT.format(".true.") + "&guards listed_depth = 1e-9 /\n",
                                 encoding="utf-8")
    found, _, message = start("whole")
    assert found == DONE, message
    expected = {table: Path("whole", table).read_bytes() for table in ("series.csv", "overlaps.csv")}
    assert all(table.count(b"\n") > 2 for table in expected.values())
    found, _, message = start("sound", before=ask_for_an_end if code == EARLY else None)
    assert found == code and is_complete("sound"), message
    for how in ("delete", "empty", "cut", "zeros", "longer"):
        folder = shutil.copytree("sound", how)
        damage(Path(folder, name), how)
        told = subprocess.run([PROGRAM, "info", "--check", folder], capture_output=True, text=True, check=False)
        assert told.returncode != DONE and f"WRONG  {name}" in told.stdout, told
        assert "--continue makes it again" in told.stdout, told.stdout
        found, output, message = start(folder, "--continue")
        assert found == DONE and is_complete(folder), (how, message)
        assert code == EARLY or (f"{folder}/{name} was missing or damaged, and is made again" in output
                                 and "nothing to do" in output), output
        assert {table: Path(folder, table).read_bytes() for table in expected} == expected, how
