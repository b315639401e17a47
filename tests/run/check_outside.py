"""The environment of the program: threads, stacks, file size limits, pipes, closed streams, umasks, new folders.

usage: check_outside.py PROGRAM TRACE FAILING_CALLS [--full]

FAILING_CALLS is the library of failing_calls.c, which here only logs calls. The program must never end by a signal or
with a message of a library: it reports each problem in one line of its own, and a reported success is one.
tests/faults.md lists all faults.
With --full every value of every variable of the runtime library is tried alone, otherwise some.
"""

import os
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time

SCENE = """\
&scene name = 'gas' bodies = 60 solid_fraction = 0.8 overlap = .true. speed = 0.5 spin = 20 /
&forces stiffness = 1e6 /
&integrate dt = 1e-5 duration = 6e-4 /
&output frame_interval = 3e-5 frames_per_segment = 15 log_interval = 1e-4 contacts = .true. /
&checkpoint steps = 20 /
"""

BENCH = """\
&bench
   scenes = 'scene.nml integrate.duration=1e-4 output.trace_steps=4'
   names = 'gas'
   finders = 'quadtree'
   threads = 1
   repeats = 1
/
"""

#: Exit codes, as inputs/getting_started.md lists them
GOOD, FAILED, BAD_INPUT, NO_FILE = 0, 1, 2, 3

#: A user without privileges
NOBODY = 65534

UNLIMITED = resource.RLIM_INFINITY


class Case:
    """The program, with that of the laboratory beside it, a trace to replay, and what an undisturbed run prints."""

    def __init__(self, program, trace):
        self.program = program
        self.trace = trace
        code, output, message = self.call("run", "scene.nml", "--set", "output.folder=whole")
        assert (code, message) == (GOOD, ""), message
        self.expected = hash_of(output)

    def call(self, *words, before=None, **streams):
        """Exit code, output and message of a call; its process first executes `before`."""
        environment = {**os.environ, "OMP_WAIT_POLICY": "passive", **streams.pop("env", {})}
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **streams}
        beside = "_lab" if words[0] in ("replay", "bench") else ""
        done = subprocess.run([self.program + beside, *words], env=environment, preexec_fn=before, text=True,
                              errors="replace", timeout=600, check=False, **pipes)
        return done.returncode, done.stdout, done.stderr

    def run_words(self, folder, *options):
        shutil.rmtree(folder, ignore_errors=True)
        return ["run", "scene.nml", "--set", f"output.folder={folder}", *options]

    def calls(self, threads):
        """Command line arguments for each verb."""
        bench = ["bench", "bench.nml", "--set", "bench.folder=bench", "--set", f"bench.threads={threads}"]
        return {"run": ["run", "scene.nml", "--set", "output.folder=result", "--threads", str(threads)],
                "check": ["check", "scene.nml", "--threads", str(threads)],
                "replay": ["replay", self.trace, "--threads", str(threads)],
                "bench": bench, "info": ["info", "whole"], "help": ["--help"], "version": ["--version"]}

    def assert_good(self, folder):
        """Check that a result of the scene is complete."""
        code, output, message = self.call("info", folder)
        assert code == GOOD and self.expected in output, (code, output, message)
        assert sum(int(n) for n in re.findall(r"frames +(\d+) of", output)) == 21, output


def hash_of(output):
    return re.search(r"^state hash: (\S+)$", output, re.MULTILINE).group(1)


def clear():
    for folder in ("result", "bench"):
        shutil.rmtree(folder, ignore_errors=True)


def limit(kind, value):
    return lambda: resource.setrlimit(kind, (value, value))


def assert_one_sentence(code, message, expected, *parts):
    assert code == expected and message.startswith("polydem: ") and message.count("\n") == 1, (code, message)
    for part in parts:
        assert part in message, (part, message)


def too_many_threads_are_refused_before_anything_is_written(case):
    processors = len(os.sched_getaffinity(0))
    for threads in 64*processors + 1, 20000, 100000, 999999:
        for verb in "run", "check", "replay", "bench":
            if verb == "bench" and threads > 9999:
                continue
            code, _, message = case.call(*case.calls(threads)[verb])
            assert_one_sentence(code, message, BAD_INPUT, f"{threads} threads are too many", f"{processors} processors")
        for verb in "run", "check", "bench":
            words = [word for word in case.calls(1)[verb] if word not in ("--threads", "1")]
            code, _, message = case.call(*words, env={"OMP_NUM_THREADS": str(threads)})
            assert_one_sentence(code, message, BAD_INPUT, f"{threads} threads are too many")
    assert not os.path.exists("result") and not os.path.exists("bench")
    # These use none of them.
    for verb in "info", "replay", "help", "version":
        words = [word for word in case.calls(1)[verb] if word not in ("--threads", "1")]
        assert case.call(*words, env={"OMP_NUM_THREADS": "100000"})[0] == GOOD, verb


