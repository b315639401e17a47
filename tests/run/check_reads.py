"""Each call of a verb that reads, lists or looks for something fails once, or gives half of the data.

usage: check_reads.py PROGRAM LIBRARY [--ranks R] [--full] [--verbs A,B] [--part K/N] [--how HOW] [--error NUMBER]
                      [--memory FILE]

PROGRAM is the one without MPI, LIBRARY that of failing_calls.c. The verbs are those of VERBS; with --ranks those that
several processes can do are tried, with R processes of the program that POLYDEM_MPI_PROGRAM names, and calls of each
rank in turn; without that variable the test is skipped (code 77). An undisturbed verb counts the calls. After a failed
call

* the verb ends with code 3 and a message with the file and the cause that the system gives, and without a word of
  damage, difference or absence, or the advice to replace a result; or the outcome is that of an undisturbed call;
* all files that were there are as before, except those of a result that is continued or replaced;
* a run can be continued, and ends with the hash of an undisturbed one; an old result is complete until then.

Half of the data (--how short) must change nothing. By default the first or the last call of each kind that no verb
before has are tried, and without ranks a few of each verb. --full and the other options are those of check_writes.py.
"""

import copy
import os
import re
import shutil
import sys
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path

from check_writes import WAITING, Broken, Call, attempts, execute, hash_of, main, sample, set_up

#: About so many calls of each verb are tried, spread over all of them, whatever their kind
FEW = 4
OUTLINES = "".join(f"POLYGON ((0 {y}, 0.01 {y}, 0.01 {y + 0.01:.2f}, 0 {y + 0.01:.2f}, 0 {y}))\n"
                   for y in (0.0, 0.009, 0.018))
#: What both scenes have: frames with contacts in several segments, a checkpoint after each step
RUN = """\
&forces stiffness = 1e5 tilt_damping = 0.5 /
&integrate dt = 1e-5 duration = 4e-5 /
&output frame_interval = 1e-5 frames_per_segment = 2 contacts = .true. /
&checkpoint steps = 1 /
"""
FILES = {
    "outlines.wkt": OUTLINES,
    "scene.nml": "&scene name = 'file' bodies_file = 'data/bodies.h5' /\n" + RUN,
    "patch.nml": "&scene name = 'bed' bodies = 4 packing = 'data/grains' /\n" + RUN,
    "bed.nml": "&scene name = 'bed' bodies = 800 /\n" + RUN,
    "bench.nml": "&bench scenes = 'data/boxes/trace.h5' names = 'pile' finders = 'quadtree', 'verlet' steps = 2 "
                 "repeats = 1 folder = 'data/bench' /\n",
}
SCENE = "run data/scene.nml --threads 1 --set output.folder=data/"
OTHER = " --set forces.tilt_damping=0.25"
BOXES = "boxes --set output.trace_steps=3"
#: Verbs of the program and of Python
VERBS = {
    "check": "check data/scene.nml",
    "check packing": "check data/patch.nml",
    "run": SCENE + "new",
    "run packing": "run data/patch.nml --threads 1 --set output.folder=data/new",
    "continue": SCENE + "begun --continue",
    "finished": SCENE + "whole --continue",
    "force": SCENE + "whole --force" + OTHER,
    "changed": SCENE + "begun --continue --changed" + OTHER,
    "info": "info data/whole",
    "info checkpoint": "info data/begun/checkpoint_1.h5",
    "info --check": "info data/begun --check",
    "replay": "replay data/boxes/trace.h5",
    "bench": "bench data/bench.nml",
}
PYTHON_VERBS = {
    "import": "import data/outlines.wkt -o data/made.h5",
    "export": "export data/whole --to csv -o data/made.csv",
    "plot": "plot data/whole -o data/made.svg",
    "movie": "movie data/whole -o data/made.gif --processes 1",
    "view": "view data/whole -o data/made.html",
    "table": "table data/whole",
    "tables": "tables data/measured --no-figures --output data/report",
}
#: Verbs that several ranks do
OF_RANKS = ("run", "run packing", "continue", "finished", "force", "changed")
#: Words that blame the contents of a file for a failed call, or advise to destroy a result
BLAME = re.compile(r"differ|damage|missing|--force|[Nn]o such|there is no|truncated|is not an?\b|changed|WRONG|empty|"
                   r"contains no|has no\b|another run|invalid|Traceback|unknown|cannot go on")


