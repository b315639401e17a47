"""Runs the scenes of the study of speed against error, and keeps every raw sample.

A sample is one run of one choice: its time, and what it measured. samples.csv in the folder of the study grows by one
line per run, so that an interrupted study goes on where it was.
"""

from __future__ import annotations

import csv
import hashlib
import io
import math
import os
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields
from pathlib import Path

import h5py
import numpy as np
from polydem_post.base.result_file import ResultError, cannot_read, insist_on_file
from polydem_post.read.stable_share import stable_share
from polydem_post.read.trajectory import Trajectory

from .scenes import INPUTS, SCENES, Model, Scene, last_frame

#: Name of the file in the folder of a study
FILE = "samples.csv"

#: Numerics -> scheme, and whether contacts are integrated with second order, too
NUMERICS = {
    "velocity_verlet": ("velocity_verlet", False),
    "velocity_verlet, second order": ("velocity_verlet", True),
    "gear": ("gear", False),
    "gear, second order": ("gear", True),
    "gear_3_20": ("gear_3_20", False),
}

#: Damping or friction -> entry that makes its integration one of second order
SECOND_ORDER = {"rate": "forces.damping_from_touch", "cundall_strack": "forces.midstep_slip"}

#: Precisions that are compared, and the one that the references have
PRECISIONS, REFERENCE = ("double", "single"), "quadruple"

#: A step that takes so many times the median was interrupted by another process
INTERRUPTED = 10.0

#: File of a study that says which programs made its samples
ORIGIN = "programs.txt"

#: Exit code of the program for an input that it does not accept
REFUSED = 2


@dataclass(frozen=True)
class Choice:
    """One point of the matrix."""

    scene: str
    model: str
    numerics: str
    precision: str
    steps: int


@dataclass(frozen=True)
class Sample:
    """One run."""

    scene: str
    model: str
    numerics: str
    precision: str
    steps: int
    repeat: int
    #: finished, stopped (by a guard) or refused (unknown to the program)
    status: str
    #: Simulated time [s]
    duration: float
    #: Time of all steps as seconds_of_steps counts it [s]; NaN if not finished
    seconds: float
    #: Greatest share of the stable step of the contacts that the run saw
    share: float
    #: State of the program and of the input: samples of different ones do not belong together
    state: str
    #: Shape and values of what was measured, blanks between them; empty but for the first repeat. Or what went wrong
    result: str

    @property
    def choice(self) -> Choice:
        """The settings of the run."""
        return Choice(self.scene, self.model, self.numerics, self.precision, self.steps)

    @property
    def values(self) -> np.ndarray:
        """What was measured: (moments, items, components)."""
        words = self.result.split()
        return np.array(words[3:], dtype=float).reshape([int(word) for word in words[:3]])


def result_text(values: np.ndarray) -> str:
    """Shape and values as text, without loss."""
    return " ".join([*map(str, values.shape), *map(repr, values.ravel().tolist())])


def read_samples(folder: Path) -> list[Sample]:
    """All samples of a study; an unfinished last line is left out."""
    path = Path(folder) / FILE
    if not path.exists():
        raise ResultError(f"{path}: there is no such file; ./polydem workprecision makes it")
    try:
        insist_on_file(path)
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise cannot_read(path, error) from error
    samples, kinds = [], {"str": str, "int": int, "float": float}
    try:
        for number, row in enumerate(csv.DictReader(io.StringIO(text[: text.rfind("\n") + 1])), 2):
            samples.append(Sample(**{each.name: kinds[str(each.type)](row[each.name]) for each in fields(Sample)}))
            _insist(samples[-1], number)
    except (KeyError, TypeError, ValueError, csv.Error) as error:
        raise ResultError(f"{path}: is not a file of ./polydem workprecision, or was damaged ({error})") from error
    return samples


def _insist(sample: Sample, line: int) -> None:
    """ValueError for what no study holds."""
    if sample.steps < 1 or sample.repeat < 0 or not sample.duration > 0.0 or math.isinf(sample.duration):
        raise ValueError(f"line {line}: steps, repeat or duration are not what a run has")
    if sample.status not in ("finished", "stopped", "refused"):
        raise ValueError(f"line {line}: the status {sample.status!r} is unknown")
    if sample.status != "finished":
        return
    if sample.model.count("/") != 2 or not (sample.seconds > 0.0 and math.isfinite(sample.seconds)):
        raise ValueError(f"line {line}: model or seconds are not what a finished run has")
    if sample.repeat == 0:
        sample.values  # noqa: B018  raises if shape and values do not fit