def threads_that_openmp_or_the_system_do_not_grant_are_refused(case):
    words = ["run", "scene.nml", "--set", "output.folder=result"]
    code, _, message = case.call(*words, "--threads", "3", env={"OMP_THREAD_LIMIT": "2"})
    assert_one_sentence(code, message, BAD_INPUT, "OMP_THREAD_LIMIT allows 2")
    for size in "16k", "63", "20000b":
        code, _, message = case.call(*words, "--threads", "2", env={"OMP_STACKSIZE": size})
        assert_one_sentence(code, message, BAD_INPUT, "OMP_STACKSIZE gives each thread")
    code, _, message = case.call(*words, "--threads", "2", env={"OMP_STACKSIZE": "100000G"})
    assert_one_sentence(code, message, BAD_INPUT, "only 1 of 2 threads can be made", "OMP_STACKSIZE")
    # A process may have 64 threads even on one processor.
    code, _, message = case.call(*words, "--threads", "64", before=limit(resource.RLIMIT_AS, 400_000_000))
    assert_one_sentence(code, message, BAD_INPUT, " of 64 threads can be made", "ulimit -v")
    assert not os.path.exists("result")
    code, output, _ = case.call(*case.run_words("limited"), env={"OMP_THREAD_LIMIT": "1", "OMP_NUM_THREADS": "5"})
    assert code == GOOD and "threads    1 on" in output and hash_of(output) == case.expected, output


def threads_are_chosen_unless_they_are_given(case):
    """Small scenes have one thread, larger ones at most the processors; an option wins over a variable."""
    processors = len(os.sched_getaffinity(0))
    small, large = (["run", "scene.nml", "--force", "--set", "output.folder=result", "--set", "integrate.duration=1e-5",
                     "--set", f"scene.bodies={n}"] for n in (999, 1000))

    def head(words, env):
        code, output, message = case.call(*words, env=env)
        assert code == GOOD and message == "", message
        return re.search(r"^threads +(\d+) on \d+ processors \((.*)\)$", output, re.MULTILINE).groups()

    assert head(small, {}) == ("1", "chosen for fewer than 1000 free bodies per rank")
    threads, reason = head(large, {})
    assert 1 <= int(threads) <= processors and re.fullmatch(
        r"chosen for \d+ granted processors? and \d+ other running tasks?", reason), (threads, reason)
    for words in small, large:
        assert head(words, {"OMP_NUM_THREADS": "3,1"}) == ("3", "given by OMP_NUM_THREADS")
        assert head([*words, "--threads", "2"], {"OMP_NUM_THREADS": "3"}) == ("2", "given by --threads")
    assert head(large, {"OMP_THREAD_LIMIT": "1"})[0] == "1"


