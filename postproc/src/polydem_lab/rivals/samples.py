"""The points of a study as rows of a file, by which an interrupted study goes on where it was."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass, fields
from pathlib import Path

from polydem_post.base.result_file import ResultError, cannot_read, cannot_write, insist_on_file

from .codes import CODES
from .problems import PROBLEMS

#: File of the points of a study, and of the codes that took part and those that did not
FILE, ORIGIN = "points.csv", "codes.txt"

#: What can become of a point
STATES = ("finished", "failed")


@dataclass(frozen=True)
class Sample:
    """One measurement."""

    problem: str
    #: Column of the tables: a code, or polydem with a law that was named
    column: str
    series: str
    level: int
    knobs: str
    seed: int
    repeat: int
    #: Name and version of the code
    version: str
    status: str
    #: Error, or value of a collective problem; NaN for repeats of a time
    error: float
    #: Processor seconds per simulated second: median and least of the repetitions in a row, and how many these are
    median: float
    least: float
    runs: int
    #: Steps per simulated second; load at which the time of a threshold was measured
    steps: float
    load: float
    #: Seconds that the measurement took; what went wrong
    spent: float
    message: str


KINDS = {"str": str, "int": int, "float": float}


class Points:
    """The file of the points of a study."""

    def __init__(self, folder: Path):
        self.path = Path(folder) / FILE
        self._known: dict[tuple, list[Sample]] = {}
        for sample in read_samples(folder) if self.path.exists() else []:
            self._remember(sample)
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            if not self.path.exists():
                self._append([each.name for each in fields(Sample)])
            text = self.path.read_bytes()
            whole = text[: text.rfind(b"\n") + 1]
            if whole != text:  # an unfinished last line
                self.path.write_bytes(whole)
        except OSError as error:
            raise cannot_write(self.path, error) from error

    def add(self, sample: Sample) -> None:
        """Append a point."""
        self._remember(sample)
        self._append([getattr(sample, each.name) for each in fields(Sample)])

    def of(self, problem: str, series: str, version: str) -> list[Sample]:
        """Points of a series by a version of its code."""
        return self._known.get((problem, series, version), [])

    def _remember(self, sample: Sample) -> None:
        self._known.setdefault((sample.problem, sample.series, sample.version), []).append(sample)

    def _append(self, row: list) -> None:
        with self.path.open("a", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerow(row)


def read_samples(folder: Path) -> list[Sample]:
    """All points of a study; an unfinished last line is left out."""
    path = Path(folder) / FILE
    if not path.exists():
        raise ResultError(f"{path}: there is no such file; ./polydem rivals makes it")
    try:
        insist_on_file(path)
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise cannot_read(path, error) from error
    samples = []
    try:
        for number, row in enumerate(csv.DictReader(io.StringIO(text[: text.rfind("\n") + 1])), 2):
            samples.append(Sample(**{each.name: KINDS[str(each.type)](row[each.name]) for each in fields(Sample)}))
            _insist(samples[-1], number)
    except (KeyError, TypeError, ValueError, csv.Error) as error:
        raise ResultError(f"{path}: is not a file of ./polydem rivals, or was damaged ({error})") from error
    return samples


def _insist(sample: Sample, line: int) -> None:
    """ValueError for what no study holds."""
    known = {module.NAME for module in CODES.values()}
    if sample.problem not in PROBLEMS or sample.status not in STATES or sample.column.partition(", ")[0] not in known:
        raise ValueError(f"line {line}: the problem {sample.problem!r}, code {sample.column!r} or status "
                         f"{sample.status!r} is unknown")
    if sample.status == "failed":
        return
    numbers = sample.median, sample.least, sample.steps
    if not all(0.0 < each < math.inf for each in numbers) or math.isinf(sample.error) or sample.error < 0.0:
        raise ValueError(f"line {line}: error, times or steps are not what a run has")
