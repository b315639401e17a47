"""Faults of runs of several processes: ranks that die or never come, errors of one rank, disks, and what is left."""

import contextlib
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import pytest
from runs import ENVIRONMENT, MPIRUN, PARALLEL, SERIAL, differences, frames, newest, run, start, state_hash
from scenes import write_scene
from seals import seal

OPTIONS = ("--set", "checkpoint.steps=100")
#: What several bodies do in the same step, and stops a run
FAILURES = {
    "fast": ("--set", "forces.gravity=0,-5e5"),
    "far": ("--set", "guards.displacement=stop", "--set", "guards.displacement_limit=1e-6"),
    "deep": ("--set", "guards.overlap=stop", "--set", "guards.overlap_limit=1e-6"),
    "through": ("--set", "guards.tunnelling=stop", "--set", "forces.stiffness=5e3"),
}
#: Frames of the first and the last step only, so that the step at which the run stops is none of a frame
FEW_FRAMES = "--set", "output.frame_interval=0", "--set", "output.frames_per_segment=0"
CROSSING = """&scene name = 'file', bodies_file = '{bodies}' /
&forces gravity = 0, -9.81, stiffness = 1e4 /
&integrate dt = 1e-3, duration = 0.02 /
&guards displacement = 'off', step = 'off' /
&overlap degenerate = 'stop' /
&output frame_interval = 1e-3, contacts = .true. /
"""
#: Becomes a program to which USR1 was sent before it began; the signal is blocked, and stays pending
WITH_USR1 = """import os, signal, sys
signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGUSR1])
os.kill(os.getpid(), signal.SIGUSR1)
os.execv(sys.argv[1], sys.argv[1:])
"""
#: Exit codes, as inputs/getting_started.md lists them
FAILED, BAD_INPUT, NO_FILE = 1, 2, 3


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A folder with a namelist, and the result of a run that nobody disturbed."""
    folder = tmp_path_factory.mktemp("whole")
    write_scene(folder / "scene.nml", "drum")
    output, _ = run(folder / "scene.nml", folder / "whole", None, 1, OPTIONS)
    folder.joinpath("hash").write_text(state_hash(output), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def interrupted(whole):
    """A result of three ranks that were interrupted after two checkpoints."""
    folder = whole / "interrupted"
    process = start(whole / "scene.nml", folder, 3, 1, OPTIONS)
    wait_for(lambda: len(list(folder.glob("checkpoint_?.h5"))) == 2, process)
    process.send_signal(signal.SIGUSR1)
    process.communicate(timeout=600)
    assert process.returncode == 75
    return folder


def wait_for(condition, process, seconds=600.0):
    """Wait until a condition holds, while a process runs."""
    end = time.monotonic() + seconds
    while not condition():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.002)


def finish(whole, folder, ranks):
    """Continue a run to its end, if it did not come there; it must be the right one. Give what it says."""
    output, _ = run(whole / "scene.nml", folder, ranks, 1, ("--continue", *OPTIONS))
    assert state_hash(output) == whole.joinpath("hash").read_text(encoding="utf-8")
    assert differences(frames(whole / "whole"), frames(folder)) == []
    return output


def segments(folder):
    """Bytes of the closed segments, by name"""
    return {path.name: path.read_bytes() for path in folder.glob("trajectory_????.h5")}


def ranks_of(mpirun):
    """Numbers of the processes that an mpirun started"""
    told = subprocess.run(["pgrep", "-P", str(mpirun.pid)], capture_output=True, text=True, check=False).stdout
    return [int(word) for word in told.split()]


def test_a_killed_rank_ends_the_run_which_goes_on_from_its_last_checkpoint(whole, request, tmp_path):
    chance = random.Random(1)
    folder = tmp_path / "result"
    kills, wanted = 0, request.config.getoption("kills")
    while kills < wanted:
        if kills % 5 == 0:
            shutil.rmtree(folder, ignore_errors=True)
        before = segments(folder)
        process = start(whole / "scene.nml", folder, chance.choice((2, 3, 4)), 1, ("--continue", *OPTIONS))
        wait_for(lambda: (folder / "running.lock").exists() or process.poll() is not None, process)
        time.sleep(chance.uniform(0.0, 1.0))
        victims = ranks_of(process)
        if victims:
            with contextlib.suppress(ProcessLookupError):
                os.kill(chance.choice(victims), signal.SIGKILL)
        _, message = process.communicate(timeout=600)
        if process.returncode == 0:
            shutil.rmtree(folder)
            continue
        kills += 1
        # An mpirun that hangs after its ranks have died, having said so, is killed itself (src/packaging/watch_ranks).
        codes = (128 + signal.SIGKILL, -signal.SIGKILL)
        assert process.returncode in codes and "signal 9" in message, (process.returncode, message)
        after = segments(folder)
        assert all(after.get(name) == content for name, content in before.items()), f"kill {kills} lost a segment"
        if kills % 5 == 0 or kills == wanted:
            finish(whole, folder, chance.choice((None, 1, 2, 3)))


def test_usr1_while_ranks_start_ends_the_run_after_its_first_step(whole, tmp_path):
    folder = tmp_path / "result"
    words = [PARALLEL, "run", str(whole / "scene.nml"), "--threads", "1", "--set", f"output.folder={folder}", *OPTIONS]
    end = subprocess.run([*MPIRUN, "-n", "3", sys.executable, "-c", WITH_USR1, *words], env=ENVIRONMENT,
                         capture_output=True, text=True, timeout=600, check=False)
    assert end.returncode == 75 and "interrupted by SIGUSR1 at step 1 of" in end.stderr, end
    finish(whole, folder, 2)


def test_ranks_that_outlive_their_leader_keep_others_out(whole, tmp_path):
    folder = tmp_path / "result"
    process = start(whole / "scene.nml", folder, 3, 1, ("--continue", *OPTIONS))
    wait_for(lambda: newest(folder) > 0, process)
    leader = int(folder.joinpath("running.lock").read_text(encoding="utf-8").split()[0])
    assert leader in ranks_of(process)
    # Nobody ends the other ranks as long as mpirun stands still.
    process.send_signal(signal.SIGSTOP)
    try:
        os.kill(leader, signal.SIGKILL)
        words = [SERIAL, "run", str(whole / "scene.nml"), "--set", f"output.folder={folder}", "--continue", *OPTIONS]
        end = subprocess.run(words, capture_output=True, text=True, timeout=600, check=False)
        assert end.returncode == BAD_INPUT and f"another run (process {leader})" in end.stderr, end
    finally:
        process.send_signal(signal.SIGCONT)
    process.communicate(timeout=600)
    assert f"took over {folder}/running.lock of process {leader}, which has ended" in finish(whole, folder, None)


@pytest.mark.parametrize("number", (signal.SIGKILL, signal.SIGTERM))
def test_without_mpirun_the_ranks_end_and_leave_a_good_checkpoint(number, whole, tmp_path):
    folder = tmp_path / "result"
    process = start(whole / "scene.nml", folder, 2, 1, ("--continue", *OPTIONS))
    wait_for(lambda: newest(folder) > 0, process)
    ranks = ranks_of(process)
    assert len(ranks) == 2
    process.send_signal(number)
    process.communicate(timeout=600)
    end = time.monotonic() + 600
    while any(os.path.exists(f"/proc/{rank}") for rank in ranks):
        assert time.monotonic() < end, "ranks outlive mpirun"
        time.sleep(0.02)
    # Ranks that learn late of the end of mpirun may have come to that of the run.
    finish(whole, folder, 3)


def test_a_rank_that_never_comes_ends_the_run(whole, tmp_path):
    words = [PARALLEL, "run", str(whole / "scene.nml"), "--set", f"output.folder={tmp_path / 'result'}"]
    end = subprocess.run([*MPIRUN, "-n", "2", *words, ":", "-n", "1", "false"], env=ENVIRONMENT, capture_output=True,
                         text=True, timeout=600, check=False)
    assert end.returncode != 0 and end.stderr != ""
    assert not list((tmp_path / "result").glob("*.h5"))


def test_the_program_without_mpi_refuses_to_be_several(whole, tmp_path):
    words = [SERIAL, "run", str(whole / "scene.nml"), "--set", f"output.folder={tmp_path / 'result'}"]
    end = subprocess.run([*MPIRUN, "-n", "3", *words], env=ENVIRONMENT, capture_output=True, text=True, timeout=600,
                         check=False)
    assert end.returncode == BAD_INPUT and "--ranks 3" in end.stderr, end
    assert not (tmp_path / "result").exists()


def write_crossing(path, places=(1.0, -9.0)):
    """Away from a row of squares that move, small ones jump into large ones at these places, in the same step.

    The last square is fixed, and the one before it moves into it.
    """
    squares = [(0.0199 * k - 1.0, 0.0, 0.01, 0.1 * k) for k in range(6)]
    for x in places:
        squares += [(x, 0.0, 0.05, 0.0), (x + 0.08, 0.003, 0.005, -40.0)]
    squares += [(3.053, 0.0, 0.005, -1.0), (3.0, 0.0, 0.05, 0.0)]
    with h5py.File(path, "w") as file:
        file["vertex"] = [(x + a * i, y + a * j) for x, y, a, _ in squares
                          for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        file["vertex_start"] = [4 * k for k in range(len(squares) + 1)]
        file["fixed"] = [0] * (len(squares) - 1) + [1]
        file["velocity"] = [(speed, 0.0) for _, _, _, speed in squares]


def message_of(text):
    """The line of the program itself, which must be there once"""
    lines = [line for line in text.splitlines() if line.startswith("polydem: ")]
    assert len(lines) == 1, text
    return lines[0]


@pytest.mark.parametrize("ranks", (None, 3), ids=("serial", "3"))
def test_no_number_in_a_checkpoint_is_found_with_its_body(ranks, whole, interrupted, tmp_path):
    folder = tmp_path / "result"
    shutil.copytree(interrupted, folder)
    for path in folder.glob("checkpoint_?.h5"):
        with h5py.File(path, "r+") as file:
            row = 200
            name = file["bodies/id"][row]
            file["bodies/position"][row, 0] = float("nan")
        seal(path)
    _, text = run(whole / "scene.nml", folder, ranks, 1, ("--continue", *OPTIONS), code=FAILED)
    assert f"body {name} " in message_of(text) and "step" in text, text


def test_an_error_of_one_rank_is_told_once_as_by_one_process(whole, tmp_path):
    for name, options in FAILURES.items():
        told = [message_of(run(whole / "scene.nml", tmp_path / f"{name}_{ranks}", ranks, 1, (*options, *FEW_FRAMES),
                               code=FAILED)[1]) for ranks in (None, 3)]
        assert told[0] == told[1] and re.search(r"bod(y|ies) \d+", told[0]), told
        assert differences(frames(tmp_path / f"{name}_None"), frames(tmp_path / f"{name}_3")) == []


def test_a_contact_that_stops_the_run_stops_all_in_the_same_state(tmp_path):
    write_crossing(tmp_path / "bodies.h5")
    scene = tmp_path / "scene.nml"
    scene.write_text(CROSSING.format(bodies=tmp_path / "bodies.h5"), encoding="utf-8")
    results = {}
    for ranks in (None, 2, 3):
        output, text = run(scene, tmp_path / f"of_{ranks}", ranks, 1, FEW_FRAMES, code=FAILED)
        results[ranks] = (message_of(text), state_hash(output), frames(tmp_path / f"of_{ranks}"))
    assert "has no direction" in results[None][0], results[None][0]
    assert all(result[:2] == results[None][:2] for result in results.values()), results
    assert all(differences(results[None][2], result[2]) == [] for result in results.values())


@pytest.mark.parametrize("ranks", [2, 3])
def test_an_error_of_the_finder_of_one_rank_reaches_all(ranks):
    build = Path(PARALLEL).parents[2]
    subprocess.run(["cmake", "--build", build, "--target", "faulty_finder"], check=True, stdout=subprocess.PIPE)
    done = subprocess.run([*MPIRUN, "-n", str(ranks), build / "tests/simulation/faulty_finder"], env=ENVIRONMENT,
                          timeout=120, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_bodies_at_the_end_of_the_numbers_are_told(tmp_path):
    scene = tmp_path / "scene.nml"
    scene.write_text(CROSSING.format(bodies=tmp_path / "bodies.h5"), encoding="utf-8")
    options = ("--set", "overlap.degenerate=push", "--set", "forces.gravity=0,0", "--set", "integrate.dt=1",
               "--set", "integrate.duration=2", "--set", "output.frame_interval=1", "--set",
               "output.energy_balance=.false.", "--force")
    with h5py.File(tmp_path / "bodies.h5", "w") as file:
        file["vertex"] = [(0.03 * k + i, 0.011 * k + j) for k in range(12)
                          for i, j in ((0.0, 0.0), (0.02, 0.0), (0.02, 0.02), (0.0, 0.02))]
        file["vertex_start"] = [4 * k for k in range(13)]
        file["fixed"] = [0] * 12
        file["velocity"] = [{3: (4e307, 0.0), 7: (-4e307, 4e307), 9: (-4e307, 2e307)}.get(k, (0.0, 0.0))
                            for k in range(12)]
    told = [run(scene, tmp_path / f"of_{ranks}", ranks, 1, options, code=FAILED) for ranks in (None, 2, 3)]
    assert len({message_of(text) for _, text in told}) == 1, told
    assert "step 2: body 4 at (8." in told[0][1] and "has an invalid pose" in told[0][1], told
    assert len({state_hash(output) for output, _ in told}) == 1, told


def test_a_warning_of_any_rank_is_told(tmp_path):
    write_crossing(tmp_path / "bodies.h5", (1.0,))
    scene = tmp_path / "scene.nml"
    scene.write_text(CROSSING.format(bodies=tmp_path / "bodies.h5"), encoding="utf-8")
    options = ("--set", "guards.displacement=warn", "--set", "guards.displacement_limit=1", "--set",
               "overlap.degenerate=push")
    told = {}
    for ranks in (None, 2, 3, 4):
        output, _ = run(scene, tmp_path / f"warned_{ranks}", ranks, 1, options)
        told[ranks] = re.findall(r"^warning: step 1: body 8 .*$", output, re.MULTILINE)
    assert len(told[None]) == 1 and all(warning == told[None] for warning in told.values()), told


def test_warnings_and_their_counts_do_not_depend_on_ranks_or_checkpoints(whole, tmp_path):
    options = ("--set", "guards.displacement=warn", "--set", "guards.displacement_limit=0.02", "--set",
               "guards.step=warn", "--set", "forces.stiffness=5e3", "--set", "integrate.safety_factor=0.6", "--set",
               "checkpoint.steps=20", "--set", "integrate.duration=0.06")
    told = {}
    for ranks in (None, 2, 3, 4):
        output, _ = run(whole / "scene.nml", tmp_path / f"of_{ranks}", ranks, 1, options)
        # How many processors there are for the ranks is not the same for all.
        told[ranks] = (re.findall(r"^warning: (?!.* processors).*$", output, re.MULTILINE),
                       re.findall(r"^warnings: .*$", output, re.MULTILINE), state_hash(output))
    assert [any(each in text for text in told[None][0]) for each in
            (" may move more than ", " overlap by ", " is inside body ", " of the stable step")] == [True] * 4, told
    assert len(told[None][1]) == 5, told
    assert all(sorted(each[0]) == sorted(told[None][0]) and each[1:] == told[None][1:] for each in told.values()), told


def test_what_is_refused_leaves_a_result_as_it_was(whole, tmp_path):
    folder = tmp_path / "result"
    shutil.copytree(whole / "whole", folder)
    before = {path.name: path.read_bytes() for path in folder.iterdir() if path.suffix == ".h5"}
    for ranks, options, what in (
        (3, ("--force", "--set", "forces.friction=exact"), "exact friction"),
        (2, ("--force", "--set", "output.trace_steps=3"), "trace_steps"),
        (None, ("--continue", "--changed", "--set", "integrate.scheme=gear"), "does not fit this run"),
        (2, ("--continue", "--changed", "--set", "integrate.scheme=gear"), "does not fit this run"),
        (None, ("--continue", "--changed", "--set", "output.step_profile=.true."), "step_profile"),
    ):
        _, text = run(whole / "scene.nml", folder, ranks, 1, (*OPTIONS, *options), code=BAD_INPUT)
        assert what in message_of(text), text
        assert before == {path.name: path.read_bytes() for path in folder.iterdir() if path.suffix == ".h5"}, what


def test_a_damaged_checkpoint_is_passed_over(whole, interrupted, tmp_path):
    for k, damage in enumerate((lambda file, size: file.truncate(size // 2),
                                lambda file, size: (file.seek(size // 2), file.write(b"\x55\xaa")))):
        folder = tmp_path / f"damaged_{k}"
        shutil.copytree(interrupted, folder)
        newest = max(folder.glob("checkpoint_?.h5"), key=lambda path: path.stat().st_mtime_ns)
        with open(newest, "r+b") as file:
            damage(file, newest.stat().st_size)
        output = finish(whole, folder, 2)
        assert f"warning: {newest}: is damaged" in output and "the newest valid checkpoint" in output, output


def test_changed_settings_are_refused_with_the_difference(whole, interrupted, tmp_path):
    folder = tmp_path / "changed"
    shutil.copytree(interrupted, folder)
    options = ("--continue", *OPTIONS, "--set", "forces.friction_coefficient=0.5")
    _, text = run(whole / "scene.nml", folder, 3, 1, options, code=BAD_INPUT)
    assert "forces.friction_coefficient was 0.23 and is 0.5" in message_of(text), text


def test_a_folder_that_cannot_be_made_is_named(whole, tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    _, text = run(whole / "scene.nml", tmp_path / "file" / "result", 3, code=NO_FILE)
    assert str(tmp_path / "file" / "result") in message_of(text)


def test_a_disk_that_is_full_loses_nothing(whole, request, tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    for kilobytes in (300, 500, 1200, 1500, 2000, 2500) if request.config.getoption("full") else (300, 2000):
        mount = ["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", str(disk)]
        if subprocess.run(mount, capture_output=True, check=False).returncode != 0:
            pytest.skip("no file system may be mounted here")
        try:
            _, text = run(whole / "scene.nml", disk / "result", 3, 1, OPTIONS, code=NO_FILE)
            assert str(disk) in message_of(text)
            before = segments(disk / "result")
            subprocess.run(["mount", "-o", "remount,size=64m", str(disk)], check=True)
            finish(whole, disk / "result", 2)
            after = segments(disk / "result")
            assert all(after[name] == content for name, content in before.items())
        finally:
            subprocess.run(["umount", str(disk)], check=True)


def test_variables_of_the_fortran_library_change_nothing(whole, monkeypatch, tmp_path):
    for name, value in (("CONVERT_UNIT", "big_endian"), ("OPTIONAL_PLUS", "y"), ("STDOUT_UNIT", "5")):
        monkeypatch.setitem(ENVIRONMENT, f"GFORTRAN_{name}", value)
    finish(whole, tmp_path / "result", 2)


def test_more_threads_than_processors_of_all_ranks_together_draw_a_warning(whole, tmp_path):
    processors = len(os.sched_getaffinity(0))
    short = (*OPTIONS, "--set", "integrate.duration=1e-3")
    for ranks in sorted({1, processors, processors + 1}):
        output, _ = run(whole / "scene.nml", tmp_path / str(ranks), ranks, 1, short)
        told = f"warning: more threads than processors ({ranks} on {processors})"
        assert (told in output) == (ranks > processors), output
        assert (told in (tmp_path / str(ranks) / "log.txt").read_text(encoding="utf-8")) == (ranks > processors)
    _, message = run(whole / "scene.nml", tmp_path / "many", 2, 64*processors + 1, OPTIONS, code=2)
    assert message.count("threads are too many") == 1 and not (tmp_path / "many").exists(), message
