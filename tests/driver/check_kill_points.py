"""Runs that are killed before each single time that they ask something of a file: nobody has to clean up by hand.

usage: check_kill_points.py PROGRAM CONTENDED_SYSTEM [all]

CONTENDED_SYSTEM is the library of contended_system.c, which counts what the program asks of files in the folder of the
result, and kills it before the n-th time. A short run is killed at each of the first 24 and last 12 points, where it
locks and leaves the folder, and at every 40th of the others; with `all`, at each. After each kill, --continue must
come to the right end. After every fourth, the killed run is begun again with --force as well.
"""

import os
import re
import shutil
import signal
import sys
import tempfile
import time

from check_faults import environment
from continued_run import books_of, run, write_scene

#: A run of 20 steps with 7 frames in 4 segments or more, and checkpoints every 7 steps
SHORT = ("--set", "integrate.duration=2e-4", "--set", "output.frames_per_segment=2", "--set", "checkpoint.steps=7")
#: Points that are never left out: there the folder is locked, or no longer
N_FIRST, N_LAST = 24, 12
#: One of so many of the others is taken
STRIDE = 40


class Killer:
    """The program, and what it prints if nobody kills it."""

    def __init__(self, program, library):
        self.program = program
        self.library = library
        code, output, message = run(program, "whole", *SHORT)
        assert code == 0, message
        self.expected = books_of(output)

    def n_points(self):
        """How many points a run has at which it can be killed."""
        with environment(LD_PRELOAD=self.library, POLYDEM_KILL_AT="0", POLYDEM_KILL_IN="counted"):
            code, _, message = run(self.program, "counted", *SHORT)
        assert code == 0, message
        return int(re.search(r"^asked (\d+) times$", message, re.MULTILINE).group(1))

    def kill_at(self, point, folder, *options):
        """Run, and be killed at a point; give whether the run came so far."""
        with environment(LD_PRELOAD=self.library, POLYDEM_KILL_AT=str(point), POLYDEM_KILL_IN=folder):
            code, output, message = run(self.program, folder, *SHORT, *options)
        if code == 0:
            assert books_of(output) == self.expected
            return False
        assert code == -signal.SIGKILL, (point, code, message)
        return True

    def finish(self, point, folder, option):
        """Come to the right end with an option."""
        code, output, message = run(self.program, folder, *SHORT, option)
        assert code == 0, (point, option, message)
        if "nothing to do" in output:
            assert output.splitlines()[-1] == self.expected[-1], (point, output)
        else:
            assert books_of(output) == self.expected, (point, option, output)
        # A run that was killed after its end leaves its lock, which keeps nobody out, in a result that stays as it is.
        suffixes = (".open", ".unfinished") if "nothing to do" in output else (".open", ".unfinished", ".lock")
        left = [name for name in os.listdir(folder) if name.endswith(suffixes)]
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
    # A line of the log that depends on the clock may make the last points vary.
    assert n_kills > N_FIRST + n_points // STRIDE and n_points > 500, (n_kills, n_points)
    seconds = time.monotonic() - began
    print(f"{n_kills} kills at points 1 to {n_points}, all recovered without cleaning: {seconds:.1f} s")


if __name__ == "__main__":
    main()
