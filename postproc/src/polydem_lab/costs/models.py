"""What each optional model costs: per cent of a time step, and bytes per body, on against off.

A drum is packed from a settled bed and runs a few steps, once with a model and once without, all models in turns,
again and again. Ratios are formed within each turn, so that a machine that slows down for a while spoils a turn and
not a model.
A step is all its stages, guards and output included; the start of a run does not count. Beside times stand the
instructions that a step takes in a simulated processor: the same at every call and on a busy machine, where times are
worth little and may be left out. They do not know of waiting: neither for memory nor for a disk, which frames and
checkpoints do. Memory is what the process holds after the last step of a larger drum, on less off.

Times of forces differ also because the model changes what happens; in so few steps hardly.
"""

from __future__ import annotations

import os
import re
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

from polydem_post.base.emit import FORMATS, SUFFIXES, Table
from polydem_post.base.result_file import ResultError, cannot_read
from polydem_post.read.trajectory import Trajectory

from ..bench.records import read_records, write_records
from ..bench.statistics import Estimate, median, median_of_ratios, number
from .cachegrind import SAME_PLACES, simulate

#: Name of the raw samples in the folder of the study
FILE = "samples.csv"

#: Steps and boxes of the runs for times, and of those for memory
TIMED = (400, 2522)
WEIGHED = (4, 100000)
#: Instructions are those of the last hundred steps, in which everything happens that does not happen in every step
COUNTED = ((20, 600), (120, 600))

#: How often memory is measured
WEIGHINGS = 3

#: Silence after which a study says how far it is [s]
SILENCE = 10.0

#: The group of the drum that turns its walls
MOTION = re.compile(r"^&motion\n.*?^/\n", re.MULTILINE | re.DOTALL)

#: Every other optional model off
BARE = (
    "forces.damping=none",
    "forces.friction=none",
    "guards.displacement=off",
    "guards.step=off",
    "guards.overlap=off",
    "guards.tunnelling=off",
    "output.energy_balance=.false.",
    "output.trace_steps=0",
    "output.trace_start=0",
    "checkpoint.wall_interval=0",
    "integrate.dt=2e-5",
)


@dataclass(frozen=True)
class Model:
    """Something that a scene can switch on."""

    name: str
    #: Overrides that switch it on
    on: tuple
    #: Name of the model that it is compared with
    off: str = "nothing"
    #: Groups that the namelist has in addition
    groups: str = ""


