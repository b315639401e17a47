"""The one place that knows how samples of a bench are laid out in files: joins them into cases."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import h5py
import numpy as np
from polydem_post.base.result_file import UNREADABLE, ResultError, cannot_read, entries_of, open_file

from .scene_kinds import making_of, settings_of

#: What the root of a sample says it is
CONTENT = "sample of a bench"

#: Parts of the names of processors that say nothing
DULL = re.compile(r"\((R|TM|r|tm)\)|\bCPU\b|\bProcessor\b|@.*$|\b\d+-Core\b")


@dataclass(frozen=True)
class Sample:
    """One passage of one finder through one scene. Arrays hold one entry per step; step 0 builds from nothing."""

    path: Path
    #: Facts of /case, and of /provenance
    case: dict
    provenance: dict
    #: Elapsed time of each step, and processor time of the calling thread [s]
    elapsed: np.ndarray
    processor: np.ndarray
    #: Number of pairs of each step
    pairs: np.ndarray
    #: Phase of the finder -> seconds of each step
    phases: dict
    #: Count -> value of each step; empty but in repeat 0
    counts: dict
    #: Stage of the time step -> seconds of each step; empty but in live samples
    stages: dict

    @property
    def repeat(self) -> int:
        """Number of the repeat; 0 is the warm-up."""
        return int(self.case["repeat"])

    @property
    def clock(self) -> np.ndarray:
        """Time of each step to bring the list up to date [s].

        Replay: processor time of one thread, elapsed time of more. Live: elapsed time of the stage `neighbours`.
        """
        if "neighbours" in self.stages:
            return self.stages["neighbours"]
        return self.processor if int(self.case["threads"]) == 1 else self.elapsed


@dataclass
class Case:
    """One finder on one scene with so many threads, of one build on one machine, with all its samples."""

    machine: str
    build: str
    scene: str
    mode: str
    finder: str
    threads: int
    samples: list = field(default_factory=list)

    @property
    def facts(self) -> dict:
        """What /case says of its first sample."""
        return self.samples[0].case

    @property
    def provenance(self) -> dict:
        """Where its first sample comes from."""
        return self.samples[0].provenance

    @property
    def settings(self) -> dict:
        """Settings of the run that made its scene, 'group.key' -> text; empty if they are not recorded."""
        return _settings(str(self.facts.get("input", "")))

    @property
    def making(self) -> tuple:
        """What decides over the boxes of its scene, as far as it is recorded."""
        return making_of(self.settings)

    @property
    def boxes(self) -> int:
        """Number of boxes."""
        return int(self.facts["boxes"])

    @property
    def is_disturbed(self) -> bool:
        """Whether the machine had more to do than it has processors: times of several threads then mean nothing."""
        loads = [float(sample.case["load"]) for sample in self.samples if "load" in sample.case]
        return bool(loads) and float(np.median(loads)) > int(self.provenance.get("processors", len(loads)))

    def values(self, quantity) -> dict:
        """(folder, repeat) -> value of a quantity of a sample, without the warm-up and without what is not finite."""
        pairs = {(str(s.path.parent), s.repeat): quantity(s) for s in self.samples if s.repeat >= 1}
        return {key: value for key, value in pairs.items() if np.isfinite(value)}

    def time(self) -> dict:
        """Repeat -> time per box and step without the first step [ns]."""
        return self.values(lambda sample: _per_box(sample, sample.clock[1:]))

    def first_step(self) -> dict:
        """Repeat -> time per box of the first step [ns]."""
        return self.values(lambda sample: _per_box(sample, sample.clock[:1]))

    def phase(self, *names: str) -> dict:
        """Repeat -> time per box and step of some phases of the finder, without the first step [ns]."""
        return self.values(
            lambda sample: (
                sum(_per_box(sample, sample.phases[name][1:]) for name in names)
                if all(name in sample.phases for name in names)
                else np.nan
            )
        )

    def stage(self, *names: str) -> dict:
        """Repeat -> time per box and step of some stages of the time step, without the first step [ns]; live only."""
        return self.values(
            lambda sample: (
                sum(_per_box(sample, sample.stages[name][1:]) for name in names)
                if all(name in sample.stages for name in names)
                else np.nan
            )
        )

    def count(self, name: str, first: bool = False) -> float:
        """Mean of a count over the steps without the first one, or its value in the first one; NaN if not counted."""
        for sample in self.samples:
            if name in sample.counts:
                values = sample.counts[name][:1] if first else sample.counts[name][1:]
                return float(np.mean(values)) if len(values) else np.nan
        return np.nan

    @property
    def counted(self) -> list:
        """Names of what was counted."""
        return next((list(sample.counts) for sample in self.samples if sample.counts), [])


class Bench:
    """The cases of one or several bench folders, those of several machines side by side."""

    def __init__(self, cases: list, folders: list):
        self.cases = cases
        self.folders = folders

    def select(self, **wanted) -> list:
        """Cases with these properties, in order of their size: select(finder="quadtree", threads=1)."""
        found = [
            case
            for case in self.cases
            if all(getattr(case, name) == value for name, value in wanted.items() if value is not None)
        ]
        return sorted(found, key=lambda case: (case.boxes, case.scene, case.finder, case.threads))

    def named(self, attribute: str) -> list:
        """The values of a property that occur, in order of their first occurrence."""
        return list(dict.fromkeys(getattr(case, attribute) for case in self.cases))

    def on(self, machine: str | None = None, build: str | None = None) -> Bench:
        """Only the cases of one machine and one build: the first machine, and the build that it has most samples of."""
        machine = machine or next(iter(self.named("machine")), None)
        here = [case for case in self.cases if case.machine == machine]
        samples: Counter = Counter()
        for case in here:
            samples[case.build] += len(case.samples)
        build = build or next((name for name, _ in samples.most_common(1)), None)
        return Bench([case for case in here if case.build == build], self.folders)

    @property
    def origin(self) -> str:
        """What made the samples: the programs, their revisions and builds."""
        made = {program_of(sample.provenance): None for case in self.cases for sample in case.samples}
        return f"Samples of {'; '.join(made)}."

    def provenance(self, machine: str) -> dict:
        """Where the first case of a machine comes from."""
        return next(case.provenance for case in self.cases if case.machine == machine)


@cache
def _settings(text: str) -> dict:
    return settings_of(text)


def read_bench(folders) -> Bench:
    """Read the samples of some bench folders; what is being written (*.unfinished) is left out."""
    folders = [Path(folder) for folder in folders]
    samples = []
    for folder in dict.fromkeys(folders):
        paths = sorted((folder / "samples").glob("*.h5"))
        if not paths:
            raise ResultError(f"{folder}: holds no samples of a bench (samples/*.h5); make them with ./polydem bench")
        samples += [read_sample(path) for path in paths]
    labels = _machine_labels(samples)
    cases: dict = {}
    for sample in sorted(samples, key=lambda s: (folders.index(s.path.parent.parent), s.repeat)):
        facts = sample.case
        key = (
            labels[_machine(sample)],
            build_label(sample.provenance),
            _scene_name(sample),
            facts["mode"],
            facts["finder"],
            int(facts["threads"]),
        )
        cases.setdefault(key, Case(*key)).samples.append(sample)
    for case in cases.values():
        _check_case(case)
    return Bench(list(cases.values()), folders)


def read_sample(path: Path) -> Sample:
    """Read one sample."""
    with open_file(path) as file:
        try:
            content = file.attrs.get("content", "")
            content = content.decode() if isinstance(content, bytes) else str(content)
            if not content.startswith(CONTENT):
                raise ResultError(f"{path}: is not a sample of a bench")
            steps = file["steps"]
            return _sound(Sample(
                path,
                _facts(file["case"]),
                _facts(file["provenance"]),
                steps["elapsed"][:],
                steps["processor"][:],
                steps["pairs"][:],
                _columns(steps, "phase"),
                _columns(steps, "count"),
                _columns(steps, "stage"),
            ))
        except UNREADABLE as error:
            raise cannot_read(path, error) from error


#: Levels of a tree, one for each bit of a coordinate at most
DEEPEST_TREE = 64

#: Facts of a sample without which it cannot be used, and whether they are numbers above a bound
NEEDED = {"scene": None, "mode": None, "finder": None, "threads": 1, "repeat": 0, "boxes": 1, "steps": 1}


def _sound(sample: Sample) -> Sample:
    """The sample; ResultError if facts are missing, or columns are not numbers, one per step."""
    for name, least in NEEDED.items():
        value = sample.case.get(name)
        good = isinstance(value, str) if least is None else isinstance(value, (int, np.integer)) and value >= least
        if not good:
            shown = " ".join(repr(value).split())[:40]
            raise ResultError(f"{sample.path}: case/{name} is missing or not what a sample has: {shown}")
    steps = int(sample.case["steps"])
    named = {"elapsed": sample.elapsed, "processor": sample.processor, "pairs": sample.pairs}
    for group in (sample.phases, sample.counts, sample.stages):
        named.update(group)
    for name, column in named.items():
        column = np.asarray(column)
        if column.dtype.kind not in "iuf" or column.shape != (steps,) or not np.isfinite(column).all():
            raise ResultError(f"{sample.path}: {name} is not one finite number for each of {steps} steps")
        if column.min() < 0:
            raise ResultError(f"{sample.path}: {name} has a negative entry")
        if name == "depth" and column.max() > DEEPEST_TREE:
            raise ResultError(
                f"{sample.path}: depth is {column.max():.0f}, but no tree has more than {DEEPEST_TREE} levels"
            )
    return sample


def program_of(provenance: dict) -> str:
    """The program that made something, with its revision and its kind of build."""
    version, revision = (str(provenance.get(name, "unknown")) for name in ("version", "revision"))
    return f"polydem {version} (revision {revision}, {provenance.get('build_type', 'unknown build')})"


def build_label(provenance: dict) -> str:
    """What distinguishes builds: optimisation, processor, precision if not double, and the kind of build."""
    options = str(provenance.get("options", "")).split()
    words = [word for word in options if re.fullmatch(r"-O\w*", word)][-1:]
    words += [word for word in options if word.startswith("-march=") and word != "-march=x86-64"]
    precision, kind = str(provenance.get("precision", "double")), str(provenance.get("build_type", "Release"))
    words += [precision] if "double" not in precision else []
    words += [kind] if kind not in ("Release", "") else []
    return " ".join(words) or "unknown"


def _check_case(case: Case) -> None:
    """All samples of a case must have seen the same boxes and have found the same pairs."""
    for name in ("boxes", "pairs_total", "pair_hash"):
        values = {
            str(sample.case.get(name)) for sample in case.samples if sample.case.get("steps") == case.facts["steps"]
        }
        if len(values) > 1:
            raise ResultError(
                f"{case.samples[0].path}: samples of {case.finder} on {case.scene} differ in {name}: "
                f"{', '.join(sorted(values))}; they are of different scenes and cannot be merged"
            )
    if len({making_of(_settings(str(sample.case.get("input", "")))) for sample in case.samples}) > 1:
        raise ResultError(
            f"{case.samples[0].path}: samples of {case.finder} on {case.scene} are of boxes that were made with "
            "different settings (case/input) and cannot be merged"
        )


def _per_box(sample: Sample, seconds: np.ndarray) -> float:
    return 1e9 * float(np.mean(seconds)) / int(sample.case["boxes"]) if len(seconds) else np.nan


def _machine(sample: Sample) -> tuple:
    return str(sample.provenance.get("host", "?")), str(sample.provenance.get("processor", "?"))


def _machine_labels(samples: list) -> dict:
    """(host, processor) -> name of the processor, with that of the host where several machines have it."""
    machines = list(dict.fromkeys(map(_machine, samples)))
    short = {machine: " ".join(DULL.sub(" ", machine[1]).split()) or machine[0] for machine in machines}
    shared = Counter(short.values())
    return {machine: name if shared[name] == 1 else f"{name} ({machine[0]})" for machine, name in short.items()}


def _scene_name(sample: Sample) -> str:
    """Name of the scene: what is before -FINDER-THREADS-REPEAT in the name of the file."""
    facts = sample.case
    end = f"-{facts['finder']}-{int(facts['threads'])}-{int(facts['repeat'])}"
    stem = sample.path.stem
    return stem[: -len(end)] if stem.endswith(end) else str(facts["scene"])


def _columns(steps: h5py.Group, what: str) -> dict:
    """Name -> column of a table whose names stand beside it."""
    if what not in steps:
        return {}
    names = steps[f"{what}_name"].asstr()[:]
    return {str(name).strip(): column for name, column in zip(names, np.atleast_2d(steps[what][:]).T)}


def _facts(group: h5py.Group) -> dict:
    """Name -> text or number."""
    facts = {}
    for name, entry in entries_of(group):
        if not isinstance(entry, h5py.Dataset):
            continue
        value = entry[()]
        if isinstance(value, bytes):
            value = value.decode("utf-8", errors="replace").strip()
        elif np.ndim(value) == 0 and hasattr(value, "item"):
            value = value.item()
        else:
            raise ResultError(f"{group.file.filename}: {group.name[1:]}/{name} is not one text or number")
        facts[name] = value
    return facts
