"""Writes bench folders whose truth is known: every time and count follows a law that a test can choose."""

from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import h5py
import numpy as np
import pytest
from polydem_lab.bench import samples
from polydem_lab.bench.samples import Sample

PHASES = ("structure", "search", "filter", "order", "merge", "waiting")
COUNTS = (
    "tests",
    "swaps",
    "idle_swaps",
    "left_leaf",
    "leaf_changes",
    "searches",
    "visits",
    "rebuilds",
    "crossings",
    "passes",
    "locks",
    "lock_waits",
    "candidates",
    "nodes",
    "depth",
    "bytes",
)
STAGES = ("boxes", "neighbours", "overlap", "forces", "integrate", "decomposition", "output")
SIZES = (2522, 5058, 7599, 10014, 12651, 100000)


#: Kind of scene -> entries of &scene by which the program makes such a scene, and of &boxes
ENTRIES = {
    "drum": ("name = 'drum' boxes = {boxes}", "margin = 0.0"),
    "bed": ("name = 'bed' bodies = {boxes} width = 0.0", "margin = 0.0"),
    "column": ("name = 'bed' bodies = {boxes} width = 0.08", "margin = 0.0"),
    "hopper": ("name = 'hopper' bodies = {boxes} opening = 0.1 slope = 60", "margin = 0.0"),
    "gas": ("name = 'gas' bodies = {boxes} solid_fraction = {number} speed = 0.5", "margin = 0.0"),
    "sizes": ("name = 'gas' bodies = {boxes} solid_fraction = 0.3 speed = 0.5 size_ratio = {number}", "margin = 0.0"),
    "rods": ("name = 'gas' bodies = {boxes} solid_fraction = 0.1 speed = 0.0 spin = 20.0 slender", "margin = 0.0"),
    "soft": ("name = 'gas' bodies = {boxes} solid_fraction = 2.0 speed = 0.1 overlap = .true.", "margin = 0.0"),
    "range": ("name = 'gas' bodies = {boxes} solid_fraction = 0.3 speed = 0.5", "margin = {number}"),
    "worst": ("name = 'gas' bodies = {boxes} solid_fraction = 0.3 speed = 0.5 order = 'descending'", "margin = 0.0"),
    "rest": ("name = 'gas' bodies = {boxes} solid_fraction = 0.3 speed = 1.0 moving_grains = 1", "margin = 0.0"),
    "line": ("name = 'channel' bodies = {boxes} solid_fraction = 0.3 speed = 0.5", "margin = 0.0"),
    "other": ("name = 'heap' bodies = {boxes}", "margin = 0.0"),
}

#: What the names of the scenes of these tests stand for; the package does not look at names
NAMED = {"worst": "worst", "one": "rest", "channel": "line"}


def input_of(kind, boxes, number=0.3):
    """The resolved input of a run that makes a scene of a kind, as a sample records it."""
    scene, margin = (text.format(boxes=boxes, number=number) for text in ENTRIES[kind])
    slender = "slender" in scene
    axes = {"short_axis": 5e-4 if slender else 8e-3, "long_axis": "25e-3, 25e-3" if slender else "8e-3, 11e-3"}
    entries = scene.replace(" slender", "").replace(" = ", "=").split()
    entries += [f"{name}={value}" for name, value in axes.items()]
    groups = {
        "scene": entries,
        **({"motion": ["name='turn'", "kind='rotation'", "rate=0.25"]} if kind == "drum" else {}),
        "boxes": [margin.replace(" ", "")],
        "forces": ["gravity=0.0, 0.0" if "'gas'" in scene else "gravity=0.0, -9.81"],
        "output": ["trace_start=0.9", f"folder='{kind}_{boxes}'"],
    }
    return "".join(
        f"&{group}\n" + "".join(f"   {entry.replace('=', ' = ')}\n" for entry in listed) + "/\n"
        for group, listed in groups.items()
    )


def _named_input(name, boxes):
    """The input of a scene of these tests by its name."""
    first, *rest = name.split("_")
    numbers = [float(word) for word in rest if word.replace(".", "").isdigit()]
    return input_of(NAMED.get(first, first), boxes, *numbers[:1]) if first in ENTRIES or first in NAMED else ""


#: Samples by path while they are kept in memory
IN_MEMORY = None