#: The models, each behind the one that it is compared with
MODELS = (
    Model("nothing", ()),
    Model("conservative law", ("forces.law=conservative",)),
    Model("polar law", ("forces.law=polar",)),
    Model("damping by the rate", ("forces.damping=rate", "forces.damping_from_touch=.false.")),
    Model("damping from touch", ("forces.damping=rate", "forces.damping_from_touch=.true."), "damping by the rate"),
    Model("damping of tilts", ("forces.damping=rate", "forces.damping_from_touch=.false.", "forces.tilt_damping=1"),
          "damping by the rate"),
    Model("damping of given restitution", ("forces.damping=rate", "forces.damping_from_touch=.false.",
                                           "forces.restitution=0.5")),
    Model("damping of Matuttis & Chen", ("forces.damping=matuttis_chen",)),
    Model("damping (Hunt-Crossley)", ("forces.damping=hunt_crossley", "forces.damping_coefficient=300")),
    Model("friction (Cundall-Strack)", ("forces.friction=cundall_strack", "forces.midstep_slip=.false.")),
    Model("slip in mid-step", ("forces.friction=cundall_strack", "forces.midstep_slip=.true."),
          "friction (Cundall-Strack)"),
    Model("friction (exact)", ("forces.friction=exact",)),
    Model("friction (exact to 1e-6)", ("forces.friction=exact", "forces.friction_tolerance=1e-6")),
    Model("two materials", ("scene.material=grain", "scene.wall_material=steel"),
          groups="&material name = 'grain' /\n&material name = 'steel' stiffness = 2e7 /\n"),
    Model("cohesion", ("forces.cohesion=1",)),
    Model("rolling resistance", ("forces.rolling_friction=0.1",)),
    Model("drag", ("forces.drag=0.1",)),
    Model("local damping", ("forces.local_damping=0.3",)),
    Model("shaken gravity", ("forces.shake=0,1", "forces.shake_frequency=10")),
    Model("stop without direction", ("overlap.degenerate=stop",)),
    Model("compensated sums", ("integrate.accumulation=compensated",)),
    Model("Gear's integrator", ("integrate.scheme=gear",)),
    Model("turning walls", (), groups="&motion name = 'turn' kind = 'rotation' rate = 0.25 /\n"),
    Model("guard: displacement", ("guards.displacement=stop",)),
    Model("guard: stable step", ("guards.step=stop",)),
    Model("guard: overlap", ("guards.overlap=warn",)),
    Model("guard: passing", ("guards.tunnelling=warn",)),
    Model("energy balance", ("output.energy_balance=.true.",)),
    Model("guard: energy", ("output.energy_balance=.true.", "guards.energy=warn"), off="energy balance"),
    Model("a frame every 50 steps", ("output.frame_interval=1e-3",)),
    Model("frames with contacts", ("output.frame_interval=1e-3", "output.contacts=.true."), "a frame every 50 steps"),
    Model("times of every step", ("output.step_profile=.true.",)),
    Model("a checkpoint every 50 steps", ("checkpoint.steps=50",)),
)


@dataclass(frozen=True)
class Sample:
    """One run."""

    model: str
    #: 'time', 'memory' or 'count'
    kind: str
    repeat: int
    bodies: int
    steps: int
    threads: int
    #: Mean of a step, all stages [us]; of 'count' its instructions
    step: float
    #: Contacts per step
    contacts: float
    #: Resident after the last step [KiB]
    memory: int
    #: What ran where
    program: str
    machine: str


@dataclass(frozen=True)
class Study:
    """Where and with what to measure."""

    program: Path
    inputs: Path
    output: Path
    threads: int = 1

    def command(self, namelist: str, folder: Path, overrides, threads: int) -> list[str]:
        """Command that runs a scene."""
        words = [f"output.folder={folder}", *overrides]
        command = [str(self.program), "run", str(self.inputs / namelist), "--force", "--threads", str(threads)]
        return command + [part for word in words for part in ("--set", word)]

    def scene(self, model: Model) -> str:
        """The namelist of a model, which is written first: the drum at rest, with the groups of the model."""
        bench = self.inputs / "bench" / "drum.nml"
        try:
            drum = bench.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise cannot_read(bench, error) from error
        path = self.output.resolve() / "drum.nml"
        path.write_text(MOTION.sub("", drum) + model.groups, encoding="utf-8")
        return str(path)

    def run(self, namelist: str, folder: Path, overrides, **environment: str) -> Trajectory:
        """Run a scene and open its result."""
        command = self.command(namelist, folder, overrides, self.threads)
        done = subprocess.run(command, capture_output=True, text=True, check=False, env={**os.environ, **environment})
        if done.returncode != 0:
            raise ResultError(f"{' '.join(command)}: {done.stderr.strip()}")
        return Trajectory(folder)

    def count(self, namelist: str, folder: Path, overrides) -> int:
        """Instructions of a run on one thread, its start included."""
        command = self.command(namelist, folder, overrides, 1)
        return simulate(command, None, re.compile(""))["Ir"]

    def bed(self) -> Path:
        """The settled bed that drums are packed from; made if it is not there."""
        folder = self.output / "bed"
        if not (folder / "profile.h5").exists() or Trajectory(folder).status != "finished":
            self.run("bed.nml", folder, ["output.frame_interval=0", "output.energy_balance=.false."])
        return folder

    def overrides(self, model: Model, steps: int, boxes: int) -> list[str]:
        """What makes a drum of a size that has one model on."""
        size = [f"scene.boxes={boxes}", f"scene.packing={self.bed()}", f"integrate.duration={2e-5 * steps:.6e}"]
        return [*BARE, *size, *model.on]

    def sample(self, model: Model, kind: str, repeat: int) -> Sample:
        """One run with a model."""
        scene, folder = self.scene(model), self.output / "run"
        if kind == "count":
            few, more = (self.count(scene, folder, self.overrides(model, *size)) for size in COUNTED)
            result = Trajectory(folder)
            step = (more - few) / (COUNTED[1][0] - COUNTED[0][0])
        else:
            if kind == "time":
                result = self.run(scene, folder, self.overrides(model, *TIMED))
            else:
                # Freed arrays go back to the system at once, and not now and then.
                result = self.run(scene, folder, self.overrides(model, *WEIGHED), **SAME_PLACES)
            step = 1e6 * float(sum(result.profile["total"])) / result.counters["steps"]
        profile, counters, origin = result.profile, result.counters, result.provenance
        return Sample(
            model.name,
            kind,
            repeat,
            counters["bodies"],
            counters["steps"],
            self.threads,
            round(step, 4),
            round(counters["contacts"] / counters["steps"], 1),
            profile["memory"],
            f"polydem {origin['version']} ({origin['revision']}), {origin['build_type']}, {origin['compiler']}",
            origin["processor"],
        )