class Case:
    """The programs, and what undisturbed calls give."""

    def __init__(self, program, library, ranks, how, error):
        self.program, self.library, self.ranks, self.how, self.error = program, library, ranks, how, error
        self.data, self.whole = Path.cwd() / "data", {}
        self.data.mkdir()
        for name, text in FILES.items():
            (self.data / name).write_text(text, encoding="utf-8")
        for words in (PYTHON_VERBS["import"].replace("made", "bodies"), SCENE + "whole", SCENE + BOXES, VERBS["bench"],
                      VERBS["run packing"].replace("patch", "bed").replace("new", "grains")):
            self.insist(words)
        (self.data / "bench").rename(self.data / "measured")
        self.begin()
        self.template = Path.cwd() / "template"
        shutil.copytree(self.data, self.template, symlinks=True)
        self.before = bytes_of(self.template)

    def begin(self):
        """An interrupted run: writing the last checkpoint failed."""
        log = Path.cwd() / "calls"
        places = {"LD_PRELOAD": self.library, "POLYDEM_FAIL_FOLDER": str(self.data), "POLYDEM_FAIL_LOG": str(log)}
        self.insist(SCENE + "begun", **places)
        calls = [Call(0, *line.split(" ", 2)) for line in log.read_text(encoding="utf-8").splitlines()]
        last = [call for call in calls if call.name == "pwrite" and call.path.startswith("checkpoint")][-1]
        shutil.rmtree(self.data / "begun")
        self.insist(SCENE + "begun", code=3, **places, POLYDEM_FAIL_CALL=str(last.number))
        log.unlink()

    def call(self, words, ranks=None, **environment):
        """Do a verb; return exit code, standard output, standard error."""
        if words.split()[0] in PYTHON_VERBS:
            return in_python(words.split(), environment, self.data.parent)
        command = [self.program + "_lab" * words.startswith(("replay", "bench"))]
        if ranks:
            command = [*MPIRUN, "-n", str(ranks), os.environ["POLYDEM_MPI_PROGRAM"]]
        return execute([*command, *words.split()], {**SURROUNDINGS, "OMP_NUM_THREADS": "1", **environment},
                       self.data.parent)

    def insist(self, words, code=0, **environment):
        found, output, message = self.call(words, **environment)
        if found != code:
            raise Broken(f"{words}: code {found}\n{output}{message}")
        return output

    def watched(self, verb, rank, **environment):
        """Do a verb in fresh files with the library in front; return what `call` does, and its calls."""
        shutil.rmtree(self.data, ignore_errors=True)
        shutil.copytree(self.template, self.data, symlinks=True)
        log = self.data.parent / "calls"
        log.unlink(missing_ok=True)
        told = self.call({**VERBS, **PYTHON_VERBS}[verb], self.ranks, LD_PRELOAD=self.library, POLYDEM_PATIENCE=WAITING,
                         POLYDEM_FAIL_KIND="reads", POLYDEM_FAIL_FOLDER=str(self.data), POLYDEM_FAIL_RANK=str(rank),
                         POLYDEM_FAIL_LOG=str(log), **environment)
        lines = log.read_text(encoding="utf-8").splitlines() if log.exists() else []
        calls = [Call(rank, *line.rstrip("/.").split(" ", 2)) for line in lines]
        for call in calls:
            call.verb = verb
        return told, calls

    def count(self, verb, rank):
        """All calls of a verb in which none fails."""
        outcomes = []
        for _ in range(2):
            (code, output, message), calls = self.watched(verb, rank)
            if code != 0 or not calls:
                raise Broken(f"{verb}: code {code}, {len(calls)} calls\n{output}{message}")
            outcomes.append((outcome(output), made(self.data, self.before)))
        (said, files), (again, others) = outcomes
        self.whole[verb] = said if said == again else None, {name: text if others.get(name) == text else None
                                                             for name, text in files.items()}
        return calls

    def attempt(self, call):
        """Let a call fail; give what happened, in a word, and the seconds it took to end."""
        with tempfile.TemporaryDirectory(dir=self.template.parent) as folder:
            case = copy.copy(self)
            case.data = Path(folder) / "data"
            return case.attempt_here(call)

    def attempt_here(self, call):
        """Likewise in a folder in which nothing else happens."""
        began = time.monotonic()
        (code, output, message), calls = self.watched(call.verb, call.rank, POLYDEM_FAIL_CALL=str(call.number),
                                                      POLYDEM_FAIL_HOW=self.how, POLYDEM_FAIL_ERROR=str(self.error))
        seconds = time.monotonic() - began
        met = [other for other in calls if other.number == call.number]
        said = f"code {code}\n{output[-600:] if code else ''}{message}"
        if code == 0:
            text, files = self.whole[call.verb]
            now = made(self.data, self.before)
            if text is not None and outcome(output) != text:
                raise Broken(f"other output, without a word: {said}\n{output}")
            if now.keys() != files.keys() or any(files[name] not in (None, now[name]) for name in files):
                raise Broken(f"other files, without a word: {said}")
        else:
            self.check_message(code, output, message, [other for other in calls if other.number >= call.number])
        self.check_files(call.verb, said, code)
        return ("told" if code != 0 else "harmless" if met else "not reached"), seconds

    def check_message(self, code, output, message, failed):
        """The verb has said which file failed, and why."""
        lines = [line for line in f"{output}\n{message}".splitlines() if os.strerror(self.error) in line]
        said = f"code {code}\n{output[-600:]}{message}"
        if code != 3:
            raise Broken(f"another code: {said}")
        if not any(call.path in line for line in lines for call in failed):
            raise Broken(f"no word of file and cause: {said}")
        found = BLAME.search("\n".join([*lines, message]))
        if found:
            raise Broken(f"'{found.group()}' is not what happened: {said}")

    def check_files(self, verb, said, code):
        """Nothing is lost."""
        words = VERBS.get(verb, "")
        result = re.search(r"output\.folder=data/(\w+)", words)
        folder = self.data / result.group(1) if result else None
        now = bytes_of(self.data)
        lost = [name for name, text in self.before.items()
                if now.get(name) != text and not (folder and (self.data / name).is_relative_to(folder))]
        if lost:
            raise Broken(f"{lost} changed: {said}")
        if not folder or code == 0:
            return
        again = words.replace(" --force", " --continue")
        if "--continue" not in again:
            again += " --continue"
        found, output, message = self.call(again)
        if verb == "force" and found != 0:
            if hash_of(self.insist(VERBS["finished"])) != self.whole_hash("finished"):
                raise Broken(f"the old result is lost: {said}")
            found, output, message = self.call(words)
        if found != 0 or hash_of(output) != self.whole_hash(verb):
            raise Broken(f"cannot be continued, code {found}:\n{output[-300:]}{message}\nafter {said}")

    def whole_hash(self, verb):
        if verb not in self.whole:
            self.count(verb, 0)
        return self.whole[verb][0]


