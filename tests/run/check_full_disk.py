"""The program on a full disk: check_full_disk.py POLYDEM INPUT.

The disk is a small file system in memory. For every size, the run must end with code 3 and one message, and closed
segments must be readable. The exit code is 77 (skipped) where such a file system cannot be mounted.
"""

import os
import subprocess
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path

#: Exit code of a test that was skipped
SKIPPED = 77

#: Sizes of the disk [kB]: from no room for the log to room for two segments and a part of the third
SIZES = (8, 16, 24, 32, 48, 64, 80, 96, 128, 160, 192)

#: Makes segments of some 60 kB
OVERRIDES = ("output.frame_interval=1e-4", "output.frames_per_segment=50", "integrate.duration=0.05")


@contextmanager
def small_disk(folder, kilobytes):
    """Mount a file system in memory at a folder; return the reason if this fails, else nothing."""
    command = ["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", str(folder)]
    try:
        answer = subprocess.run(command, capture_output=True, text=True, check=False)
        refusal = answer.stderr.strip() if answer.returncode else None
    except FileNotFoundError as error:
        refusal = str(error)
    try:
        yield refusal
    finally:
        if refusal is None:
            subprocess.run(["umount", str(folder)], check=True)


def find_problems(polydem, settings, folder):
    """Run into a folder until its disk is full; return the problem found, and the message."""
    command = [polydem, "run", settings, "--threads", "1", "--set", f"output.folder={folder}"]
    for entry in OVERRIDES:
        command += ["--set", entry]
    end = subprocess.run(command, capture_output=True, text=True, check=False)
    problems = []
    if end.returncode != 3:
        problems.append(f"ended with {end.returncode}, not 3")
    lines = end.stderr.splitlines()
    if len(lines) != 1 or not lines[0].startswith("polydem: ") or str(folder) not in lines[0]:
        problems.append("does not say in one line which file cannot be written")
    for segment in sorted(folder.glob("trajectory_*.h5")):
        told = subprocess.run([polydem, "info", str(segment)], capture_output=True, text=True, check=False)
        if told.returncode != 0 or " 50 of " not in told.stdout:
            problems.append(f"{segment.name} cannot be read")
    return problems, end.stderr


def main():
    polydem, settings = sys.argv[1:3]
    os.environ["OMP_NUM_THREADS"] = "1"
    n_wrong = 0
    n_segments = 0
    with tempfile.TemporaryDirectory() as top:
        for size in SIZES:
            with small_disk(top, size) as refusal:
                if refusal is not None:
                    print(f"skipped, since a file system cannot be mounted: {refusal}")
                    return SKIPPED
                problems, message = find_problems(polydem, settings, Path(top) / "result")
                n_segments = len(list(Path(top).glob("result/trajectory_*.h5")))
            print(f"{size} kB: {n_segments} closed segments; {message.strip()}")
            for problem in problems:
                print(f"{size} kB: {problem}")
            n_wrong += len(problems)
    if n_segments != 2:
        print(f"the largest disk holds {n_segments} segments, not 2: choose other sizes")
    return 1 if n_wrong or n_segments != 2 else 0


if __name__ == "__main__":
    sys.exit(main())