def measure_costs(study: Study, repeats: int, say=print) -> list[Sample]:
    """All samples, those in the file and those that are missing there; without repeats no times."""
    samples = read_samples(study.output / FILE)
    wanted = [("count", 1)] + [("memory", k) for k in range(1, WEIGHINGS + 1)]
    if repeats > 0:
        wanted += [("time", k) for k in range(repeats + 1)]
    taken = {(sample.kind, sample.repeat, sample.model) for sample in samples}
    left = sum((*each, model.name) not in taken for each in wanted for model in MODELS)
    say(f"{left} samples to take, {len(samples)} found in {study.output}; a bed settles first if there is none")
    spoke = time.monotonic()
    for kind, repeat in wanted:
        for turn, model in enumerate(MODELS, 1):
            if (kind, repeat, model.name) in taken:
                continue
            sample = study.sample(model, kind, repeat)
            _compare(study.output / FILE, samples, sample)
            samples.append(sample)
            write_records(study.output / FILE, samples)
            if time.monotonic() - spoke > SILENCE:
                say(f"{kind} {repeat}: {turn} of {len(MODELS)} models")
                spoke = time.monotonic()
        say(f"{kind} {repeat}: done")
    return samples


def _compare(path: Path, samples: list, sample: Sample) -> None:
    for name in ("program", "machine", "threads"):
        if samples and getattr(samples[0], name) != getattr(sample, name):
            raise ResultError(
                f"{path}: has samples of {getattr(samples[0], name)}, not of {getattr(sample, name)}; choose another "
                "folder with --output, or remove the file"
            )


def read_samples(path: Path) -> list[Sample]:
    """The samples of a file, none if there is no file."""
    if not path.exists():
        return []
    samples = read_records(path, Sample, "./polydem costs")
    for number_of_line, each in enumerate(samples, 2):
        if each.kind not in ("time", "memory", "count") or each.model not in {model.name for model in MODELS}:
            raise ResultError(f"{path}: line {number_of_line}: there is no model {each.model!r} or kind {each.kind!r}")
        if min(each.bodies, each.steps, each.threads) < 1 or each.step <= 0.0:
            raise ResultError(f"{path}: line {number_of_line}: bodies, steps, threads and time of a step must be "
                              f"above 0")
    return samples


