"""Runs that end early or cannot restart: signals, limits, damage, changed settings, full and unwritable folders.

usage: check_continue.py PROGRAM
"""

import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from continued_run import (
    N_FRAMES,
    assert_whole,
    closed_segments,
    frames_of,
    run,
    start,
    summary_of,
    totals_of,
    write_scene,
)

#: Exit codes of a run, as inputs/getting_started.md lists them
FAILED, BAD_INPUT, NO_FILE, EARLY = 1, 2, 3, 75
#: How often something is tried that does not come about at once on a busy machine
MOST_ATTEMPTS = 20


class Case:
    """The program, and the expected output of an undisturbed run."""

    def __init__(self, program):
        self.program = program
        code, output, message = run(program, "whole")
        assert code == 0, message
        self.expected = totals_of(output)
        assert_whole(program, "whole")

    def run(self, folder, *options):
        return run(self.program, folder, *options)

    def interrupt(self, folder, number=signal.SIGTERM, *options, when=None):
        """Run, and interrupt the run by a signal: after two checkpoints, or when a condition holds."""
        is_due = when or (lambda: len(checkpoints_of(folder)) == 2)
        for _ in range(MOST_ATTEMPTS):
            process = start(self.program, folder, *options)
            wait_for(lambda: is_due() or process.poll() is not None)
            process.send_signal(number)
            output, message = process.communicate()
            if process.returncode != 0:
                return process.returncode, output, message
            # On a busy machine the run may come to its end before the signal does.
            shutil.rmtree(folder)
        raise AssertionError("every run ended before the signal came")

    def finish(self, folder, *options):
        """Continue to the end, check the result and return the output."""
        code, output, message = self.run(folder, "--continue", *options)
        assert code == 0, message
        assert totals_of(output) == self.expected, (totals_of(output), self.expected)
        assert_whole(self.program, folder)
        return output


def run_all(tests):
    """Call all tests with the program and the other paths of the command line, in a folder of their own."""
    program, *libraries = (os.path.abspath(word) for word in sys.argv[1:])
    with tempfile.TemporaryDirectory() as work:
        os.chdir(work)
        write_scene()
        case = Case(program)
        for test in tests:
            began = time.monotonic()
            test(case, *libraries)
            print(f"{test.__name__.replace('_', ' ')}: {time.monotonic() - began:.1f} s", flush=True)


def least_seconds(limit, call):
    """Least time of a call, repeated until it takes less than a limit: other work on this machine may delay it."""
    least = float("inf")
    for _ in range(MOST_ATTEMPTS):
        began = time.monotonic()
        call()
        least = min(least, time.monotonic() - began)
        if least < limit:
            break
    return least


