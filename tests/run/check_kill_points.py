"""Runs that are killed before each single call to the file system: every restart recovers without manual cleaning.

usage: check_kill_points.py PROGRAM FAILING_CALLS [all]

FAILING_CALLS is the library of failing_calls.c. It counts the calls of the program that write to the result folder, and
kills the program before the n-th call, or when it wrote half. A short run is killed at each call to its lock, and at
the first and the last call of each other kind; with `all`, at each call. After each kill, --continue must lead to the
correct result. After every fourth kill, a copy of the run also starts again with --force; after those in between, a
copy is killed once more while it continues. The run has a file of actions.
"""

import os
import shutil
import signal
import sys
import tempfile
import time

from check_faults import environment
from check_writes import Call, sample
from continued_run import run, totals_of, write_scene

#: A run of 20 steps with 7 frames in 4 segments or more, and checkpoints every 7 steps
SHORT = ("--set", "integrate.duration=2e-4", "--set", "output.frame_interval=3e-5", "--set",
         "output.frames_per_segment=2", "--set", "checkpoint.steps=7", "--actions", "actions.txt")
#: Its actions
ACTIONS = "0 gravity 0 -50\n4 drag 30\n9 gravity 10 20\n15 drag 0\n"


class Killer:
    """The program, and the output of an undisturbed run."""

    def __init__(self, program, library):
        self.program = program
        self.library = library
        code, output, message = run(program, "whole", *SHORT)
        assert code == 0, message
        self.expected = totals_of(output)

    def points(self):
        """All calls at which a run can be killed."""
        log = os.path.abspath("calls")
        with environment(**self.surroundings("counted"), POLYDEM_FAIL_LOG=log):
            code, _, message = run(self.program, "counted", *SHORT)
        assert code == 0, message
        with open(log, encoding="utf-8") as file:
            return [Call(0, *line.split(" ", 2)) for line in file.read().splitlines()]

    def surroundings(self, folder):
        return {"LD_PRELOAD": self.library, "POLYDEM_FAIL_FOLDER": os.path.abspath(folder), "POLYDEM_FAIL_HOW": "kill"}

    def kill_at(self, point, folder, *options):
        """Run with a kill at a point; return whether the run reached it."""
        with environment(**self.surroundings(folder), POLYDEM_FAIL_CALL=str(point.number)):
            code, output, message = run(self.program, folder, *SHORT, *options)
        if code == 0:
            assert "nothing to do" in output or totals_of(output) == self.expected, (str(point), options)
            return False
        assert code == -signal.SIGKILL, (str(point), code, message)
        return True

    def finish(self, point, folder, option):
        """Finish the run with an option, and check its result."""
        code, output, message = run(self.program, folder, *SHORT, option)
        assert code == 0, (str(point), option, message)
        if "nothing to do" in output:
            assert output.splitlines()[-1] == self.expected[-1], (str(point), output)
            with open(os.path.join(folder, "log.txt"), encoding="utf-8") as file:
                last = file.read().rpartition("\nstarted ")[2]
            assert totals_of(last) == self.expected, (str(point), "log.txt")
        else:
            assert totals_of(output) == self.expected, (str(point), option, output)
        # A run that was killed after its end leaves its lock in a finished result; the lock blocks no other run.
        # Likewise its last checkpoint, which it writes when the result is complete.
        is_over = "nothing to do" in output
        left = [name for name in os.listdir(folder) if name.endswith((".open", ".unfinished", ".lock"))
                and not (is_over and (name.endswith(".lock") or name.startswith("checkpoint_")))]
        assert not left, (str(point), option, left)


def main():
    program, library = (os.path.abspath(word) for word in sys.argv[1:3])
    takes_all = sys.argv[3:] == ["all"]
    began = time.monotonic()
    n_kills = 0
    with tempfile.TemporaryDirectory() as work:
        os.chdir(os.path.realpath(work))
        write_scene()
        with open("actions.txt", "w", encoding="utf-8") as file:
            file.write(ACTIONS)
        killer = Killer(program, library)
        points = killer.points()
        chosen = sample(points)
        for point in points:
            if not (takes_all or point in chosen or point.path == "running.lock"):
                continue
            folder = f"point_{point.number}"
            n_kills += killer.kill_at(point, folder)
            if os.path.exists(folder) and n_kills % 2 == 0:
                copied = folder + "_copied"
                shutil.copytree(folder, copied)
                if n_kills % 4 != 0:
                    killer.kill_at(point, copied, "--continue")
                killer.finish(point, copied, "--continue" if n_kills % 4 else "--force")
                shutil.rmtree(copied)
            killer.finish(point, folder, "--continue")
            shutil.rmtree(folder)
    # The number of points can vary by a line of the log that depends on the clock.
    assert n_kills >= len(chosen) - 2, (n_kills, len(chosen), len(points))
    seconds = time.monotonic() - began
    print(f"{n_kills} kills at {len(points)} points, all recovered without cleaning: {seconds:.1f} s")


if __name__ == "__main__":
    main()
