"""Runs that need the folder of another run, which is alive, dead, stopped, or on another machine.

usage: check_lock.py PROGRAM CONTENDED_SYSTEM

CONTENDED_SYSTEM is the library of contended_system.c, with which no file can be locked.
"""

import contextlib
import os
import re
import shutil
import signal
import subprocess

from check_continue import BAD_INPUT, EARLY, MOST_ATTEMPTS, run_all, wait_for
from check_faults import environment
from continued_run import start

#: Options of a run that does not end by itself
ENDLESS = ("--set", "integrate.duration=100", "--set", "checkpoint.steps=0", "--set", "checkpoint.wall_interval=0.2",
           "--set", "output.frame_interval=1", "--set", "output.contacts=.false.")


def lock_of(folder):
    """Path of the lock of a folder."""
    return os.path.join(folder, "running.lock")


def read(path):
    """Text of a file; empty if it is not there."""
    with contextlib.suppress(FileNotFoundError):
        with open(path, encoding="utf-8") as file:
            return file.read()
    return ""


def words_of(process, host, kernel):
    """Text of a lock as a run leaves it"""
    return f"{process} {host}\nsince then\nkernel {kernel}\n"


def write(folder, words):
    """Write a lock as another process leaves it."""
    with open(lock_of(folder), "w", encoding="utf-8") as file:
        file.write(words)


@contextlib.contextmanager
def held(case, folder, *options):
    """A run that does not end by itself, after its first checkpoint; the context always ends it."""
    with start(case.program, folder, *ENDLESS, *options) as process:
        try:
            wait_for(lambda: os.path.exists(os.path.join(folder, "checkpoint_1.h5")))
            yield process
        finally:
            process.kill()


def end(process):
    """End a run that holds a folder, with a checkpoint."""
    process.send_signal(signal.SIGTERM)
    _, message = process.communicate(timeout=600)
    assert process.returncode == EARLY, message


def assert_refused(case, folder, process):
    """Check that no other run may continue or overwrite a live run, and that the message names its process."""
    for options in ("--continue",), ("--force",):
        code, _, message = case.run(folder, *options)
        assert code == BAD_INPUT, (code, message)
        assert f"another run (process {process}" in message and "choose another folder" in message, message


def a_living_run_keeps_others_out_also_when_it_stands_still(case, _):
    with held(case, "living") as process:
        assert_refused(case, "living", process.pid)
        process.send_signal(signal.SIGSTOP)
        assert_refused(case, "living", process.pid)
        process.send_signal(signal.SIGCONT)
        end(process)
    assert not os.path.exists(lock_of("living"))


def a_killed_run_keeps_nobody_out(case, _):
    # The test waits for the dead process only after the next run, so it stays a zombie until then.
    for _ in range(MOST_ATTEMPTS):
        with start(case.program, "killed") as process:
            wait_for(lambda: os.path.exists("killed/checkpoint_2.h5"))
            process.kill()
            end = os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
            if end.si_code == os.CLD_KILLED:
                assert f"of process {process.pid}, which has ended" in case.finish("killed")
                return
        # On a busy machine the run may come to its end before the signal does.
        shutil.rmtree("killed")
    raise AssertionError("every run ended before the signal came")


def a_process_number_that_another_one_has_now_keeps_nobody_out(case, _):
    with open("/proc/sys/kernel/random/boot_id", encoding="utf-8") as file:
        kernel = file.read().strip()
    host = os.uname().nodename
    with held(case, "other") as other:
        for words in words_of(1, host, kernel), words_of(other.pid, host, kernel), f"{os.getpid()} {host}\n":
            case.interrupt("reused")
            write("reused", words)
            assert f"of process {words.split()[0]}, which has ended" in case.finish("reused")
            shutil.rmtree("reused")


