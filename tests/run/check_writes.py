"""Each write call of a small run to its result folder fails once, and the run restarts afterwards.

usage: check_writes.py PROGRAM LIBRARY [--ranks R] [--full] [--part K/N] [--how HOW] [--error NUMBER] [--memory FILE]

PROGRAM is the one without MPI, LIBRARY that of failing_calls.c. With --ranks, the run in which a call fails is one of
R processes of the program that POLYDEM_MPI_PROGRAM names, and it happens to each rank in turn; without that variable
the test is skipped (code 77). A run without a failure counts the calls. After a failed call

* the run ends, within a minute or two on a busy machine, with code 3 and a message that names a file of its folder, and
  the rank if several processes write that file; or the call does not matter, and the result is complete;
* every checkpoint with its final name is valid;
* --continue ends with the hash, frames and contacts of an undisturbed run, and leaves no unfinished file.

By default the first and the last call of each kind are tried (of ranks see `sample`), so that no verdict depends on how
many calls the libraries of a machine make. --full tries all calls, with --part the K-th of N parts of them. HOW is that
of failing_calls.c, once by default. --memory names a file of calls that passed, which are not tried again by the same
programs.
"""

import argparse
import contextlib
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: Frames with contacts in several segments, and a checkpoint after each step
SCENE = """\
&scene name = 'stack' bodies = 9 width = 0.01 height = 0.01 /
&forces stiffness = 1e5 midstep_slip = .true. tilt_damping = 0.5 /
&integrate dt = 1e-5 duration = {duration} /
&output frame_interval = 1e-5 frames_per_segment = 2 contacts = .true. /
&checkpoint steps = 1 /
"""
#: Exit codes: of a test that is skipped, and of a run that could not write a file
SKIPPED, NO_FILE = 77, 3
#: Time within which a run must have ended [s]; the message comes at once, but machines may be busy or stand still
PATIENCE = 600.0
#: How long ranks wait for each other where nobody knows that a call has failed [s]
WAITING = "5"
#: Steps: without ranks, so many that the oldest checkpoint is replaced
STEPS, STEPS_OF_RANKS = 4, 3
#: Calls whose failure may be of no consequence: nothing is lost by them that was not brought to disk before, or HDF5 or
#: another rank does the same again. The result is compared all the same.
HARMLESS = {"close", "unlink", "link", "symlink", "open", "fallocate", "ftruncate"}


class Broken(Exception):
    """A violated requirement."""


