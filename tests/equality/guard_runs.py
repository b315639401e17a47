"""Builds of the two revisions, and their runs."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from pathlib import Path

from guard_cases import NAME, read_entries
from guard_names import PRESENT, Names

ENVIRONMENT = {
    **{name: value for name, value in os.environ.items() if not name.startswith("OMPI_COMM_WORLD")},
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "OMPI_MCA_hwloc_base_binding_policy": "none",
    "OMP_WAIT_POLICY": "passive",
}
if os.getuid() == 0:
    ENVIRONMENT.update(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
#: Exit code of a run that was interrupted and can go on
EARLY = 75
#: A run takes a second or two; many at once on a busy machine take longer
PATIENCE = 900.0


class GuardError(Exception):
    """The comparison itself cannot be done."""


class UnknownError(Exception):
    """A revision does not have an entry, a word or a namelist of a case."""


def call(command, **options):
    """Run a command to its end; its output is the message if it fails."""
    done = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    if done.returncode != 0:
        raise GuardError(f"{' '.join(map(str, command))} ended with {done.returncode}:\n{done.stdout[-4000:]}"
                         f"{done.stderr[-4000:]}")
    return done.stdout


@dataclass
class Side:
    """One of the two revisions: its sources, builds and the folder in which its programs run."""

    names: Names
    sources: Path
    folder: Path
    has_mpi: bool

    @property
    def work(self):
        """The working folder of all runs."""
        return self.folder / "work"

    def program(self, preset, what="program"):
        """The built program without MPI (release) or with it (mpi), or that of the laboratory."""
        path = self.folder / preset / PRESENT.place(what)
        return path if path.exists() else self.folder / preset / self.names.place(what)

    def build(self, say, frozen):
        """Build what is needed; what is `frozen` and was built once is not looked at again."""
        self.work.mkdir(parents=True, exist_ok=True)
        for preset in ("release", "mpi")[:1 + self.has_mpi]:
            stamp = self.folder / preset / "guard_is_built"
            if frozen and stamp.exists():
                continue
            say(f"building {self.folder.name}, {preset}")
            call(["cmake", "-S", self.sources, "-B", self.folder / preset, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
                  "-DPOLYDEM_TESTS=OFF", f"-DPOLYDEM_MPI={'ON' if preset == 'mpi' else 'OFF'}"])
            call(["cmake", "--build", self.folder / preset])
            stamp.touch()

    @cached_property
    def entries(self):
        """The words, possibly none, of each entry that this revision knows."""
        found = {}
        for entry in read_entries((self.sources / "inputs" / "entries.md").read_text(encoding="utf-8")):
            found.setdefault(entry.name, set()).update(entry.choices)
        return found

    def translated(self, settings, namelist=None):
        """Pairs of entries and values in the names of this revision; a former name only where it lacks the present.

        With the text of a namelist, it lacks groups with a name that is not there.
        """
        for entry, value in settings.items():
            instance = entry.split(".")[1]
            is_there = namelist is None or entry.count(".") == 1 or f"'{instance}'" in namelist
            has_it = is_there and self.lacks(entry, value) is None
            pairs = [(entry, value)] if has_it else self.names.pairs(entry, value)
            for pair in pairs:
                lacking = self.lacks(*pair)
                if lacking is not None:
                    raise UnknownError(f"no {lacking}")
                yield pair

    def lacks(self, entry, value):
        """What this revision does not have of an entry and its value; None: it has both."""
        group, *instance, key = entry.split(".")
        words = self.entries.get(f"{group}.{NAME}.{key}" if instance else entry)
        if words is None:
            return entry
        return f"{entry} = {value}" if words and value.strip("'") not in words else None

    def overrides(self, settings, namelist=None):
        """Options --set, beside the text of a namelist."""
        return [word for name, value in self.translated(settings, namelist)
                for word in (self.names.option("--set"), f"{name}={value}")]

    def namelist(self, settings):
        """The text of a namelist."""
        groups = {}
        for name, value in self.translated(settings):
            group, _, key = name.rpartition(".")
            kind, _, instance = group.partition(".")
            lines = groups.setdefault(group, [f"&{kind}", *([f"   name = '{instance}'"] if instance else [])])
            lines.append(f"   {key} = {quoted(value)}")
        return "".join("\n".join([*lines, "/\n"]) for lines in groups.values())

    def command(self, case, folder):
        """Arguments of the run of a case, which leaves its result in a folder."""
        where = {"output.folder": f"{folder.relative_to(self.work)}/result"}
        if case.source is not None:
            path = self.sources / self.names.place("inputs") / f"{case.source}.nml"
            if not path.exists():
                raise UnknownError(f"no inputs/{case.source}.nml")
            text = path.read_text(encoding="utf-8")
            return ["run", str(path), *self.overrides({**case.settings, **where}, text)]
        path = folder / "case.nml"
        path.write_text(self.namelist(case.settings), encoding="utf-8")
        return ["run", str(path), *self.overrides(where)]

    def start(self, words, ranks=None, threads=1):
        """Start the program, with MPI if there is a number of ranks."""
        command = [str(self.program("release", "laboratory" if words[0] == "replay" else "program"))]
        if ranks is not None:
            command = ["mpirun", "-n", str(ranks), str(self.program("mpi"))]
        return subprocess.Popen([*command, *words, self.names.option("--threads"), str(threads)], cwd=self.work,
                                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                env=ENVIRONMENT)

    def run(self, words, ranks=None, threads=1):
        """Run the program to its end: exit code and output."""
        process = self.start(words, ranks, threads)
        output, _ = process.communicate(timeout=PATIENCE)
        return process.returncode, output

    def run_case(self, case):
        """Do a case: the folder of what it left, exit code and output."""
        folder = self.work / "cases" / case.name
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        words = self.command(case, folder)
        if case.attempts:
            code, output = self.run_attempts(words, folder / "result", case)
        else:
            code, output = self.run(words, case.ranks, case.threads)
        if case.replay is None or code != 0:
            return folder / "result", code, output
        finder = self.names.word("--finder", case.replay)
        trace = (folder / "result" / self.names.file("trace")).relative_to(self.work)
        code, output = self.run(["replay", str(trace), self.names.option("--finder"), finder,
                                 self.names.option("--samples"), f"{folder.relative_to(self.work)}/samples"],
                                threads=case.threads)
        return folder / "samples", code, output

    def run_attempts(self, words, result, case):
        """A run that is interrupted after a checkpoint of each attempt but the last."""
        words = [*words, self.names.option("--continue")]
        for ranks in case.attempts[:-1]:
            before = self.newest(result)
            process = self.start(words, ranks, case.threads)
            end = time.monotonic() + PATIENCE
            while self.newest(result) == before and process.poll() is None and time.monotonic() < end:
                time.sleep(0.002)
            process.send_signal(signal.SIGUSR1)
            output, _ = process.communicate(timeout=PATIENCE)
            if process.returncode != EARLY:
                raise GuardError(f"{case.name}: the run of {self.folder.name} was to be interrupted and ended with "
                                 f"{process.returncode}; make it longer in guard_cases.py\n{output[-1500:]}")
        return self.run(words, case.attempts[-1], case.threads)

    def newest(self, result):
        """When the newest checkpoint was written; 0 if there is none."""
        times = [0]
        for path in result.glob(self.names.file("checkpoint")):
            try:
                times.append(path.stat().st_mtime_ns)
            except FileNotFoundError:
                pass
        return max(times)


def quoted(value):
    """A word or path in quotes; numbers, logicals and lists of numbers as they are."""
    return value if re.fullmatch(r"[-+.\d][-+.\de, ]*|\.true\.|\.false\.", value) else f"'{value}'"


def extract(root, revision, folder):
    """The sources of a revision."""
    if (folder / "CMakeLists.txt").exists():
        return
    archive = subprocess.run(["git", "-C", str(root), "archive", revision], capture_output=True, check=False)
    if archive.returncode != 0:
        raise GuardError(f"git knows no revision {revision} here: {archive.stderr.decode().strip()}")
    folder.mkdir(parents=True, exist_ok=True)
    subprocess.run(["tar", "-x", "-C", str(folder)], input=archive.stdout, check=True)


def write_bodies(base, present):
    """The bodies files that inputs/precision wants, made once by the present package, renamed for the base."""
    sys.path[:0] = [str(present.sources / "postproc" / "src")]
    scenes = import_module("polydem_lab.precision.scenes")
    trajectory = import_module("polydem_post").Trajectory
    folder = present.work / "results" / "workprecision" / "bodies"
    folder.mkdir(parents=True, exist_ok=True)
    for name, scene in scenes.SCENES.items():
        path = folder / f"{name}.h5"
        if path.exists():
            continue
        if scene.bodies is not None:
            scene.bodies().write(path)
        else:
            source = present.sources / "inputs" / "precision" / f"{name}_start.nml"
            result = present.work / "results" / f"{name}_start"
            code, output = present.run(["run", str(source), "--force", "--set", f"output.folder={result}"])
            if code != 0:
                raise GuardError(f"{source} ended with {code}:\n{output}")
            scenes.last_frame(trajectory(result)).write(path)
    copies = base.work / "results" / "workprecision" / "bodies"
    copies.mkdir(parents=True, exist_ok=True)
    for path in folder.glob("*.h5"):
        copy_bodies(path, copies / path.name, base.names)


def copy_bodies(source, target, names):
    """Copy a bodies file under the names of a revision: `data` of the kind bodies."""
    import h5py

    with h5py.File(source, "r") as present, h5py.File(target, "w") as copy:
        for name in present:
            copy[names.own_data(f"bodies/{name}")] = present[name][()]