class Study:
    """A study under way in a folder."""

    def __init__(self, folder: Path, programs: dict, say=print):
        """`programs`: precision -> path of the program."""
        missing = [name for name in ("double", REFERENCE) if name not in programs]
        if missing:
            raise ResultError(f"a study needs a program in {missing[0]} precision; give --program {missing[0]}=PATH")
        self.folder, self.programs, self.say = Path(folder).resolve(), programs, say
        for name in ("bodies", "runs"):
            (self.folder / name).mkdir(parents=True, exist_ok=True)
        self.versions = {name: _version(path) for name, path in programs.items()}
        self._path = self.folder / FILE
        self.samples = read_samples(self.folder) if self._path.exists() else []
        (self.folder / ORIGIN).write_text(
            "".join(f"{name}: {text.splitlines()[0] if text else 'unknown'}\n" for name, text in self.versions.items()),
            encoding="utf-8")
        self._repair()

    def _repair(self) -> None:
        """Cut off an unfinished last line; begin a new file with its heading."""
        if not self._path.exists():
            self._append([each.name for each in fields(Sample)])
            return
        text = self._path.read_bytes()
        whole = text[: text.rfind(b"\n") + 1]
        if whole != text:
            self._path.write_bytes(whole)

    def _append(self, row) -> None:
        with self._path.open("a", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerow(row)

    def measure(self, scenes: list, repeats: int) -> None:
        """Make all samples that are missing: references on all processors, then timed runs one at a time, in turns."""
        for scene in scenes:
            self._make_bodies(scene)
        states = {scene.name: self._state(scene) for scene in scenes}
        strange = {s.scene for s in self.samples if s.scene in states and s.state != states[s.scene][s.precision]}
        if strange:
            raise ResultError(
                f"{self._path}: holds samples of {', '.join(sorted(strange))} by another program or of another input; "
                "give another folder with --output, or delete that file"
            )
        known = {(sample.choice, sample.repeat) for sample in self.samples}
        wanted = [choice for scene in scenes for choice in references_of(scene) if (choice, 0) not in known]
        self.say(f"references: {len(wanted)} runs")
        with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
            for sample in pool.map(lambda choice: self._run(choice, 0, states), wanted):
                self._keep(sample)
        for repeat in range(repeats):
            todo = [(choice, repeat) for scene in scenes for choice in choices_of(scene, self.programs)]
            todo = [each for each in todo if each not in known and not self._hopeless(each[0])]
            self.say(f"repeat {repeat + 1} of {repeats}: {len(todo)} runs")
            for choice, _ in todo:
                if not self._hopeless(choice):
                    self._keep(self._run(choice, repeat, states))

    def _hopeless(self, choice: Choice) -> bool:
        """Whether the program refused the same model or numerics, or stopped in the same run."""
        for sample in self.samples:
            same = (sample.scene, sample.model, sample.numerics) == (choice.scene, choice.model, choice.numerics)
            if (same and sample.status == "refused") or (sample.choice == choice and sample.status == "stopped"):
                return True
        return False

    def _keep(self, sample: Sample) -> None:
        if sample.status == "refused" and all(sample.result != each.result for each in self.samples):
            self.say(f"left out: {sample.scene}, {sample.model}, {sample.numerics}: {sample.result}")
        self.samples.append(sample)
        self._append([getattr(sample, each.name) for each in fields(Sample)])

    def _make_bodies(self, scene: Scene) -> None:
        """Write the bodies file of a scene, from a run if it cannot be made otherwise."""
        path = self.folder / "bodies" / f"{scene.name}.h5"
        if scene.bodies is not None:
            scene.bodies().write(path)
        elif not path.exists():
            result = self.folder / "runs" / f"{scene.name}_start"
            code, message = _call(self.programs["double"], INPUTS / f"{scene.name}_start.nml",
                                  [f"output.folder={result}"])
            if code != 0:
                raise ResultError(f"{scene.name}: its start cannot be made: {message}")
            last_frame(Trajectory(result)).write(path)

    def _state(self, scene: Scene) -> dict:
        """Precision -> a short hash of the program's version, the namelist and the bodies."""
        digest = hashlib.sha256(scene.namelist.read_bytes())
        with h5py.File(self.folder / "bodies" / f"{scene.name}.h5", "r") as file:
            for name in sorted(file):
                digest.update(file[name][()].tobytes())
        base = digest.hexdigest()
        return {name: hashlib.sha256((base + version).encode()).hexdigest()[:12]
                for name, version in self.versions.items()}

    def _run(self, choice: Choice, repeat: int, states: dict) -> Sample:
        """One run of the program."""
        scene, model = SCENES[choice.scene], Model(*choice.model.split("/"))
        result = self.folder / "runs" / hashlib.sha256(repr(choice).encode()).hexdigest()[:12]
        overrides = [
            f"scene.bodies_file={self.folder / 'bodies' / scene.name}.h5",
            f"integrate.dt={scene.duration / choice.steps!r}",
            f"output.frame_interval={scene.duration / scene.moments!r}",
            f"output.folder={result}",
            *model.overrides(),
            *numerics_overrides(choice.numerics, model),
        ]
        code, message = _call(self.programs[choice.precision], scene.namelist, overrides)
        status = "finished" if code == 0 else "refused" if code == REFUSED else "stopped"
        seconds, share, text = float("nan"), float("nan"), message
        if code == 0:
            run = Trajectory(result)
            seconds = seconds_of_steps(result / "steps.h5")
            share = stable_share(result / "log.txt")
            text = result_text(scene.measure(run)) if repeat == 0 else ""
        shutil.rmtree(result, ignore_errors=True)
        return Sample(**choice.__dict__, repeat=repeat, status=status, duration=scene.duration, seconds=seconds,
                      share=share, state=states[scene.name][choice.precision], result=text)


def references_of(scene: Scene) -> list[Choice]:
    """The reference of every model, and the run with half as many steps that tells how exact it is."""
    if scene.reference == 0:
        return []
    best = "velocity_verlet, second order"
    return [
        Choice(scene.name, model.name, best if best in numerics_of(model) else "velocity_verlet", REFERENCE, steps)
        for model in scene.models
        for steps in (scene.reference, scene.reference // 2)
    ]


def second_order_entries(model: Model, second: bool = True) -> list[str]:
    """Entries that integrate damping and friction of a model with second or first order, where both are possible."""
    value = ".true." if second else ".false."
    return [f"{SECOND_ORDER[part]}={value}" for part in (model.damping, model.friction) if part in SECOND_ORDER]


def numerics_overrides(numerics: str, model: Model) -> list[str]:
    """Entries for --set."""
    scheme, second = NUMERICS[numerics]
    return [f"integrate.scheme={scheme}", *second_order_entries(model, second)]


def numerics_of(model: Model) -> list[str]:
    """The numerics that make a difference for a model."""
    return [name for name, (_, second) in NUMERICS.items() if not second or second_order_entries(model)]


def choices_of(scene: Scene, precisions) -> list[Choice]:
    """The matrix of a scene for the precisions that there are programs for."""
    return [
        Choice(scene.name, model.name, numerics, precision, steps)
        for steps in scene.steps
        for model in scene.models
        for numerics in numerics_of(model)
        for precision in PRECISIONS
        if precision in precisions
    ]


def seconds_of_steps(path: Path) -> float:
    """Time of all steps of a run without output [s].

    The first step, which makes arrays, and steps that were INTERRUPTED count like the mean of the others.
    """
    with h5py.File(path, "r") as file:
        names = [name.decode() if isinstance(name, bytes) else name for name in file["steps/stage_name"][:]]
        kept = [k for k, name in enumerate(names) if name != "output"]
        times = file["steps/stage"][:][:, kept].sum(axis=1)
    later = times[1:] if len(times) > 1 else times
    return float(later[later <= INTERRUPTED * np.median(later)].mean() * len(times))


def _call(program: Path, namelist: Path, overrides: list) -> tuple:
    """Exit code and last message of a run on one thread."""
    command = [str(program), "run", str(namelist), "--threads", "1", "--force"]
    for override in overrides:
        command += ["--set", override]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    lines = done.stderr.strip().splitlines()
    return done.returncode, lines[-1] if lines else ""


def _version(program: Path) -> str:
    try:
        told = subprocess.run([str(program), "info"], capture_output=True, text=True, check=True).stdout
        return told.split("\ninput")[0]
    except (OSError, subprocess.CalledProcessError) as error:
        raise ResultError(f"{program}: cannot be run ({error})") from error
