"""What the ranks of real runs told each other, from the counters of their results.

Counts are exact on any machine, however many ranks share a processor. What every step tells halo bodies is kept apart
from what is told when bodies are handed out anew, and this from the first time, when rank 0 has all bodies.
"""

from __future__ import annotations

import csv
import math
import re
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from polydem_post.base.emit import Table
from polydem_post.base.result_file import ResultError, cannot_write
from polydem_post.read.trajectory import Trajectory

from ..bench.records import read_lines, read_records
from ..bench.statistics import number
from .exchange_model import Count

#: Packing under which counts of runs stand, and the margin of a run that chooses its own
SHAPE, MARGIN = "run", 0.0

#: Counters of a run of several processes, and what they are called here
COUNTERS = {
    "redistributions": "redistributions",
    "partitions": "partitions of space",
    "rectangles": "rectangles",
    "migrations": "migrations",
    "first_migrations": "migrations at the start",
    "halo_bodies": "halo bodies, summed over steps",
    "messages": "halo messages",
    "bytes": "halo bytes",
    "all_messages": "messages",
    "all_bytes": "bytes in messages",
    "first_messages": "messages at the start",
    "first_bytes": "bytes at the start",
    "most_bodies": "maximum per rank: bodies",
    "most_pairs": "maximum per rank: pairs",
    "most_halo_bodies": "maximum per rank: halo bodies",
    "most_messages": "maximum per rank: messages",
    "most_bytes": "maximum per rank: bytes",
}


#: Revision in files of --save that do not have it
NOT_RECORDED = "not recorded"


@dataclass(frozen=True)
class RunCount:
    """Exact counts of a run; halo bodies and messages are summed over steps and, but for `most_...`, over ranks."""

    #: Free bodies, ranks, steps
    bodies: int
    ranks: int
    steps: int
    #: How far bodies may move until they are handed out anew [m]; 0: the run chose it
    margin: float
    #: How often bodies were handed out, the first time included; how often space was divided
    redistributions: int
    partitions: int
    #: Rectangles that cover the bodies of all ranks
    rectangles: int
    #: Bodies that went to another rank, and those of them that did when rank 0 gave out all
    migrations: int
    first_migrations: int
    #: Halo bodies, and the messages and bytes that let them follow
    halo_bodies: int
    messages: int
    bytes: int
    #: All messages and bytes, and those until bodies had been handed out for the first time
    all_messages: int
    all_bytes: int
    first_messages: int
    first_bytes: int
    #: Pairs of all ranks at the end
    pairs: int
    #: Of the rank that has most: bodies and pairs at the end; halo bodies, messages and bytes
    most_bodies: int
    most_pairs: int
    most_halo_bodies: int
    most_messages: int
    most_bytes: int
    #: Hash of the state at the end
    state_hash: str
    #: Revision of the program
    revision: str = NOT_RECORDED

    @property
    def told_steps(self) -> int:
        """Steps in which halo bodies followed: all but the first, at whose beginning there are none."""
        return max(self.steps - 1, 1)

    @property
    def later_redistributions(self) -> int:
        """Times that bodies were handed out after the first."""
        return max(self.redistributions - 1, 0)

    def as_count(self) -> Count:
        """The means of a step, as count_exchange counts them in a packing."""
        steps, told = self.steps, self.told_steps
        return Count(
            shape=SHAPE, grains=self.bodies, ranks=self.ranks, margin=self.margin, grains_most=self.most_bodies,
            halo_bodies=round(self.halo_bodies / steps), halo_bodies_most=round(self.most_halo_bodies / steps),
            messages=round(self.messages / told), messages_most=math.ceil(self.most_messages / told),
            bytes=round(self.bytes / told), bytes_most=round(self.most_bytes / told), rectangles=self.rectangles)


def read_run(folder) -> RunCount:
    """Counts of the result in a folder."""
    result = Trajectory(folder)
    counters = result.counters
    ranks = counters.get("ranks", 1)
    missing = [name for name in ("steps", "pairs", *(COUNTERS.values() if ranks > 1 else ())) if name not in counters]
    if missing or counters["steps"] < 1:
        raise ResultError(f"{folder}: the run lacks counts ({', '.join(missing) or 'no steps'})")
    resolved = str(result.provenance.get("resolved_input", ""))
    group = re.search(r"^&(?:decomposition|exchange)\b(.*?)^/", resolved, re.DOTALL | re.MULTILINE)
    entries = dict(re.findall(r"(\w+)\s*=\s*'?([^\s']+)", group[1])) if group else {}
    if len(result) == 0:
        raise ResultError(f"{folder}: holds no frames")
    bodies = int((~result.frame(0).fixed).sum())
    counts = {field: counters.get(name, 0) for field, name in COUNTERS.items()}
    if ranks == 1:
        counts.update(most_bodies=bodies, most_pairs=counters["pairs"])
    try:
        margin = float(entries.get("margin", MARGIN))
    except ValueError as error:
        text = entries["margin"][:40]
        raise ResultError(f"{folder}: its margin of decomposition is not a number: {text!r}") from error
    run = RunCount(bodies=bodies, ranks=ranks, steps=counters["steps"], margin=margin,
                   pairs=counters["pairs"], state_hash=result.state_hash,
                   revision=str(result.provenance.get("revision", NOT_RECORDED)), **counts)
    _insist_on_counts(folder, run)
    return run


