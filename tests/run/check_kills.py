"""Restarts of runs that are killed at random times, also while they write a checkpoint or a frame.

usage: check_kills.py PROGRAM [KILLS [SEED]]

The test kills and continues a run until it ends by itself, then starts the next run, until it has made KILLS kills
(default 10). Each run must end with the hash, energy balance and frames of an undisturbed run, and keep all closed
segments.
"""

import collections
import os
import random
import re
import subprocess
import sys
import tempfile
import time

from continued_run import assert_whole, closed_segments, run, start, totals_of, write_scene

#: Checkpoints as often as frames
OFTEN = ("--set", "checkpoint.steps=20")


def attempt(program, folder, seconds):
    """Continue a run and kill it after some seconds, unless None; return its output if it ended before."""
    process = start(program, folder, *OFTEN, "--continue")
    try:
        output, message = process.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        return None
    assert process.returncode == 0, message
    return output


def traces_of(folder):
    """Activity that a kill interrupted, judged from the files it left."""
    names = os.listdir(folder) if os.path.isdir(folder) else []
    if any(name.startswith("checkpoint") and name.endswith(".unfinished") for name in names):
        return "in a checkpoint"
    if any(name.endswith(".open") for name in names):
        return "with an open segment"
    return "elsewhere"


def assert_right(program, folder, output, expected):
    """Check that a run ends as the undisturbed run. A run killed after its end has nothing to do."""
    if "nothing to do" in output:
        assert output.splitlines()[-1] == expected[-1], (output, expected)
    else:
        assert totals_of(output) == expected, (totals_of(output), expected)
    assert_whole(program, folder)


def main():
    program = os.path.abspath(sys.argv[1])
    wanted = int(sys.argv[2]) if len(sys.argv) > 2 else 10
    chance = random.Random(int(sys.argv[3]) if len(sys.argv) > 3 else 1)
    kills = collections.Counter()
    n_runs = 0
    with tempfile.TemporaryDirectory() as work:
        os.chdir(work)
        write_scene()
        began = time.monotonic()
        code, output, message = run(program, "whole", *OFTEN)
        whole_seconds = time.monotonic() - began
        assert code == 0, message
        expected = totals_of(output)
        share = re.search(r"^output .* (\S+)%$", output, re.MULTILINE).group(1)
        assert_whole(program, "whole")
        while sum(kills.values()) < wanted:
            n_runs += 1
            folder = f"killed_{n_runs}"
            output = None
            while output is None:
                before = closed_segments(folder)
                patience = chance.uniform(0.0, 0.3 * whole_seconds) if sum(kills.values()) < wanted else None
                output = attempt(program, folder, patience)
                if output is None:
                    kills[traces_of(folder)] += 1
                    after = closed_segments(folder)
                    lost = [name for name, content in before.items() if after.get(name) != content]
                    assert not lost, f"kill {sum(kills.values())} lost or changed {lost}"
            assert_right(program, folder, output, expected)
    print(f"{sum(kills.values())} kills of {n_runs} runs, all recovered: {dict(kills)}; "
          f"frames and checkpoints are {share} % of the time of a run")


if __name__ == "__main__":
    main()