def wait_for(condition, seconds=600.0):
    """Wait until a condition holds."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.002)


def checkpoints_of(folder):
    """Paths of the checkpoints of a result, the newest last."""
    paths = [os.path.join(folder, f"checkpoint_{k}.h5") for k in (1, 2)]
    return sorted((path for path in paths if os.path.exists(path)), key=os.path.getmtime)


def flip(path, place):
    """Flip a bit of a file."""
    with open(path, "r+b") as file:
        file.seek(place)
        byte = file.read(1)[0]
        file.seek(place)
        file.write(bytes([byte ^ 1 << place % 8]))


def cut(path, length):
    """Cut a file."""
    os.truncate(path, length)


def a_signal_ends_a_run_with_a_checkpoint(case):
    for number in (signal.SIGUSR1, signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        folder = number.name
        code, output, message = case.interrupt(folder, number)
        assert code == EARLY, (code, message)
        step = re.search(f"interrupted by {number.name} at step (\\d+) of 1200; add --continue to resume", message)
        assert step and step.group(0) in output, (output, message)
        assert not [name for name in os.listdir(folder) if name.endswith((".open", ".unfinished", ".lock"))]
        assert f"interrupted by {number.name}" in summary_of(case.program, folder)["state"]
        assert f"step {step.group(1)}\n" in case.finish(folder)
        told = summary_of(case.program, folder)
        assert told["state"] == "finished" and told["bodies"] == "64", told
        assert told["frames"].startswith(f"{N_FRAMES} in ") and told["time span"].endswith(" s to 1.20000E-02 s"), told
        size = sum(os.path.getsize(os.path.join(folder, name)) for name in os.listdir(folder))
        assert told["size"] == f"{size // 1024 + 1} KiB", (told, size)


def usr1_while_a_run_starts_ends_it_after_the_first_step(case):
    def send():
        # A signal that is blocked and pending stays so in the program that takes the place of this process.
        signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGUSR1])
        os.kill(os.getpid(), signal.SIGUSR1)

    process = start(case.program, "at_once", before=send)
    _, message = process.communicate()
    assert process.returncode == EARLY and "interrupted by SIGUSR1 at step 1 of 1200" in message, message
    case.finish("at_once")


def a_second_signal_ends_it_at_once(case):
    # No process reads the output of the run, so the run soon blocks on it and polls for no signals.
    for _ in range(MOST_ATTEMPTS):
        process = start(case.program, "twice", "--set", "integrate.duration=100", "--set", "output.log_interval=1e-5")
        sizes = [-1]
        while sizes[-1] < 60000 or sizes[-1] != sizes[-2]:
            time.sleep(0.3)
            sizes.append(os.path.getsize("twice/log.txt") if os.path.exists("twice/log.txt") else 0)
            assert len(sizes) < 2000, sizes
        process.send_signal(signal.SIGTERM)
        time.sleep(0.3)
        if process.poll() is None:
            break
        # On a busy machine the run may not yet have been blocked.
        process.communicate()
        assert process.returncode == EARLY
        shutil.rmtree("twice")
    # Two that come before the run has heard the first one are one.
    while process.poll() is None:
        process.send_signal(signal.SIGTERM)
        time.sleep(0.3)
    assert process.returncode == -signal.SIGTERM
    process.communicate()


def elapsed_time_ends_a_run_in_time(case):
    def run_limited():
        began = time.monotonic()
        code, _, message = case.run("limited", "--force", "--set", "integrate.duration=100", "--walltime", "00:00:02")
        assert code == EARLY and "interrupted by --walltime" in message, (code, message)
        assert time.monotonic() - began > 1.0
        assert len(checkpoints_of("limited")) == 2

    assert least_seconds(4.0, run_limited) < 4.0


def a_damaged_checkpoint_is_passed_over(case):
    chance = random.Random(2)
    case.interrupt("intact")
    newest = os.path.basename(checkpoints_of("intact")[-1])
    size = os.path.getsize(os.path.join("intact", newest))
    for k in range(6):
        folder = f"damaged_{k}"
        shutil.copytree("intact", folder)
        path = os.path.join(folder, newest)
        flip(path, chance.randrange(size)) if k < 4 else cut(path, chance.randrange(size))
        output = case.finish(folder)
        assert f"warning: {path}: is damaged" in output and "the newest valid checkpoint" in output, output
    for path in checkpoints_of("intact"):
        flip(path, 1000)
    before = closed_segments("intact")
    code, _, message = case.run("intact", "--continue")
    assert code == NO_FILE and "no checkpoint can be used" in message and "--force" in message, (code, message)
    assert closed_segments("intact") == before


def changed_settings_are_refused_unless_allowed(case):
    case.interrupt("changed")
    options = ("--set", "forces.friction_coefficient=0.5")
    code, _, message = case.run("changed", "--continue", *options)
    assert code == BAD_INPUT, (code, message)
    assert "forces.friction_coefficient was 0.23 and is 0.5" in message and "--changed" in message, message
    code, output, message = case.run("changed", "--continue", "--changed", *options)
    assert code == 0 and "changed    forces.friction_coefficient was 0.23 and is 0.5" in output, message
    assert totals_of(output)[-1] != case.expected[-1]
    assert_whole(case.program, "changed")
    case.interrupt("stepped")
    code, _, message = case.run("stepped", "--continue", "--changed", "--set", "integrate.dt=5e-6")
    assert code == BAD_INPUT and "(time step) was 1.0000000000000001E-05 s" in message, (code, message)
    case.finish("stepped")


def a_finished_run_stays_as_it_is(case):
    before = {name: os.stat(os.path.join("whole", name)).st_mtime_ns for name in os.listdir("whole")}
    code, output, message = case.run("whole", "--continue")
    assert (code, message) == (0, "") and "nothing to do" in output, (code, output, message)
    assert output.splitlines()[-1] == case.expected[-1], (output, case.expected)
    assert before == {name: os.stat(os.path.join("whole", name)).st_mtime_ns for name in os.listdir("whole")}
    code, _, message = case.run("whole")
    assert code == BAD_INPUT and "add --continue to resume it" in message, (code, message)


def a_finished_run_is_made_longer(case):
    # Step 900 has a frame in the whole run, too.
    short = ("--set", "integrate.duration=9e-3")
    code, _, message = case.run("longer", *short)
    assert code == 0, message
    before = closed_segments("longer")
    for words, options in (("integrate.duration was 0.009 and is 0.006", ()), ("behind the end", ("--changed",))):
        code, _, message = case.run("longer", "--continue", "--set", "integrate.duration=6e-3", *options)
        assert code == BAD_INPUT and words in message and closed_segments("longer") == before, (code, message)
    # A kill while the run grows: it grows on, or ends as it was.
    for _ in range(MOST_ATTEMPTS):
        shutil.copytree("longer", "regrown")
        process = start(case.program, "regrown", "--continue", "--set", "checkpoint.steps=0")
        wait_for(lambda: len(closed_segments("regrown")) > len(before) or process.poll() is not None)
        process.send_signal(signal.SIGKILL)
        process.communicate()
        if process.returncode != 0:
            break
        shutil.rmtree("regrown")
    assert len(closed_segments("regrown")) > len(before)
    shutil.copytree("regrown", "shrunk")
    code, output, message = case.run("shrunk", "--continue", *short)
    assert code == 0 and "to remove" in output and closed_segments("shrunk") == before, (output, message)
    for folder in "longer", "shrunk", "regrown":
        output = case.finish(folder)
        assert "extended   integrate.duration was 0.009 and is 0.012" in output, output
        after = closed_segments(folder)
        assert all(after[name] == content for name, content in before.items())
        checked = subprocess.run([case.program, "info", "--check", folder], capture_output=True, text=True, check=False)
        assert checked.returncode == 0, checked.stdout
    # A step that is chosen stays, and the log says which one it is.
    chosen = ("--set", "integrate.dt=0", "--set", "integrate.safety_factor=0.1")
    for duration, options in (("2e-3", ()), ("3.1e-3", ("--continue",))):
        code, grown, message = case.run("chosen", *chosen, "--set", f"integrate.duration={duration}", *options)
        assert code == 0, message
    step = re.search(r"a run that begins with integrate.dt = (\S+) has the same bits", grown).group(1)
    code, whole, message = case.run("given", "--set", f"integrate.dt={step}", "--set", "integrate.duration=3.1e-3")
    assert code == 0 and totals_of(whole) == totals_of(grown), message
    # Without the last checkpoint there is nothing to go on from.
    none = ("--set", "checkpoint.at_end=.false.", "--set", "checkpoint.steps=0")
    assert case.run("ended", *short, *none)[0] == 0 and not checkpoints_of("ended")
    code, _, message = case.run("ended", "--continue")
    assert code == BAD_INPUT and "has no checkpoint from which" in message, (code, message)


def a_run_without_checkpoint_begins_with_its_first_step(case):
    assert "no checkpoint" not in case.finish("fresh")
    case.interrupt("early", signal.SIGKILL, "--set", "checkpoint.steps=0", "--set", "output.frames_per_segment=1000",
                   when=lambda: os.path.exists("early/trajectory_0001.h5.open"))
    assert not closed_segments("early") and not checkpoints_of("early")
    with open("early/trajectory_0001.h5.open", "w", encoding="utf-8") as file:
        file.write("what a kill left")
    assert "there is no checkpoint in early: the run starts at step 0" in case.finish("early")
    # A kill between the end of a segment and the checkpoint leaves a segment, which the next run keeps.
    case.interrupt("segment")
    for path in checkpoints_of("segment"):
        os.remove(path)
    code, _, message = case.run("segment", "--continue", "--changed", "--set", "scene.seed=2")
    assert code == BAD_INPUT and "scene.seed was 1 and is 2" in message and "--force" in message, (code, message)
    before = closed_segments("segment")
    case.finish("segment")
    after = closed_segments("segment")
    assert before and all(after[name] == content for name, content in before.items())


def a_missing_segment_is_noticed(case):
    case.interrupt("gap")
    os.remove("gap/trajectory_0001.h5")
    code, _, message = case.run("gap", "--continue")
    assert code == NO_FILE and "gap/trajectory_0001.h5 is missing" in message, (code, message)
    with open("gap/trajectory_0001.h5", "w", encoding="utf-8") as file:
        file.write("what somebody put there")
    code, _, message = case.run("gap", "--continue")
    assert code == NO_FILE and "gap/trajectory_0001.h5 is damaged: it has 23 bytes" in message, (code, message)


def a_run_that_a_guard_stops_leaves_frames_and_checkpoint(case):
    options = ("--set", "forces.gravity=0,-5e4", "--set", "checkpoint.steps=60")
    code, _, message = case.run("guard", *options)
    assert code == FAILED and "no point of it may move more than" in message, (code, message)
    last = int(re.search(r"step (\d+)", message).group(1))
    assert last > 120 and len(checkpoints_of("guard")) == 2, message
    assert not [name for name in os.listdir("guard") if name.endswith((".open", ".unfinished", ".lock"))]
    n_frames = sum(n for n, _, _ in frames_of(case.program, "guard"))
    assert n_frames >= 1 + (last - 1) // 12, (n_frames, last)
    # A restart from the last checkpoint fails at the same step.
    assert case.run("guard", "--continue", *options)[::2] == (FAILED, message)
    assert sum(n for n, _, _ in frames_of(case.program, "guard")) == n_frames


def a_disk_that_is_full_loses_nothing(case):
    os.makedirs("disk", exist_ok=True)
    for kilobytes in (300, 500, 800, 1200):
        mount = ["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", "disk"]
        if subprocess.run(mount, capture_output=True, check=False).returncode != 0:
            print("  skipped: no file system may be mounted here")
            return
        try:
            code, _, message = case.run("disk/result")
            assert code == NO_FILE and "disk/result" in message, (code, message)
            assert not [name for name in os.listdir("disk/result") if name.endswith(".h5.unfinished")]
            before = closed_segments("disk/result")
            subprocess.run(["mount", "-o", "remount,size=64m", "disk"], check=True)
            case.finish("disk/result")
            after = closed_segments("disk/result")
            assert all(after[name] == content for name, content in before.items())
        finally:
            subprocess.run(["umount", "disk"], check=True)


def a_folder_that_cannot_be_written_is_named(case):
    with open("file", "w", encoding="utf-8"):
        pass
    code, _, message = case.run("file/result", "--continue")
    assert code == NO_FILE and "file/result" in message, (code, message)
    case.interrupt("blocked")
    os.makedirs("blocked/checkpoint_1.h5.unfinished")
    code, _, message = case.run("blocked", "--continue")
    assert code == NO_FILE and "blocked/checkpoint_1.h5.unfinished" in message, (code, message)
    os.rmdir("blocked/checkpoint_1.h5.unfinished")
    case.finish("blocked")


TESTS = (a_signal_ends_a_run_with_a_checkpoint, usr1_while_a_run_starts_ends_it_after_the_first_step,
         a_second_signal_ends_it_at_once, elapsed_time_ends_a_run_in_time, a_damaged_checkpoint_is_passed_over,
         changed_settings_are_refused_unless_allowed, a_finished_run_stays_as_it_is,
         a_finished_run_is_made_longer,
         a_run_without_checkpoint_begins_with_its_first_step,
         a_missing_segment_is_noticed, a_run_that_a_guard_stops_leaves_frames_and_checkpoint,
         a_disk_that_is_full_loses_nothing, a_folder_that_cannot_be_written_is_named)


if __name__ == "__main__":
    run_all(TESTS)
