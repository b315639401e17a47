"""Faults of the system around a run: wrong dates, files that cannot be locked or written.

usage: check_faults.py PROGRAM HOSTILE_SYSTEM

HOSTILE_SYSTEM is the library of hostile_system.c. tests/faults.md lists all faults; those of the other d20 tests are
not repeated here.
"""

import contextlib
import datetime
import fcntl
import os
import re
import shutil
import subprocess
import time

from check_continue import EARLY, NO_FILE, checkpoints_of, least_seconds, run_all
from continued_run import closed_segments, totals_of


@contextlib.contextmanager
def environment(**names):
    """Set environment variables within a context."""
    before = {name: os.environ.get(name) for name in names}
    os.environ.update(names)
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


def a_date_that_goes_back_changes_nothing(case, library):
    with environment(LD_PRELOAD=library, POLYDEM_HOSTILE="date"):
        def run_limited():
            began = time.monotonic()
            code, output, message = case.run("date", "--force", "--walltime", "00:00:02", "--set", "checkpoint.steps=0",
                                             "--set", "integrate.duration=100", "--set", "checkpoint.wall_interval=0.5")
            seconds = time.monotonic() - began
            assert code == EARLY and "interrupted by --walltime" in message, (code, message)
            assert seconds > 1.0, seconds
            told = re.search(r"^started +(\S+)$", output, re.MULTILINE).group(1)
            then = datetime.datetime.fromisoformat(told.replace("Z", "+00:00"))
            lag = datetime.datetime.now(datetime.timezone.utc) - then
            assert lag > datetime.timedelta(days=1), (told, lag)
            n_written = int(re.search(r"^checkpoints: (\d+)", output, re.MULTILINE).group(1))
            assert 2 <= n_written <= 2 + seconds / 0.5, (n_written, seconds)

        assert least_seconds(4.0, run_limited) < 4.0
        case.interrupt("back")
        case.finish("back")


def where_nothing_can_be_locked_the_way_out_is_told(case, library):
    with environment(LD_PRELOAD=library, POLYDEM_HOSTILE="locks", HDF5_USE_FILE_LOCKING="TRUE"):
        code, _, message = case.run("unlocked")
        assert code == NO_FILE and "HDF5_USE_FILE_LOCKING=FALSE" in message, (code, message)
    with environment(LD_PRELOAD=library, POLYDEM_HOSTILE="locks", HDF5_USE_FILE_LOCKING="FALSE"):
        case.finish("unlocked")


def a_file_that_another_program_holds_does_no_harm(case, _):
    case.interrupt("held")
    with environment(HDF5_USE_FILE_LOCKING="TRUE"):
        for path in max(checkpoints_of("held")), max(closed_segments("held")):
            shutil.rmtree("copy", ignore_errors=True)
            shutil.copytree("held", "copy")
            with open(f"copy/{os.path.basename(path)}", "rb") as file:
                fcntl.flock(file, fcntl.LOCK_EX)
                code, output, message = case.run("copy", "--continue")
            assert code == 0 and totals_of(output) == case.expected, (path, code, output, message)


def a_folder_that_may_only_be_read_stays_as_it_is(case, _):
    os.makedirs("disk", exist_ok=True)
    if subprocess.run(["mount", "-t", "tmpfs", "tmpfs", "disk"], capture_output=True, check=False).returncode != 0:
        print("  skipped: no file system may be mounted here")
        return
    try:
        case.interrupt("disk/result")
        subprocess.run(["mount", "-o", "remount,ro", "disk"], check=True)
        before = closed_segments("disk/result")
        for options in ("--continue",), ("--force",):
            code, _, message = case.run("disk/result", *options)
            assert code == NO_FILE and "disk/result" in message, (code, message)
        assert closed_segments("disk/result") == before
        subprocess.run(["mount", "-o", "remount,rw", "disk"], check=True)
        case.finish("disk/result")
    finally:
        subprocess.run(["umount", "disk"], check=True)


def checkpoints_that_may_only_be_read_are_replaced(case, _):
    case.interrupt("protected")
    for path in checkpoints_of("protected"):
        os.chmod(path, 0o444)
    case.finish("protected")


TESTS = (a_date_that_goes_back_changes_nothing, where_nothing_can_be_locked_the_way_out_is_told,
         a_file_that_another_program_holds_does_no_harm, a_folder_that_may_only_be_read_stays_as_it_is,
         checkpoints_that_may_only_be_read_are_replaced)


if __name__ == "__main__":
    run_all(TESTS)