def processes_of_other_namespaces_keep_each_other_out(case, _):
    command = ["unshare", "--pid", "--fork", "--kill-child"]
    if subprocess.run([*command, "true"], capture_output=True, check=False).returncode != 0:
        print("  skipped: no namespace of process numbers may be made here")
        return
    options = ["run", "scene.nml", "--set", "output.folder=spaces", *ENDLESS]
    with subprocess.Popen([*command, case.program, *options], stdout=subprocess.DEVNULL) as holder:
        try:
            wait_for(lambda: os.path.exists("spaces/checkpoint_1.h5"))
            assert read(lock_of("spaces")).startswith("1 "), "the process has the number 1"
            code, _, message = case.run("spaces", "--continue")
            assert code == BAD_INPUT and "another run (process 1)" in message, (code, message)
            inside = subprocess.run([*command, case.program, *options, "--continue"], capture_output=True, text=True,
                                    timeout=600, check=False)
            assert inside.returncode == BAD_INPUT and "another run (process 1)" in inside.stderr, inside
        finally:
            holder.kill()
    code, output, message = case.run("spaces", *ENDLESS, "--continue", "--walltime", "00:00:02")
    assert code == EARLY and "took over spaces/running.lock of process 1, which has ended" in output, (output, message)


def assert_refused_by_file(case, folder, owner):
    """Check that a lock keeps runs out, and that the message says what to do."""
    for options in ("--continue",), ("--force",):
        code, _, message = case.run(folder, *options)
        assert code == BAD_INPUT and f"another run ({owner}) may write to this folder" in message, (code, message)
        assert f"if it has ended, remove {lock_of(folder)} and run again" in message, message


def a_lock_of_another_machine_keeps_runs_out_until_it_is_removed(case, _):
    case.interrupt("far")
    write("far", words_of(4711, "far.away", "another-kernel"))
    assert_refused_by_file(case, "far", "process 4711 on the machine far.away")
    os.remove(lock_of("far"))
    case.finish("far")


def where_nothing_can_be_locked_a_lock_stays_until_it_is_removed(case, library):
    with environment(LD_PRELOAD=library, POLYDEM_HOSTILE="locks", HDF5_USE_FILE_LOCKING="FALSE"):
        with held(case, "unlocked") as process:
            assert_refused_by_file(case, "unlocked", f"process {process.pid}")
        assert_refused_by_file(case, "unlocked", f"process {process.pid}")
        os.remove(lock_of("unlocked"))
        code, _, message = case.run("unlocked", *ENDLESS, "--continue", "--walltime", "00:00:02")
        assert code == EARLY and not os.path.exists(lock_of("unlocked")), (code, message)


def target_of(link):
    """What a link of /proc points to; empty if the descriptor has been closed since it was listed."""
    try:
        return os.readlink(link)
    except FileNotFoundError:
        return ""


def no_other_program_gets_the_descriptor(case, _):
    with held(case, "closed") as process:
        flags = [re.search(r"^flags:\s*(\d+)", read(f"/proc/{process.pid}/fdinfo/{name}"), re.MULTILINE).group(1)
                 for name in os.listdir(f"/proc/{process.pid}/fd")
                 if target_of(f"/proc/{process.pid}/fd/{name}").endswith("running.lock")]
        assert len(flags) == 1 and int(flags[0], 8) & os.O_CLOEXEC, flags
        end(process)


def what_a_run_leaves_that_dies_in_its_last_checkpoint_goes(case, _):
    case.finish("ended")
    left = [os.path.join("ended", name) for name in ("running.lock", "checkpoint_1.h5.unfinished")]
    mine = os.path.join("ended", "mine.unfinished")
    for path in (left[1], mine):
        with open(path, "w", encoding="utf-8") as file:
            file.write("begun")
    # The run may still live on another machine.
    write("ended", words_of(1, "elsewhere", "another"))
    code, _, message = case.run("ended", "--continue")
    assert code == BAD_INPUT and all(map(os.path.exists, left)), (code, message)
    with open("/proc/sys/kernel/random/boot_id", encoding="utf-8") as file:
        write("ended", words_of(1, os.uname().nodename, file.read().strip()))
    code, output, message = case.run("ended", "--continue")
    assert code == 0 and "nothing to do" in output and not any(map(os.path.exists, left)), (output, message)
    assert os.path.exists(mine)


TESTS = (a_living_run_keeps_others_out_also_when_it_stands_still, a_killed_run_keeps_nobody_out,
         a_process_number_that_another_one_has_now_keeps_nobody_out, processes_of_other_namespaces_keep_each_other_out,
         a_lock_of_another_machine_keeps_runs_out_until_it_is_removed,
         where_nothing_can_be_locked_a_lock_stays_until_it_is_removed, no_other_program_gets_the_descriptor,
         what_a_run_leaves_that_dies_in_its_last_checkpoint_goes)


if __name__ == "__main__":
    run_all(TESTS)