@dataclass
class Truth:
    """Time per step of one finder: 1e-9 * time * boxes**exponent seconds."""

    time: float = 50.0
    exponent: float = 1.0
    #: Share of the phases
    shares: tuple = (0.2, 0.4, 0.25, 0.1, 0.05, 0.0)
    #: Speed-up on more than one thread
    gain: float = 1.0
    #: Count -> number per box
    counts: dict = field(default_factory=dict)
    #: By how much its times, and those of its structure alone, differ from repeat to repeat, up and down in turns
    sway: float = 0.0
    structure_sway: float = 0.0


@dataclass
class Machine:
    """Where and by what the samples were made."""

    host: str = "alpha"
    processor: str = "Intel(R) Xeon(R) CPU X1 @ 2.40GHz"
    options: str = "-mtune=generic -march=x86-64 -O3 -fopenmp"
    caches: str = "L1d 32K, L1i 32K, L2 1024K, L3 32768K"
    clock: str = "2.4 GHz"
    #: Times are this many times as long
    slowness: float = 1.0


def write_sample(
    folder,
    name,
    finder,
    truth,
    boxes,
    machine=Machine(),
    repeat=1,
    threads=1,
    steps=6,
    mode="replay",
    bodies=None,
    noise=0.01,
    first=10.0,
    pair_hash="00ab",
    checked="all_pairs 6 steps",
    first_counts=None,
    made_by=None,
):
    """Write one sample; `made_by` is the recorded input: by the name of the scene if absent, none if False."""
    random = np.random.default_rng([boxes, repeat, threads, *map(ord, finder + name)])
    step = 1e-9 * truth.time * machine.slowness * float(boxes) ** truth.exponent / (truth.gain if threads > 1 else 1.0)
    turn = (repeat + threads) % 3 - 1
    step *= (1.0 + truth.sway) ** turn
    shares = np.array(truth.shares) * [(1.0 + truth.structure_sway) ** turn, *np.ones(len(PHASES) - 1)]
    elapsed = step * random.lognormal(0.0, noise) * np.ones(steps)
    elapsed[0] *= first
    facts = {
        "scene": name,
        "mode": mode,
        "finder": finder,
        "threads": threads,
        "repeat": repeat,
        "boxes": boxes,
        "fixed": boxes // 10,
        "bodies": bodies or boxes,
        "steps": steps,
        "dt": 2.5e-5,
        "load": 0.1,
        "time_utc": "2026-01-01T00:00:00Z",
        "pair_hash": pair_hash,
        "pairs_total": 2 * boxes * steps,
        "checked": checked,
        "trace": f"traces/{name}/trace.h5",
    }
    if made_by is not False:
        facts["input"] = (_named_input(name, boxes) if made_by is None else made_by).strip()
    provenance = {
        "host": machine.host,
        "processor": machine.processor,
        "options": machine.options,
        "caches": machine.caches,
        "clock": machine.clock,
        "precision": "double",
        "build_type": "Release",
        "processors": 4,
        "revision": "abc",
    }
    phases = dict(zip(PHASES, np.outer(elapsed, shares).T))
    stages = dict(zip(STAGES, np.outer(elapsed, (0.1, 1.0, 3.0, 1.0, 0.5, 0.0)).T)) if mode == "live" else {}
    counts = {}
    if repeat == 0:
        counts = {count: np.full(steps, round(boxes * truth.counts.get(count, 0.0))) for count in COUNTS}
        counts["depth"] = np.full(steps, truth.counts.get("depth", 0))
        for count, value in (first_counts or {}).items():
            counts[count][0] = value
    path = folder / "samples" / f"{name}-{finder}-{threads}-{repeat}.h5"
    pairs = np.full(steps, 2 * boxes, dtype=np.int32)
    sample = Sample(path, facts, provenance, elapsed, elapsed, pairs, phases, counts, stages)
    path.parent.mkdir(parents=True, exist_ok=True)
    if IN_MEMORY is None:
        write_file(sample)
    else:
        path.touch()
        IN_MEMORY[path] = sample


def write_file(sample):
    """Write a sample as the program writes it."""
    with h5py.File(sample.path, "w") as file:
        file.attrs["content"] = "sample of a bench by polydem"
        file.attrs["schema_version"] = 1
        write_facts(file, "case", sample.case)
        write_facts(file, "provenance", sample.provenance)
        for name in ("elapsed", "processor", "pairs"):
            file[f"steps/{name}"] = getattr(sample, name)
        for what, columns in (("phase", sample.phases), ("count", sample.counts), ("stage", sample.stages)):
            if columns:
                file[f"steps/{what}_name"] = np.array([name.ljust(12).encode() for name in columns])
                file[f"steps/{what}"] = np.array(list(columns.values())).T