def variables_of_the_runtime_change_nothing(case):
    """Every variable of the runtime library of gfortran, with several values."""
    variables = {
        "STDIN_UNIT": ("0", "6", "7", "x"), "STDOUT_UNIT": ("0", "5", "7", "-1"), "STDERR_UNIT": ("5", "6", "7"),
        "UNBUFFERED_ALL": ("y", "n"), "UNBUFFERED_PRECONNECTED": ("y",), "SHOW_LOCUS": ("n",),
        "OPTIONAL_PLUS": ("y", "1"), "LIST_SEPARATOR": ("  ", " , ", ";"), "DEFAULT_RECL": ("8",),
        "CONVERT_UNIT": ("big_endian", "swap", "native;big_endian:10-20", "none"), "ERROR_BACKTRACE": ("n", "y"),
        "FORMATTED_BUFFER_SIZE": ("1", "7", "1000000"), "UNFORMATTED_BUFFER_SIZE": ("1", "7", "1000000")}

    def outputs(env):
        """What the verbs print; without times, memory and load."""
        shutil.rmtree("varied", ignore_errors=True)
        varied = "output.folder=varied"
        printed = []
        for words in (["run", "scene.nml", "--set", varied, "--set", "integrate.duration=3e-4"],
                      ["run", "scene.nml", "--set", varied, "--continue", "--changed"], ["info", "varied", "--check"],
                      ["check", "scene.nml"], ["replay", "trace.h5", "--steps", "2", "--oracle"],
                      ["run", "nothing.nml"], ["check", "scene.nml", "--set", "integrate.dt=-1"]):
            code, output, message = case.call(*words, env=env)
            if words[0] == "run" and code == GOOD:
                output = hash_of(output)
            printed.append((words[0], code, re.sub(r"(?m)^(memory |ns_).*$|\d+\.\d+ (us|s)\b", "", output), message))
        assert printed[1][2] == case.expected, printed[1]
        case.assert_good("varied")
        return printed

    expected = outputs({})
    alone = [(name, value) for name, values in variables.items() for value in values]
    for name, value in alone if "--full" in sys.argv else random.Random(1).sample(alone, 4):
        for found, wanted in zip(outputs({f"GFORTRAN_{name}": value}), expected):
            assert found == wanted, (name, value, found, wanted)
    for k in 0, -1:
        assert outputs({f"GFORTRAN_{name}": values[k] for name, values in variables.items()}) == expected, k


def memory_that_is_not_granted_is_named(case):
    """Limits of the memory, from enough for a few bodies to enough for many."""
    words = ["run", "scene.nml", "--force", "--threads", "1", "--set", "output.folder=result",
             "--set", "integrate.duration=1e-5"]
    size = 20_000_000
    while case.call(*words, before=limit(resource.RLIMIT_AS, size))[0] != GOOD:
        size = size*5//4
    ends = []
    while not ends or ends[-1] != GOOD:
        code, _, message = case.call(*words, "--set", "scene.bodies=50000", before=limit(resource.RLIMIT_AS, size))
        ends.append(code)
        # Libraries of Fortran and HDF5 that get no memory have words of their own, but no crash.
        if code != GOOD and "Memory allocation failed" not in message and code != NO_FILE:
            assert_one_sentence(code, message, FAILED, "there is not enough memory: ", " bytes more ", "ulimit -v")
        size = size*5//4
    assert len(ends) > 2 and FAILED in ends, ends


def threads_that_take_turns_draw_a_warning(case):
    processors = len(os.sched_getaffinity(0))
    for threads in processors, processors + 1, 8*processors:
        told = f"warning: more threads than processors ({threads} on {processors})"
        for verb, words in case.calls(threads).items():
            if verb not in ("run", "check", "replay", "bench"):
                continue
            clear()
            code, output, message = case.call(*words)
            assert code == GOOD, (verb, threads, message)
            place = message if verb == "replay" else output
            assert (told in place) == (threads > processors), (verb, threads, place)
            if verb == "run":
                assert hash_of(output) == case.expected
                with open("result/log.txt", encoding="utf-8") as file:
                    assert (told in file.read()) == (threads > processors)
    one = {min(os.sched_getaffinity(0))}
    code, output, _ = case.call("check", "scene.nml", "--threads", "2", before=lambda: os.sched_setaffinity(0, one))
    assert code == GOOD and "more threads than processors (2 on 1)" in output, output