def write_runs(runs: list[RunCount], path: Path) -> None:
    """Write counts, one run in a row."""
    try:
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, [field.name for field in fields(RunCount)], lineterminator="\n")
            writer.writeheader()
            writer.writerows(map(asdict, runs))
    except OSError as error:
        raise cannot_write(path, error) from error


def read_runs(path: Path) -> list[RunCount]:
    """Counts that write_runs wrote; none if the file holds something else."""
    rows, columns = read_lines(path), [field.name for field in fields(RunCount)]
    if not rows or list(rows[0]) not in (columns, columns[:-1]):
        return []
    runs = read_records(path, RunCount, "./polydem scale --save")
    for run in runs:
        _insist_on_counts(path, run)
    return runs


def _insist_on_counts(place, run: RunCount) -> None:
    """Refuse counts that no run has."""
    counts = [value for value in asdict(run).values() if isinstance(value, (int, float))]
    if min(run.bodies, run.ranks, run.steps) < 1 or min(counts) < 0:
        raise ResultError(f"{place}: was damaged: there are no bodies, ranks or steps, or a count is negative")


def runs_tables(runs: list[RunCount]) -> list[Table]:
    """What steps tell, and what handing bodies out tells."""
    heading: tuple[str, ...] = (
        "margin", "bodies", "ranks", "halo bodies per body", "most halo bodies", "pairs per halo body",
        "messages", "of one rank", "bytes", "of one rank", "bodies, most/mean", "pairs, most/mean", "steps", "hash")
    steps = Table("runs", "Exact counts of runs, means of a step", heading, texts=0)
    heading = ("margin", "bodies", "ranks", "steps", "redistributions", "partitions", "migrations",
               "messages",
               "bytes", "bytes per halo body", "at the start", "messages", "bytes")
    redistributing = Table("redistributing", "Exact counts of redistributions", heading, texts=0)
    order = sorted(runs, key=lambda run: (run.bodies, run.margin, run.ranks))
    alone = {(run.bodies, run.steps): run.pairs for run in order if run.ranks == 1}
    for run in order:
        count = run.as_count()
        extra = run.pairs - alone.get((run.bodies, run.steps), run.pairs)
        steps.add(f"{run.margin:g}", run.bodies, run.ranks,
                  number(run.halo_bodies / run.steps / run.bodies), count.halo_bodies_most,
                  number(extra / count.halo_bodies) if extra and count.halo_bodies else "-",
                  count.messages, count.messages_most, count.bytes, count.bytes_most,
                  number(run.most_bodies * run.ranks / run.bodies, 4),
                  number(run.most_pairs * run.ranks / run.pairs, 4) if run.pairs else "-", run.steps, run.state_hash)
        if run.ranks > 1:
            redistributing.add(f"{run.margin:g}", run.bodies, run.ranks, run.steps,
                               run.redistributions, run.partitions, *_later(run), run.first_migrations,
                               run.first_messages, run.first_bytes)
    steps.note = ("Messages and bytes are those that let halo bodies follow; margin in m, 0: chosen by the run. Pairs "
                  "per halo body: how many pairs more than one process all have together at the end. Runs of the same "
                  "scene and steps have the same hash on any number of ranks.")
    redistributing.note = ("Redistributions: how often bodies were handed out, the first time included. Migrations (of "
                           "the whole run), messages and bytes (of one time) are those after the first, when rank 0 "
                           "gives out all bodies; that is on the right.")
    for table in (steps, redistributing):
        table.origin = f"Counted by polydem, revision {', '.join(dict.fromkeys(run.revision for run in runs))}."
    return [steps, redistributing]


def _later(run: RunCount) -> tuple:
    """Migrations; messages, bytes, and bytes per halo body of a redistribution after the first."""
    if run.later_redistributions == 0:
        return 0, "-", "-", "-"
    told = (run.all_bytes - run.bytes - run.first_bytes) / run.later_redistributions
    messages = (run.all_messages - run.messages - run.first_messages) / run.later_redistributions
    return (run.migrations - run.first_migrations, round(messages), round(told),
            number(told * run.steps / run.halo_bodies) if run.halo_bodies else "-")
