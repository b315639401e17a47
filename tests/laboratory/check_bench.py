"""A bench that is killed at any time resumes where it stopped.

usage: check_bench.py PROGRAM

The test starts and kills a bench of two tiny scenes until one call ends by itself. The files must be those of an
undisturbed bench, and no sample may be taken twice.
"""

import os
import pty
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time

SCENE = """\
&scene name = 'gas' bodies = 200 solid_fraction = 0.35 speed = 2 /
&forces gravity = 0, 0 /
&integrate dt = 2e-5 duration = 1.2e-3 /
&output trace_steps = 40 trace_start = 2e-4 /
"""
BENCH = """\
&bench
   scenes = 'gas.nml', 'gas.nml scene.bodies=50'
   names = 'many', 'few'
   finders = 'quadtree', 'sort_and_sweep'
   threads = 1, 2
   repeats = 5
/
"""
SAMPLES = 2 * 2 * 2 * 6
LEAST_KILLS, MOST_KILLS = 3, 200
#: Exit code of a skipped test
SKIPPED = 77


def call(program, folder, seconds=None):
    """Start the bench in a folder; kill it after `seconds`, unless None. Return its exit code and output."""
    arguments = [program, "bench", "bench.nml", "--set", f"bench.folder={folder}"]
    environment = {**os.environ, "OMP_WAIT_POLICY": "passive"}
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          env=environment) as process:
        try:
            output, _ = process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            process.kill()
            output, _ = process.communicate()
    return process.returncode, output


def files_of(folder):
    """Traces, reference lists and samples in a folder. A kill may truncate the other files of a run."""
    paths = (os.path.relpath(os.path.join(top, name), folder) for top, _, names in os.walk(folder) for name in names)
    return sorted(path for path in paths if not path.startswith("traces") or path.endswith("trace.h5"))


def hash_of(path):
    """The texts of 16 hexadecimal digits in a file: hashes of boxes or states, and of pairs."""
    with open(path, "rb") as file:
        return sorted(set(re.findall(rb"(?<![0-9a-f])[0-9a-f]{16}", file.read())))


def times_of(folder):
    """When each finished sample was written."""
    samples = os.path.join(folder, "samples")
    if not os.path.isdir(samples):
        return {}
    names = [name for name in os.listdir(samples) if name.endswith(".h5")]
    return {name: os.stat(os.path.join(samples, name)).st_mtime_ns for name in names}


def counts_of(output):
    """Numbers of samples taken and found, from the last line of progress."""
    ((taken, found),) = re.findall(r"^(\d+) samples taken, (\d+) found", output, re.MULTILINE)
    return int(taken), int(found)


def check_terminal(program):
    """On a terminal one line is rewritten in place. Code 77 ends this test where there is no pseudo-terminal."""
    try:
        main_end, other_end = pty.openpty()
    except OSError as error:
        print(f"skipped: a terminal, after all else has passed: no pseudo-terminal ({error}): mount devpts at /dev/pts")
        sys.exit(SKIPPED)
    arguments = [program, "bench", "bench.nml", "--set", "bench.folder=shown", "--set", "bench.repeats=9"]
    with subprocess.Popen(arguments, stdout=other_end, stderr=other_end) as process:
        os.close(other_end)
        shown = b""
        try:
            while piece := os.read(main_end, 65536):
                shown += piece
        except OSError:
            pass
    os.close(main_end)
    assert process.returncode == 0, shown
    lines = [line for line in shown.decode().replace("\r\n", "\n").split("\n") if " of 80 samples" in line]
    assert 1 <= len(lines) <= 2 and all("\r" in line for line in lines), lines
    assert "steps/s" not in shown.decode(), "the log of a run that makes boxes belongs into its folder"


def main():
    program = os.path.abspath(sys.argv[1])
    chance = random.Random(3)
    with tempfile.TemporaryDirectory() as work:
        os.chdir(work)
        for name, text in (("gas.nml", SCENE), ("bench.nml", BENCH)):
            with open(name, "w", encoding="utf-8") as file:
                file.write(text)
        began = time.monotonic()
        code, output = call(program, "whole")
        whole_seconds = time.monotonic() - began
        assert code == 0, output
        assert counts_of(output) == (SAMPLES, 0) == (48, 0), output
        assert len(re.findall(r" of 48 samples", output)) < 10, output

        killed, most_seconds = 0, 0.5 * whole_seconds
        while killed < LEAST_KILLS:
            shutil.rmtree("killed", ignore_errors=True)
            times, killed, code = {}, 0, -9
            while code == -9:
                seconds = chance.uniform(0.0, most_seconds) if killed < MOST_KILLS else None
                code, output = call(program, "killed", seconds)
                killed += code == -9
                now = times_of("killed")
                assert {path: now[path] for path in times} == times, "a sample was taken twice"
                times = now
            assert code == 0, output
            # The machine may have been busier before.
            most_seconds /= 2.0
        assert sum(counts_of(output)) == SAMPLES, output
        assert files_of("killed") == files_of("whole"), (files_of("killed"), files_of("whole"))
        for name in files_of("whole"):
            if name.startswith(("samples", "oracle")):
                assert len(hash_of(f"whole/{name}")) >= 2, name
                assert hash_of(f"killed/{name}") == hash_of(f"whole/{name}"), name

        code, output = call(program, "killed")
        assert code == 0 and counts_of(output) == (0, SAMPLES), output
        check_terminal(program)


if __name__ == "__main__":
    main()