class Case:
    """The programs, how to start them, and the expected output of an undisturbed run."""

    def __init__(self, program, library, ranks, how, error):
        self.program, self.library = program, library
        self.ranks, self.how, self.error = ranks, how, error
        self.work = Path.cwd()
        duration = f"{STEPS_OF_RANKS if ranks else STEPS}e-5"
        self.work.joinpath("scene.nml").write_text(SCENE.format(duration=duration), encoding="utf-8")
        code, output, message, _ = self.run("whole")
        if code != 0:
            raise Broken(message)
        self.hash, self.frames = hash_of(output), frames("whole")

    def run(self, folder, *options, ranks=None, **environment):
        """Run the scene; return exit code, standard output, standard error and seconds."""
        command = [*MPIRUN, "-n", str(ranks), os.environ["POLYDEM_MPI_PROGRAM"]] if ranks else [self.program]
        command += ["run", "scene.nml", "--threads", "1", "--set", f"output.folder={folder}", *options]
        began = time.monotonic()
        return *execute(command, {**SURROUNDINGS, **environment}), time.monotonic() - began

    def watched(self, folder, rank, **environment):
        """Run it with the library in front, which counts or fails calls of a rank; give what `run` does and its log."""
        log = self.work / f"{folder}.calls"
        log.unlink(missing_ok=True)
        told = self.run(folder, ranks=self.ranks, LD_PRELOAD=self.library, POLYDEM_FAIL_FOLDER=str(self.work / folder),
                        POLYDEM_FAIL_RANK=str(rank), POLYDEM_FAIL_LOG=str(log), **environment)
        lines = log.read_text(encoding="utf-8").splitlines() if log.exists() else []
        return told, [Call(rank, *line.split(" ", 2)) for line in lines]

    def count(self, rank):
        """All calls of a rank in a run in which none fails."""
        (code, output, message, _), calls = self.watched(f"counted_{rank}", rank)
        if code != 0 or hash_of(output) != self.hash or not calls:
            raise Broken(f"the run in which nothing fails: code {code}, {len(calls)} calls\n{message}")
        return calls

    def attempt(self, call):
        """Let a call fail, and go on; give what happened, in a word, and the seconds it took to end."""
        folder = f"failed_{call.rank}_{call.number}"
        (code, output, message, seconds), calls = self.watched(
            folder, call.rank, POLYDEM_FAIL_CALL=str(call.number), POLYDEM_FAIL_HOW=self.how,
            POLYDEM_FAIL_ERROR=str(self.error), POLYDEM_PATIENCE=WAITING)
        met = [other for other in calls if other.number == call.number]
        said = f"code {code}\n{message}"
        if not met and (code != 0 or call.number <= len(calls)):
            raise Broken(f"it is not reached: {said}")
        if code == 0:
            if met and self.how != "short" and met[0].name not in HARMLESS:
                raise Broken(f"it goes unnoticed: {said}")
            if hash_of(output) != self.hash or frames(folder) != self.frames:
                raise Broken(f"the result is wrong, without a word: {said}")
        else:
            self.check_message(code, message, met[0])
        for path in Path(folder).glob("checkpoint_?.h5"):
            if not is_sealed(path):
                raise Broken(f"{path} is damaged: {said}")
        again, output, late = self.go_on(folder)
        if again != 0:
            raise Broken(f"cannot be continued, code {again}:\n{late}\nafter {said}")
        if hash_of(output) != self.hash or frames(folder) != self.frames:
            raise Broken(f"the continued result is wrong, after {said}")
        # If nothing could be removed any more, the lock of the dead run stays where a finished result needs none.
        rest = [name for name in os.listdir(folder) if name.endswith((".open", ".unfinished"))
                or (name.endswith(".lock") and self.how != "on")]
        if rest and code != 0:
            raise Broken(f"{rest} are left after {said}")
        shutil.rmtree(folder)
        # Runs differ by a few lines of the log.
        return ("told" if code != 0 else "harmless" if met else "not reached"), seconds

    def go_on(self, folder):
        """Continue a run; mpirun may end a moment before its ranks."""
        for _ in range(100):
            code, output, message, _ = self.run(folder, "--continue")
            if "another run (process" not in message:
                break
            time.sleep(0.1)
        unsigned = re.search(r"If there is no such run, remove '(\S+)'", message)
        if unsigned and self.how == "on":
            # The lock could neither be signed nor removed: the message says what to do.
            os.remove(unsigned.group(1))
            code, output, message, _ = self.run(folder, "--continue")
        return code, output, message

    def check_message(self, code, message, call):
        """The run has said what failed, and on which rank if several processes write the file."""
        said = [line for line in message.splitlines() if line.startswith("polydem: ")]
        if code != NO_FILE or not said:
            raise Broken(f"code {code}, and no word of it:\n{message}")
        if not any("failed" in line for line in said):
            raise Broken(f"the message names no file:\n{message}")
        # Where none comes back from a call of MPI, the first one to say so need not be the one that failed.
        rank = r"\d" if call.name == "open" else str(call.rank)
        if call.rank > 0 and not any(re.search(f"rank {rank}", line) for line in said):
            raise Broken(f"the message does not name the rank:\n{message}")


def execute(command, environment, folder=None):
    """Run a command to its end in a folder; return exit code, standard output, standard error."""
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          errors="replace", env=environment, cwd=folder, start_new_session=True) as process:
        try:
            output, message = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired as late:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
            raise Broken(f"hangs: not ended after {PATIENCE:.0f} s") from late
    return process.returncode, output, message


class Call:
    """A call of a rank: number, name and path."""

    def __init__(self, rank, number, name, path):
        self.rank, self.number, self.name, self.path = int(rank), int(number), name, os.path.basename(path)

    def kind(self):
        """Rank, name, and kind of file"""
        return self.rank, self.name, re.sub(r"\d+", "N", self.path)

    def __str__(self):
        return f"rank {self.rank}, call {self.number}: {self.name} of {self.path}"


def hash_of(output):
    """The hash that a run prints at its end; empty if there is none"""
    found = re.findall(r"^state hash: (\S+)", output, re.MULTILINE)
    return found[-1] if found else ""


def is_sealed(path):
    """Whether the checksum of a checkpoint is correct."""
    before = path.read_bytes()
    seal(path)
    return path.read_bytes() == before


def sample(calls, known=()):
    """The first and the last call of each kind that is not known; of ranks the first of a kind that all of them have.

    What one rank does alone, one process does, too.
    """
    first, last, ranks = {}, {}, {}
    for call in calls:
        first.setdefault(call.kind(), call)
        last[call.kind()] = call
        ranks.setdefault(call.kind()[1:], set()).add(call.rank)
    n = max((len(having) for having in ranks.values()), default=1)
    chosen = [*first.values(), *([] if n > 1 else last.values())]
    return [call for call in calls if call in chosen and call.kind() not in known and len(ranks[call.kind()[1:]]) == n]