def in_python(words, environment, folder):
    """Do a verb of Python in a child of this process, which has the library in front."""
    with tempfile.TemporaryFile() as output, tempfile.TemporaryFile() as message:
        child = os.fork()
        if child == 0:
            code = 70
            try:
                os.dup2(output.fileno(), 1)
                os.dup2(message.fileno(), 2)
                os.environ.update(environment)
                os.chdir(folder)
                code = polydem_post(words)
                sys.stdout.flush()
                sys.stderr.flush()
            except BaseException:
                traceback.print_exc()
                sys.stderr.flush()
            os._exit(code)
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        texts = []
        for file in (output, message):
            file.seek(0)
            texts.append(file.read().decode(errors="replace"))
    return code, *texts


def bytes_of(folder):
    """All files in a folder, by name."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def made(folder, before):
    """New files; those of a result are compared by its hash."""
    return {name: text for name, text in bytes_of(folder).items() if before.get(name) != text and not name.startswith(
        ("new/", "begun/", "whole/", "bench/"))}


def outcome(output):
    """What must not depend on a failure: the hash of a run, or all that is said"""
    return hash_of(output) or output


def in_turn(calls):
    """The first or the last of each kind."""
    kinds = {}
    for call in calls:
        kinds.setdefault(call.kind(), []).append(call)
    return [found[-(number % 2)] for number, found in enumerate(kinds.values())]


def try_calls(case, options, memory):
    """Let calls fail; give those that went wrong."""
    verbs = [*OF_RANKS] if options.ranks else [*VERBS, *PYTHON_VERBS]
    if options.verbs:
        verbs = options.verbs.split(",")
    part, parts = (int(word) for word in options.part.split("/"))
    all_calls, broken, outcomes, tried, known = Counter(), [], Counter(), Counter(), {True: set(), False: set()}
    for verb in verbs:
        calls = [call for rank in range(options.ranks or 1) for call in case.count(verb, rank)]
        all_calls[verb] = len(calls)
        kinds = known[verb in PYTHON_VERBS]
        some = [] if options.ranks else calls[::-(-len(calls) // FEW)]
        wanted = calls if options.full else [*in_turn(sample(calls, kinds)), *some]
        chosen = [call for call in calls if call in wanted]
        kinds.update(call.kind() for call in calls)
        points = {(options.ranks, options.how, options.error, verb, call.rank, call.number): call
                  for call in chosen[part - 1::parts]}
        tried[verb] = len(points)
        for _, outcome, _ in attempts(case, points, options.ranks, memory):
            if outcome:
                outcomes[outcome] += 1
            else:
                broken.append(verb)
    print(f"calls that read: {dict(all_calls)}\ntried: {dict(tried)}; {dict(outcomes)}; wrong: {dict(Counter(broken))}")
    print(f"{sum(outcomes.values())} of {sum(tried.values())} calls passed ({options.how}, "
          f"{os.strerror(options.error)}); {len(broken)} did not")
    return broken


if __name__ == "__main__":
    # Verbs of Python are children of this process.
    set_up(sys.argv, {"LD_PRELOAD": os.path.abspath(sys.argv[2])})
    import matplotlib.pyplot  # noqa: F401  the children need not import it
    from polydem_post.command_line.main import main as polydem_post
    from runs import ENVIRONMENT as SURROUNDINGS
    from runs import MPIRUN

    SURROUNDINGS = {name: text for name, text in SURROUNDINGS.items() if name != "LD_PRELOAD"}
    sys.exit(main(sys.argv[1:], __doc__, Case, try_calls))