def share_of_step(samples: list, model: Model) -> Estimate:
    """What a model adds to a step [%]: median over the turns, without the first one, which warms up."""
    on, off = (
        {sample.repeat: sample.step for sample in samples if (sample.kind, sample.model) == ("time", name)}
        for name in (model.name, model.off)
    )
    ratio = median_of_ratios({key: on[key] for key in on if key > 0}, off)
    value, low, high, least = (100.0 * (each - 1.0) for each in (ratio.value, ratio.low, ratio.high, ratio.least))
    return Estimate(value, low, high, least, ratio.repeats)


def share_of_instructions(samples: list, model: Model) -> float:
    """What a model adds to the instructions of a step [%]."""
    return 100.0 * (_instructions(samples, model.name) / _instructions(samples, model.off) - 1.0)


def _instructions(samples: list, name: str) -> float:
    return median([sample.step for sample in samples if (sample.kind, sample.model) == ("count", name)]).value


def bytes_per_body(samples: list, model: Model) -> float:
    """Memory that a model adds, per body [bytes]."""
    return _weight(samples, model.name) - _weight(samples, model.off)


def _weight(samples: list, name: str) -> float:
    weighed = [sample for sample in samples if (sample.kind, sample.model) == ("memory", name)]
    return median([1024.0 * sample.memory / sample.bodies for sample in weighed]).value


def costs_table(samples: list) -> Table:
    """One row per model."""
    table = Table(
        "costs",
        "What optional models cost",
        ("model", "on by", "time of a step [%]", "instructions [%]", "bytes per body", "contacts per step"),
        texts=2,
    )
    for model in MODELS:
        mine = [sample for sample in samples if sample.model == model.name]
        if mine:
            table.add(*_row(samples, mine, model))
    table.note = _note(samples)
    return table


def _row(samples: list, mine: list, model: Model) -> tuple:
    """Cells of a model, of which there are some samples."""
    timed = [sample for sample in mine if sample.kind == "time" and sample.repeat > 0]
    counted = [sample for sample in mine if sample.kind == "count"]
    weighed = [sample for sample in mine if sample.kind == "memory"]
    step = instructions = memory = "-"
    shown = ", ".join(word for word in model.on if word not in _model(model.off).on)
    if model.name == model.off:
        if timed:
            step = f"{median([sample.step for sample in timed]).text()} us"
        if counted:
            instructions = f"{number(1e-6 * _instructions(samples, model.name))} million"
        if weighed:
            memory = f"{_weight(samples, model.name):.0f}"
    else:
        if timed:
            share = share_of_step(samples, model)
            step = f"{share.value:+.1f} [{share.low:+.1f}, {share.high:+.1f}]"
        if counted:
            instructions = f"{share_of_instructions(samples, model):+.2f}"
        if weighed:
            memory = f"{bytes_per_body(samples, model):+.0f}"
    return model.name, shown, step, instructions, memory, number((timed or counted or mine)[0].contacts, 4)


def _note(samples: list) -> str:
    """What was measured, and on what."""
    first = samples[0]
    timed = [sample for sample in samples if sample.kind == "time"]
    times = "Times: not measured. "
    if timed:
        times = (f"Times: {timed[0].bodies} bodies, {timed[0].steps} steps, median of "
                 f"{max(s.repeat for s in timed)} turns with its interval, elapsed. ")
    return (
        f"{first.program}; {first.machine}; {first.threads} thread(s). {times}Instructions: {COUNTED[1][1]} "
        f"boxes, one thread, a hundred steps; the same on a busy machine. Memory: {WEIGHED[1]} boxes, to about 6 "
        "bytes. "
        "Against nothing, but each refinement against what it refines: damping from touch against damping by the rate, "
        "slip in mid-step against friction, contacts against frames, the guard of energy against the energy balance."
    )


def _model(name: str) -> Model:
    return next(model for model in MODELS if model.name == name)


def write_costs(samples: list, folder: Path) -> Table:
    """Write the table in every form; return it."""
    table = costs_table(samples)
    for form in FORMATS:
        (folder / (table.name + SUFFIXES[form])).write_text(table.document(form), encoding="utf-8")
    return table