class Memory:
    """Calls that passed, in a file of one line each, as long as the programs are the same."""

    def __init__(self, path, words):
        self.path, self.passed = path, {}
        self.key = hashlib.sha256(b"".join(Path(word).read_bytes() for word in words)).hexdigest()[:16]
        if path and os.path.exists(path):
            with open(path, encoding="utf-8") as file:
                lines = [json.loads(line) for line in file if line.endswith("\n")]
            self.passed = {tuple(line["point"]): line for line in lines if line["key"] == self.key}

    def keep(self, point, outcome, seconds):
        self.passed[point] = {"key": self.key, "point": point, "outcome": outcome, "seconds": round(seconds, 2)}
        if self.path:
            with open(self.path, "a", encoding="utf-8") as file:
                file.write(json.dumps(self.passed[point]) + "\n")


def attempts(case, points, ranks, memory):
    """Let each of these calls fail; give it with what happened and the seconds, or with nothing if that was wrong."""
    # Ranks mostly wait for each other.
    with ThreadPoolExecutor(4) as pool:
        begun = {point: pool.submit(case.attempt, call) for point, call in points.items()
                 if ranks and point not in memory.passed}
        for point, call in points.items():
            try:
                if point not in memory.passed:
                    memory.keep(point, *(begun[point].result() if ranks else case.attempt(call)))
                yield call, memory.passed[point]["outcome"], memory.passed[point]["seconds"]
            except Broken as problem:
                print(f"{call}: {problem}", flush=True)
                yield call, None, 0.0


def try_calls(case, options, memory):
    """Let calls fail; give those that went wrong."""
    calls = [call for rank in range(options.ranks or 1) for call in case.count(rank)]
    part, parts = (int(word) for word in options.part.split("/"))
    print(f"calls that write, by rank: {dict(Counter(call.rank for call in calls))}; "
          f"{len({call.kind() for call in calls})} kinds", flush=True)
    broken, outcomes, longest = [], Counter(), 0.0
    points = {(options.ranks, options.how, options.error, call.rank, call.number): call
              for call in (calls if options.full else sample(calls))[part - 1::parts]}
    for call, outcome, seconds in attempts(case, points, options.ranks, memory):
        if not outcome:
            broken.append(call)
            continue
        outcomes[call.rank, outcome] += 1
        longest = max(longest, seconds)
    for (rank, outcome), n in sorted(outcomes.items()):
        print(f"rank {rank}: {n} {outcome}")
    print(f"{sum(outcomes.values())} of {len(calls)} calls passed ({options.how}, error {options.error}), the longest "
          f"took {longest:.1f} s to end; {len(broken)} did not")
    return broken


def parse(words, purpose):
    """Options of a test, whose purpose is the first line of a text."""
    parser = argparse.ArgumentParser(description=purpose.splitlines()[0])
    parser.add_argument("program", type=os.path.abspath)
    parser.add_argument("library", type=os.path.abspath)
    parser.add_argument("--ranks", type=int, default=0)
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--verbs")
    parser.add_argument("--part", default="1/1")
    parser.add_argument("--how", choices=("once", "on", "short", "cut"), default="once")
    parser.add_argument("--error", type=int, default=5)
    parser.add_argument("--memory", type=os.path.abspath)
    return parser.parse_args(words)


def main(words, purpose, make_case, try_all):
    """Try the calls of a case in a folder of their own; give the exit code."""
    options = parse(words, purpose)
    memory = Memory(options.memory, [options.program, options.library,
                                     *([os.environ["POLYDEM_MPI_PROGRAM"]] if options.ranks else [])])
    with tempfile.TemporaryDirectory() as work:
        os.chdir(os.path.realpath(work))
        case = make_case(options.program, options.library, options.ranks, options.how, options.error)
        return 1 if try_all(case, options, memory) else 0


def set_up(words, python_variables=None):
    """Skip the test if it needs MPI, start it anew by the Python of the project, and make its modules known."""
    if "--ranks" in words and not os.environ.get("POLYDEM_MPI_PROGRAM"):
        print("skipped: POLYDEM_MPI_PROGRAM does not name a program with MPI")
        sys.exit(SKIPPED)
    python = ROOT / ".venv" / "bin" / "python"
    missing = {name: text for name, text in (python_variables or {}).items() if name not in os.environ}
    if missing or (python.exists() and Path(sys.prefix) != python.parents[1]):
        os.environ.update(missing)
        os.execv(python if python.exists() else sys.executable, [str(python), *words])
    os.environ["POLYDEM_PROGRAM"] = os.path.abspath(words[1])
    os.environ["POLYDEM_MPI_PROGRAM"] = os.path.abspath(os.environ.get("POLYDEM_MPI_PROGRAM", words[1]))
    sys.dont_write_bytecode = True
    sys.path[:0] = [str(ROOT / "tests" / "ranks"), str(ROOT / "postproc" / "src")]


if __name__ == "__main__":
    set_up(sys.argv)
    from runs import ENVIRONMENT as SURROUNDINGS
    from runs import MPIRUN, frames
    from seals import seal

    sys.exit(main(sys.argv[1:], __doc__, Case, try_calls))
