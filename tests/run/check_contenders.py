"""Many processes compete for the lock of one folder: at most one holds it, and a dead process does not block others.

usage: check_contenders.py CONTEND CONTENDED_SYSTEM [ROUNDS [SECONDS]]

CONTEND is the program of contend.f90, CONTENDED_SYSTEM the library of contended_system.c, which delays calls to the
file system at random. First 8 processes acquire and release the lock ROUNDS times each (default 25). Then the test
kills processes and starts others, for SECONDS seconds (default 3).
"""

import os
import random
import subprocess
import sys
import tempfile
import time

N_PROCESSES = 8
#: Number of rounds that no process completes
ENDLESS = 10**6


class Contenders:
    """The program, the library, and the numbers of rounds and seconds."""

    def __init__(self, program, library, rounds, seconds):
        self.program = program
        self.environment = {**os.environ, "LD_PRELOAD": library, "POLYDEM_HOSTILE": "slow"}
        self.rounds = rounds
        self.seconds = seconds

    def start(self, rounds):
        """Start a process that acquires the lock of the working directory `rounds` times."""
        return subprocess.Popen([self.program, ".", str(rounds)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                text=True, env=self.environment)


def end(process):
    """Wait for the end of a process; return how often it acquired the lock, and how often it took over a lock."""
    output, _ = process.communicate(timeout=600)
    *others, counts = output.splitlines()
    inside, taken, met = (int(word) for word in counts.split())
    assert process.returncode == 0 and not others and met == 0, output
    return inside, taken


def many_processes_are_inside_one_at_a_time(contenders):
    processes = [contenders.start(contenders.rounds) for _ in range(N_PROCESSES)]
    ends = [end(process) for process in processes]
    assert ends == [(contenders.rounds, 0)] * N_PROCESSES, ends
    assert os.listdir(".") == [], os.listdir(".")
    print(f"{N_PROCESSES} processes were inside {contenders.rounds} times each")


def killed_processes_keep_nobody_out(contenders):
    chance = random.Random(5)
    processes = [contenders.start(ENDLESS) for _ in range(N_PROCESSES)]
    kills = 0
    last = time.monotonic() + contenders.seconds
    while time.monotonic() < last:
        time.sleep(chance.uniform(0.0, 0.03))
        k = chance.randrange(N_PROCESSES)
        processes[k].kill()
        output, _ = processes[k].communicate()
        assert output == "", output
        processes[k] = contenders.start(ENDLESS)
        kills += 1
    for process in processes:
        process.kill()
    for process in processes:
        assert process.communicate()[0] == ""
    left = int(os.path.exists("running.lock") and os.path.getsize("running.lock") > 0)
    inside, taken = end(contenders.start(1))
    assert (inside, taken) == (1, left), (inside, taken, left)
    assert os.listdir(".") == [], os.listdir(".")
    print(f"{kills} kills among {N_PROCESSES} processes kept nobody out")


def main():
    program, library = (os.path.abspath(word) for word in sys.argv[1:3])
    rounds = int(sys.argv[3]) if len(sys.argv) > 3 else 25
    seconds = float(sys.argv[4]) if len(sys.argv) > 4 else 3.0
    contenders = Contenders(program, library, rounds, seconds)
    with tempfile.TemporaryDirectory() as work:
        os.chdir(work)
        many_processes_are_inside_one_at_a_time(contenders)
        killed_processes_keep_nobody_out(contenders)


if __name__ == "__main__":
    main()
