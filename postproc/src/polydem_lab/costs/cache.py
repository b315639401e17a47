"""Cache misses of the finders per box and step, counted on the traces of a bench folder.

Every trace is replayed twice, with few and with more steps; the difference is what the later steps cost, without
the start of the program and the first step. Only functions of the finders count: not those that read, check and hash,
and not the copies that compilers leave to the C library. Simulated counts are the same at every call.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from polydem_post.base.result_file import UNREADABLE, ResultError, insist_on_own_data, open_hdf5

from ..bench.records import read_records as read_all
from ..bench.records import write_records
from .cachegrind import Model, count_hardware, finder_functions, simulate
from .complexity import SOURCES

#: Name of the file in a bench folder
FILE = "cache.csv"

#: What stands where hardware does not count
NO_HARDWARE = "not available"


@dataclass(frozen=True)
class Record:
    """Counts of one finder on one trace, per box and step."""

    scene: str
    boxes: int
    finder: str
    #: Numbers of steps of the two replays
    few: int
    more: int
    #: Instructions, and reads and writes of data
    instructions: float
    accesses: float
    #: Misses of the first and of the last simulated level, reads and writes of data
    first_level: float
    last_level: float
    #: Mispredicted branches; -1 if not simulated
    mispredictions: float
    model: str
    #: What the counters of the hardware say
    hardware: str


def read_records(folders) -> list[Record]:
    """The records of some bench folders, in order of size; of the same count the first."""
    records: dict = {}
    for folder in folders:
        path = Path(folder) / FILE
        if not path.exists():
            continue
        for record in read_all(path, Record, "./polydem cache"):
            records.setdefault((record.scene, record.finder, record.model), record)
    return sorted(records.values(), key=lambda record: (record.boxes, record.scene, record.finder))


def count_misses(
    folder: Path,
    program: Path,
    finders: list,
    model: Model,
    steps: tuple,
    scenes: list | None = None,
    branches: bool = False,
    say=print,
) -> list[Record]:
    """Count every finder on every trace of a bench folder; what its file holds already is not counted again."""
    traces = {path.parent.name: path for path in sorted((folder / "traces").glob("*/trace.h5"))}
    if scenes:
        unknown = sorted(set(scenes) - set(traces))
        if unknown:
            raise ResultError(
                f"{folder}: has no trace of {', '.join(unknown)}; there are {', '.join(traces) or 'none'}"
            )
        traces = {name: traces[name] for name in scenes}
    if not traces:
        raise ResultError(f"{folder}: holds no traces (traces/NAME/trace.h5); a bench makes them")
    records = read_records([folder])
    for scene, path in sorted(traces.items(), key=lambda item: _extent(item[1])[1]):
        for finder in finders:
            known = [r for r in records if (r.scene, r.finder, r.model) == (scene, finder, model.text)]
            if not known:
                records.append(count_one(scene, path, program, finder, model, steps, branches))
                write_records(folder / FILE, records)
                known = records[-1:]
            say(
                f"{scene} {finder}: {known[0].first_level:.3f} D1 and {known[0].last_level:.3f} LL misses per "
                "box and step"
            )
    return records


def count_one(
    scene: str, trace: Path, program: Path, finder: str, model: Model, steps: tuple, branches: bool = False
) -> Record:
    """Count one finder on one trace."""
    available, boxes = _extent(trace)
    few, more = steps[0], min(steps[1], available)
    if more <= few:
        raise ResultError(f"{trace}: has {available} steps; more than {few} are needed")

    def command(n):
        return [str(program), "replay", str(trace), "--finder", finder, "--threads", "1", "--steps", str(n)]

    functions = finder_functions(SOURCES)
    low, high = (simulate(command(n), model, functions, branches) for n in (few, more))
    part = 1.0 / (boxes * (more - few))

    def per_box(*events):
        return round(part * sum(high.get(event, 0) - low.get(event, 0) for event in events), 6)

    return Record(
        scene,
        boxes,
        finder,
        few,
        more,
        instructions=per_box("Ir"),
        accesses=per_box("Dr", "Dw"),
        first_level=per_box("D1mr", "D1mw"),
        last_level=per_box("DLmr", "DLmw"),
        mispredictions=per_box("Bcm", "Bim") if branches else -1.0,
        model=model.text,
        hardware=_hardware(command(few), command(more), part),
    )


def _hardware(few: list, more: list, part: float) -> str:
    """The difference of the hardware's counters of the whole program, per box and step."""
    low = count_hardware(few)
    high = count_hardware(more) if low else {}
    shared = [event for event in high if event in low]
    if not shared:
        return NO_HARDWARE
    return ", ".join(f"{event} {part * (high[event] - low[event]):.3f}" for event in shared)


def _extent(trace: Path) -> tuple:
    """Steps and boxes of a trace."""
    try:
        with open_hdf5(trace) as file:
            insist_on_own_data(trace, file)
            steps, boxes, _ = file["aabb"].shape
            if boxes < 1:
                raise ValueError("no boxes")
            return int(steps), int(boxes)
    except UNREADABLE as error:
        raise ResultError(f"{trace}: is not a trace ({error})") from error