@contextmanager
def kept_in_memory():
    """Meanwhile samples are not written as files but kept, and read from memory: hundreds of times as fast."""
    global IN_MEMORY  # noqa: PLW0603
    IN_MEMORY = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(samples, "read_sample", lambda path: IN_MEMORY[path])
        yield
    IN_MEMORY = None


def write_facts(file, group, facts):
    """Texts as the Fortran program writes them, of fixed length, and numbers."""
    for name, value in facts.items():
        file[f"{group}/{name}"] = np.bytes_(value or " ") if isinstance(value, str) else value


def truths():
    """Finders that behave as the paper says."""
    tree = {"searches": 0.05, "visits": 1.0, "nodes": 1.6, "depth": 9, "bytes": 100.0, "candidates": 4.0, "tests": 4.0}
    sweep = {"swaps": 0.2, "idle_swaps": 0.15, "tests": 0.3, "bytes": 100.0}
    return {
        "quadtree": Truth(45.0, 1.0, (0.2, 0.4, 0.25, 0.1, 0.05, 0.0), 1.7, tree),
        "quadtree_called": Truth(45.0, 1.0, (0.2, 0.4, 0.25, 0.1, 0.05, 0.0), 1.7, tree),
        "pruned_quadtree": Truth(60.0, 1.05, (0.1, 0.7, 0.1, 0.05, 0.05, 0.0), 1.0, tree),
        "sort_and_sweep": Truth(50.0, 1.0, (0.8, 0.0, 0.1, 0.05, 0.05, 0.0), 1.4, sweep),
        "partitioned_sweep": Truth(70.0, 1.0, (0.9, 0.0, 0.05, 0.03, 0.02, 0.3), 0.8, {**sweep, "crossings": 0.05}),
        "linked_cells": Truth(70.0, 1.0, (0.2, 0.5, 0.3, 0.0, 0.0, 0.0), 1.8, {"visits": 9.0, "searches": 1.0}),
    }


def write_drums(
    folder, of_finders, machine=Machine(), sizes=SIZES, repeats=7, threads=(1, 2), mode="replay", **options
):
    """Drums of several sizes with all finders; the two largest paper's sizes on several threads."""
    for boxes in sizes:
        for finder, truth in of_finders.items():
            here = truth
            if finder == "pruned_quadtree":
                here = replace(truth, counts={**truth.counts, "visits": 0.1 * np.log2(boxes)})
            if finder == "quadtree_called":
                here = replace(truth, time=truth.time * (0.9 if boxes < 5000 else 1.2))
            if truth.counts.get("depth"):
                here = replace(here, counts={**here.counts, "depth": 9 if boxes < 6000 else 10})
            for count in threads if boxes == 12651 else (1,):
                for repeat in range(repeats + 1):
                    write_sample(
                        folder, f"drum_{boxes}", finder, here, boxes, machine, repeat, count, mode=mode, **options
                    )


def write_hard_scenes(folder, of_finders, machine=Machine(), repeats=3, changes=None):
    """One scene of every kind that a claim names; times of the paper's two finders change as the claims say."""
    factors = {
        "bed": (1.1, 1.0, 3.0),
        "gas_10": (0.5, 1.0, 3.0),
        "soft_3": (9.0, 9.0, 1.0),
        "range_4": (9.0, 9.0, 1.0),
        "hopper": (1.0, 1.0, 1.0),
        "sizes_3": (1.0, 1.0, 1.0),
        "sizes_100": (2.0, 2.0, 1.0),
        **(changes or {}),
    }
    for name, by_finder in factors.items():
        for finder, factor in zip(("quadtree", "sort_and_sweep", "linked_cells"), by_finder):
            truth = replace(of_finders[finder], time=of_finders[finder].time * factor)
            for repeat in range(repeats + 1):
                write_sample(folder, name, finder, truth, 3000, machine, repeat, bodies=2500)
    for boxes in (1000, 4000):
        for finder, power in (("unsorted_sweep", 2.0), ("sort_and_sweep", 1.0)):
            for repeat in range(2):
                write_sample(
                    folder,
                    f"worst_order_{boxes}",
                    finder,
                    of_finders["sort_and_sweep"],
                    boxes,
                    machine,
                    repeat,
                    first_counts={"swaps": round(0.4 * boxes**power)},
                )
