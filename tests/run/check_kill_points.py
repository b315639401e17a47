"""Runs that are killed before each single call to the file system: every restart recovers without manual cleaning.

usage: check_kill_points.py PROGRAM CONTENDED_SYSTEM [all]

CONTENDED_SYSTEM is the library of contended_system.c. It counts the calls of the program to files in the result folder
and kills the program before the n-th call. A short run is killed at each of the first 24 and last 12 calls, where it
locks and unlocks the folder, and at every 120th of the others; with `all`, at each. After each kill, --continue must
lead to the correct result. After every fourth kill, a copy of the run also starts again with --force.
"""

import os
import re
import shutil
import signal
import sys
import tempfile
import time

from check_faults import environment
from continued_run import run, totals_of, write_scene

#: A run of 20 steps with 7 frames in 4 segments or more, and checkpoints every 7 steps
SHORT = ("--set", "integrate.duration=2e-4", "--set", "output.frame_interval=3e-5", "--set",
         "output.frames_per_segment=2", "--set", "checkpoint.steps=7")
#: Numbers of first and last points that are always tested: there the run locks and unlocks the folder
N_FIRST, N_LAST = 24, 12
#: Stride of the tested points in between
STRIDE = 120


class Killer:
    """The program, and the output of an undisturbed run."""

    def __init__(self, program, library):
        self.program = program
        self.library = library
        code, output, message = run(program, "whole", *SHORT)
        assert code == 0, message
        self.expected = totals_of(output)

    def n_points(self):
        """Number of points at which a run can be killed."""
        with environment(LD_PRELOAD=self.library, POLYDEM_KILL_AT="0", POLYDEM_KILL_IN="counted"):
            code, _, message = run(self.program, "counted", *SHORT)
        assert code == 0, message
        return int(re.search(r"^asked (\d+) times$", message, re.MULTILINE).group(1))

    def kill_at(self, point, folder, *options):
        """Run with a kill at a point; return whether the run reached it."""
        with environment(LD_PRELOAD=self.library, POLYDEM_KILL_AT=str(point), POLYDEM_KILL_IN=folder):
            code, output, message = run(self.program, folder, *SHORT, *options)
        if code == 0:
            assert totals_of(output) == self.expected
            return False
        assert code == -signal.SIGKILL, (point, code, message)
        return True

    def finish(self, point, folder, option):
        """Finish the run with an option, and check its result."""
        code, output, message = run(self.program, folder, *SHORT, option)
        assert code == 0, (point, option, message)
        if "nothing to do" in output:
            assert output.splitlines()[-1] == self.expected[-1], (point, output)
            with open(os.path.join(folder, "log.txt"), encoding="utf-8") as file:
                assert totals_of(file.read()) == self.expected, (point, "log.txt")
        else:
            assert totals_of(output) == self.expected, (point, option, output)
        # A run that was killed after its end leaves its lock in a finished result; the lock blocks no other run.
        # Likewise its last checkpoint, which it writes when the result is complete.
        is_over = "nothing to do" in output
        left = [name for name in os.listdir(folder) if name.endswith((".open", ".unfinished", ".lock"))
                and not (is_over and (name.endswith(".lock") or name.startswith("checkpoint_")))]
        assert not left, (point, option, left)


def main():
    program, library = (os.path.abspath(word) for word in sys.argv[1:3])
    takes_all = sys.argv[3:] == ["all"]
    began = time.monotonic()
    n_kills = 0
    with tempfile.TemporaryDirectory() as work:
        os.chdir(work)
        write_scene()
        killer = Killer(program, library)
        n_points = killer.n_points()
        for point in range(1, n_points + 1):
            if not (takes_all or point <= N_FIRST or point > n_points - N_LAST or point % STRIDE == 0):
                continue
            folder = f"point_{point}"
            n_kills += killer.kill_at(point, folder)
            if os.path.exists(folder) and n_kills % 4 == 0:
                shutil.copytree(folder, folder + "_forced")
                killer.finish(point, folder + "_forced", "--force")
                shutil.rmtree(folder + "_forced")
            killer.finish(point, folder, "--continue")
            shutil.rmtree(folder)
    # The number of points can vary by a line of the log that depends on the clock.
    assert n_kills > N_FIRST + n_points // STRIDE and n_points > 500, (n_kills, n_points)
    seconds = time.monotonic() - began
    print(f"{n_kills} kills at points 1 to {n_points}, all recovered without cleaning: {seconds:.1f} s")


if __name__ == "__main__":
    main()