def a_small_stack_is_refused(case):
    """For all stack sizes, verbs and threads: no crash, and no refusal above the documented size."""
    processors = len(os.sched_getaffinity(0))
    # With less than 20 KiB the system may fail to load the program: arguments, environment and a random offset of up to
    # 8 KiB lie on the same stack.
    for kilobytes in 24, 32, 64, 128, 255, 256, 257, 288, 512, 1024, 8192, None:
        size = UNLIMITED if kilobytes is None else 1024*kilobytes
        for threads in 1, 2, 4, 64*processors:
            for verb, words in case.calls(threads).items():
                # Where nothing is refused each call takes its time.
                few = kilobytes is None or kilobytes >= 256
                if threads > 4 and (verb != "run" or (few and kilobytes != 512)):
                    continue
                if few and kilobytes != 257 and (threads != 2 or verb != "run") and threads <= 4:
                    continue
                if verb in ("help", "version", "info") and threads != 1:
                    continue
                clear()
                code, _, message = case.call(*words, before=limit(resource.RLIMIT_STACK, size))
                needed = 256 + (threads//4 if verb not in ("help", "version", "info") else 0)
                if kilobytes is not None and kilobytes < needed:
                    assert_one_sentence(code, message, BAD_INPUT, f"{kilobytes} KiB only", "ulimit -s")
                    assert not os.path.exists("result") and not os.path.exists("bench")
                else:
                    assert code == GOOD, (kilobytes, threads, verb, code, message)


def files_that_may_not_grow_are_named(case):
    """Limits of the file size, from zero to sufficient."""
    ends = set()
    for blocks in 0, 1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 4096:
        size = 1024*blocks
        for verb in "run", "bench", "check", "replay", "info":
            if verb == "bench" and blocks not in (0, 1, 8, 512, 4096):
                continue
            clear()
            code, output, message = case.call(*case.calls(1)[verb], before=limit(resource.RLIMIT_FSIZE, size))
            ends.add((verb, code))
            if code == GOOD:
                assert message == "", message
                if verb == "run":
                    assert hash_of(output) == case.expected
                    case.assert_good("result")
                continue
            assert verb in ("run", "bench"), (verb, blocks, code, message)
            assert_one_sentence(code, message, NO_FILE, "result/" if verb == "run" else "bench/")
            if verb == "run":
                assert not os.path.exists("result/running.lock")
                for name in os.listdir("result"):
                    if name.startswith("trajectory") and name.endswith(".h5"):
                        # Those before a checkpoint
                        assert " 7 of " in case.call("info", f"result/{name}")[1], name
                # What is left is continued, or begun again.
                code, output, message = case.call("run", "scene.nml", "--set", "output.folder=result", "--continue")
                assert code == GOOD and hash_of(output) == case.expected, (blocks, message)
                case.assert_good("result")
    assert {("run", GOOD), ("run", NO_FILE), ("bench", GOOD), ("bench", NO_FILE)} <= ends, ends
    # The output may also go to a file.
    for verb in "check", "replay", "info", "help", "version":
        with open("screen", "wb") as screen:
            code, _, message = case.call(*case.calls(1)[verb], stdout=screen, before=limit(resource.RLIMIT_FSIZE, 0))
        assert_one_sentence(code, message, NO_FILE, "standard output: cannot be written: File too large")


def nobody_need_read_what_is_printed(case):
    """Pipes whose readers have ended, for output, for messages, for both."""
    for closed in ("stdout",), ("stderr",), ("stdout", "stderr"):
        for verb, words in case.calls(1).items():
            clear()
            reader, writer = os.pipe()
            os.close(reader)
            code, _, message = case.call(*words, **dict.fromkeys(closed, writer))
            os.close(writer)
            assert code == GOOD and not message, (closed, verb, code, message)
            if verb == "run":
                case.assert_good("result")
                with open("result/log.txt", encoding="utf-8") as file:
                    assert hash_of(file.read()) == case.expected
        reader, writer = os.pipe()
        os.close(reader)
        code, _, _ = case.call("run", "nothing.nml", **dict.fromkeys(closed, writer))
        os.close(writer)
        assert code == BAD_INPUT, code
    # A reader who stops after the first line.
    line = subprocess.run(f"{{ '{case.program}' {' '.join(case.run_words('headed'))}; echo $? >code; }} | head -n 1",
                          shell=True, capture_output=True, text=True, check=True)
    assert line.stdout.startswith("polydem") and line.stderr == "", line
    with open("code", encoding="utf-8") as file:
        assert file.read() == "0\n"
    case.assert_good("headed")


def closed_streams_leave_files_alone(case):
    """All combinations of closed standard input, output and error."""
    def close(descriptors):
        for descriptor in descriptors:
            os.close(descriptor)

    for k in range(8):
        closed = [descriptor for descriptor in range(3) if k & 1 << descriptor]
        for verb, words in case.calls(min(2, len(os.sched_getaffinity(0)))).items():
            if verb == "bench" and k not in (2, 7):
                continue
            clear()
            code, output, message = case.call(*words, before=lambda: close(closed))
            assert code == GOOD and message == "", (closed, verb, code, message)
            assert (output == "") == (1 in closed), (closed, verb, output)
            if verb != "run":
                continue
            case.assert_good("result")
            assert not os.path.exists("result/running.lock")
            with open("result/log.txt", encoding="utf-8") as file:
                lines = file.read().splitlines()
            assert lines[0].startswith("polydem ") and sum(line.startswith("state hash") for line in lines) == 1, lines
            for name in os.listdir("result"):
                if name.endswith(".h5"):
                    with open(f"result/{name}", "rb") as file:
                        head = file.read(8)
                    assert head in (b"\x89HDF\r\n\x1a\n", b"polydem ") or name.startswith("checkpoint"), (name, head)
        code, _, message = case.call("fly", before=lambda: close(closed))
        assert code == BAD_INPUT and ("unknown verb" in message) == (2 not in closed), (closed, code, message)


def a_umask_that_takes_ones_own_rights_is_refused(case):
    """Run as a user without privileges, since a umask does not restrict root."""
    if os.getuid() != 0:
        user = lambda: None
    else:
        def user():
            os.setgroups([])
            os.setgid(NOBODY)
            os.setuid(NOBODY)
    here = os.getcwd()
    os.chmod(here, 0o755)
    copy = os.path.join(here, "copy_of_polydem")
    for beside in "", "_lab":
        shutil.copy(case.program + beside, copy + beside)
        os.chmod(copy + beside, 0o755)
    other = Case.__new__(Case)
    other.program, other.trace, other.expected = copy, case.trace, case.expected
    for mask in 0o777, 0o100, 0o200, 0o300, 0o400, 0o500, 0o600, 0o700, 0o277, 0o077, 0o022, 0o000:
        folder = f"umask_{mask:o}"
        os.mkdir(folder)
        os.chmod(folder, 0o777)
        os.mkdir(f"{folder}/made")
        os.chmod(f"{folder}/made", 0o777)
        for target in "made", "new", "new/below":
            def before():
                user()
                os.umask(mask)
            words = ["run", "scene.nml", "--force", "--set", f"output.folder={folder}/{target}", "--threads", "1"]
            code, output, message = other.call(*words, before=before)
            if mask & 0o700:
                assert_one_sentence(code, message, NO_FILE, f"{folder}/{target}", f"umask 0{mask:o} ")
                assert os.listdir(folder) == ["made"] and os.listdir(f"{folder}/made") == []
            else:
                assert code == GOOD and hash_of(output) == case.expected, (mask, message)
        if mask not in (0o777, 0o300, 0o022):
            continue
        code, _, message = other.call("bench", "bench.nml", "--set", f"bench.folder={folder}/bench", before=before)
        if mask & 0o700:
            assert_one_sentence(code, message, NO_FILE, f"umask 0{mask:o} ")
            assert os.listdir(folder) == ["made"]
        else:
            assert code == GOOD, message


def the_parents_of_new_folders_are_brought_to_disk(case, library):
    here = os.path.realpath(".")
    environment = {"LD_PRELOAD": library, "POLYDEM_FAIL_FOLDER": here,
                   "POLYDEM_FAIL_LOG": os.path.join(here, "watched")}
    os.makedirs("above", exist_ok=True)
    for folder in "above/one/two", "alone", os.path.join(here, "above/three"):
        if os.path.exists("watched"):
            os.remove("watched")
        code, _, message = case.call(*case.run_words(folder), env=environment)
        assert code == GOOD, message
        with open("watched", encoding="utf-8") as file:
            lines = [line.split(" ", 1)[1] for line in file.read().splitlines()]
        lines = [line for line in lines if line.startswith(("mkdir ", "fsync "))]
        made = [k for k, line in enumerate(lines) if line.startswith("mkdir ")]
        assert len(made) == (2 if folder == "above/one/two" else 1), lines
        for k in made:
            parent = os.path.dirname(lines[k].split(" ", 1)[1])
            assert lines[k + 1] == f"fsync {parent}", (folder, lines[k:k + 2])


def pipes_are_refused_without_waiting_for_them(case):
    """To open a pipe waits until somebody writes to it."""
    os.mkfifo("pipe")
    for text in ("&motion name = 'lift' wall = 'floor' kind = 'table' file = 'pipe' /\n"
                 "&grains name = 'sand' region = 'box' low = 0, 1 high = 1, 2 number = 5 arrangement = 'spread' /\n",
                 "&grains name = 'sand' region = 'box' low = 0, 1 high = 1, 2 number = 5 arrangement = 'spread' "
                 "shape = 'outline' outlines = 'pipe' /\n"):
        with open("piped.nml", "w", encoding="utf-8") as file:
            file.write("&wall name = 'floor' outline = 'rectangle' low = 0, 0 high = 1, 0.1 /\n" + text +
                       "&integrate duration = 1e-3 /\n")
        code, _, message = case.call("check", "piped.nml")
        assert_one_sentence(code, message, BAD_INPUT, "pipe or a device")
    for name in sorted(os.listdir("whole")):
        shutil.rmtree("piped", ignore_errors=True)
        shutil.copytree("whole", "piped")
        os.remove(f"piped/{name}")
        os.mkfifo(f"piped/{name}")
        for words in (["run", "scene.nml", "--set", "output.folder=piped", "--continue"], ["info", "piped", "--check"],
                      ["info", "piped"]):
            code, output, message = case.call(*words)
            if code == GOOD:
                # The older checkpoint is good, or the file is not read.
                assert words[0] == "info" or hash_of(output) == case.expected, (name, output)
            else:
                assert code in (BAD_INPUT, NO_FILE), (name, words, code, message)
                assert "pipe or a device" in message + output, (name, words, message, output)
    shutil.rmtree("piped")


def closed_files_are_brought_to_disk(case, library):
    here = os.path.realpath(".")
    environment = {"LD_PRELOAD": library, "POLYDEM_FAIL_FOLDER": here,
                   "POLYDEM_FAIL_LOG": os.path.join(here, "written")}
    with open("tables.nml", "w", encoding="utf-8") as file:
        file.write("&scene name = 'gas' bodies = 6 solid_fraction = 0.8 overlap = .true. speed = 0.5 spin = 20 /\n"
                   "&forces stiffness = 1e6 /\n&integrate dt = 1e-5 duration = 1e-4 /\n&guards listed_depth = 1e-9 /\n"
                   "&output series_interval = 2e-5 csv = .true. trace_steps = 2 step_profile = .true. /\n")
    words = ("run", "tables.nml", "--threads", "1", "--set", "output.folder=tables")
    code, _, message = case.call(*words, env=environment)
    assert code == GOOD, message
    with open("tables/manifest.txt", encoding="utf-8") as file:
        closed = re.findall(r"^(\S+) +closed", file.read(), re.MULTILINE)
    assert {"series.csv", "overlaps.csv", "profile.h5", "trace.h5", "steps.h5", "trajectory_0001.h5"} == {*closed}
    with open("written", encoding="utf-8") as file:
        calls = [line.split(" ", 2)[1:] for line in file.read().splitlines()]
    for name in closed:
        verbs = [verb for verb, path in calls if path.startswith(os.path.join(here, "tables", name))]
        assert "fsync" in verbs, (name, verbs)
        last = max(k for k, verb in enumerate(verbs) if "write" in verb)
        assert "fsync" in verbs[last:], (name, verbs)


TESTS = (too_many_threads_are_refused_before_anything_is_written,
         threads_that_openmp_or_the_system_do_not_grant_are_refused, threads_are_chosen_unless_they_are_given,
         variables_of_the_runtime_change_nothing, memory_that_is_not_granted_is_named,
         threads_that_take_turns_draw_a_warning, a_small_stack_is_refused, files_that_may_not_grow_are_named,
         nobody_need_read_what_is_printed, closed_streams_leave_files_alone,
         a_umask_that_takes_ones_own_rights_is_refused, pipes_are_refused_without_waiting_for_them)


def main():
    program, trace, library = (os.path.abspath(word) for word in sys.argv[1:4])
    for name in [name for name in os.environ if name.startswith(("OMP_", "GOMP_"))]:
        del os.environ[name]
    with tempfile.TemporaryDirectory() as work:
        os.chdir(work)
        shutil.copy(trace, "trace.h5")
        for name, text in (("scene.nml", SCENE), ("bench.nml", BENCH)):
            with open(name, "w", encoding="utf-8") as file:
                file.write(text)
        case = Case(program, "trace.h5")
        watched = (the_parents_of_new_folders_are_brought_to_disk, closed_files_are_brought_to_disk)
        for test in (*TESTS, *watched):
            began = time.monotonic()
            test(case, *([library] if test in watched else []))
            clear()
            print(f"{test.__name__.replace('_', ' ')}: {time.monotonic() - began:.1f} s", flush=True)


if __name__ == "__main__":
    main()
