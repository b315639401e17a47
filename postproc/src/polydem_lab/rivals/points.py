"""What the points of a study say: errors, times, who is cheapest for an error, and means over seeds."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from polydem_post.base.result_file import ResultError

from .codes import CODES
from .problems import PROBLEMS, Collective
from .samples import Sample, read_samples

#: Errors for which the cheapest point is sought
ERRORS = (1e-1, 1e-2, 1e-3, 1e-4)

#: Column of polydem with its default settings; those of its laws begin like this
OWN = "polydem"


@dataclass(frozen=True)
class Point:
    """Settings of a code in a problem: all seeds and repeats."""

    problem: str
    column: str
    series: str
    level: int
    #: Error or value of each seed
    values: tuple
    #: Root mean square error over the seeds, or error of their mean in a collective problem
    error: float
    #: Processor seconds per simulated second: median, least and greatest of the repeats
    median: float
    least: float
    most: float
    repeats: int
    #: Steps per simulated second
    steps: float

    @property
    def mean(self) -> float:
        """Mean over the seeds."""
        return float(np.mean(self.values))

    @property
    def sampling(self) -> float:
        """Standard error of the mean over the seeds; NaN for one seed."""
        count = len(self.values)
        return float(np.std(self.values, ddof=1) / math.sqrt(count)) if count > 1 else math.nan


class Comparison:
    """Points of a study, of the newest version of each code that it has."""

    def __init__(self, samples: list):
        newest = {sample.column: sample.version for sample in samples}
        self.samples = [sample for sample in samples if sample.version == newest[sample.column]]
        finished = [sample for sample in self.samples if sample.status == "finished"]
        if not finished:
            raise ResultError("there are no points of ./polydem rivals")
        self.versions = sorted(set(newest.values()))
        self.problems = [name for name in PROBLEMS if any(sample.problem == name for sample in finished)]
        self.columns = list(dict.fromkeys(sample.column for sample in finished))
        names = [module.NAME for module in CODES.values()]
        self.columns.sort(key=lambda column: (names.index(OWN if column.startswith(OWN) else column), column))
        groups: dict = {}
        for sample in finished:
            groups.setdefault((sample.problem, sample.series, sample.level), []).append(sample)
        self.points = [_point(group) for _, group in sorted(groups.items())]
        self.references = {name: _reference(self.points, name) for name in self.problems
                           if isinstance(PROBLEMS[name], Collective)}
        self.points = [_with_error(point, self.references.get(point.problem)) for point in self.points]

    def series(self, problem: str) -> dict:
        """(column, series) -> points from coarse to fine."""
        found: dict = {}
        for column in self.columns:
            for point in self.points:
                if (point.problem, point.column) == (problem, column):
                    found.setdefault((column, point.series), []).append(point)
        return {key: sorted(points, key=lambda point: point.level) for key, points in found.items()}

    def time_for(self, problem: str, column: str, error: float) -> float:
        """Least time in which a series of a code keeps an error; infinite if none does."""
        times = [time_for(points, error) for (owner, _), points in self.series(problem).items() if owner == column]
        return min(times, default=math.inf)

    def least_error(self, problem: str, column: str) -> float:
        """Least error that a code reaches; NaN if it has none."""
        errors = [point.error for point in self.points if (point.problem, point.column) == (problem, column)]
        return min((each for each in errors if math.isfinite(each)), default=math.nan)

    def floor(self, problem: str) -> float:
        """Errors below this are not judged."""
        reference = self.references.get(problem)
        return max(PROBLEMS[problem].floor, 2.0 * reference[1] / reference[0] if reference else 0.0)

    def judged(self) -> list[tuple]:
        """Pairs of problem and error that are judged."""
        return [(problem, error) for problem in self.problems for error in ERRORS if error >= self.floor(problem)]

    def profile(self, columns: list, error: float | None = None) -> dict:
        """Column -> ratios of its times to the best one's (performance profile, Dolan & Moré 2002).

        There is one for each problem and error in which any of the columns keeps the error; infinite where it does
        not.
        """
        ratios: dict = {column: [] for column in columns}
        for problem, tolerance in self.judged():
            if error not in (None, tolerance):
                continue
            times = {column: self.time_for(problem, column, tolerance) for column in columns}
            best = min(times.values())
            if math.isfinite(best):
                for column, time in times.items():
                    ratios[column].append(time / best)
        return ratios

    def failures(self) -> list[Sample]:
        """Points that failed, one of each series and level."""
        found: dict = {}
        for sample in self.samples:
            if sample.status == "failed":
                found.setdefault((sample.problem, sample.series, sample.level), sample)
        return list(found.values())


def _point(group: list) -> Point:
    first = group[0]
    values = tuple(sample.error for sample in group if sample.repeat == 0)
    medians = [sample.median for sample in group]
    return Point(first.problem, first.column, first.series, first.level, values, math.nan, float(np.median(medians)),
                 min(sample.least for sample in group), max(medians), len(group), first.steps)


def _with_error(point: Point, reference: tuple | None) -> Point:
    """The point with its error."""
    if not point.values:
        return point
    if isinstance(PROBLEMS[point.problem], Collective):
        error = abs(point.mean / reference[0] - 1.0) if reference else math.nan
    else:
        error = float(np.sqrt(np.mean(np.square(point.values))))
    return replace(point, error=error)


def _reference(points: list, problem: str) -> tuple | None:
    """Mean, and its standard error, over the rivals at the finest step of each; None without rivals."""
    finest: dict = {}
    for point in points:
        if point.problem == problem and not point.column.startswith(OWN) and point.values:
            if point.column not in finest or point.steps >= finest[point.column].steps:
                finest[point.column] = point
    if not finest:
        return None
    means = [point.mean for point in finest.values()]
    errors = [point.sampling for point in finest.values() if math.isfinite(point.sampling)]
    return float(np.mean(means)), float(np.sqrt(np.sum(np.square(errors))) / len(means)) if errors else 0.0


def time_for(points: list, error: float) -> float:
    """Time for an error along a series, the coarsest point first; infinite if it does not reach it.

    A point keeps an error if it and the next finer one are below it. Between the first that does and the one before,
    time is interpolated over the error, both in logarithms; nothing is extrapolated.
    """
    for number, point in enumerate(points):
        if point.error <= error and points[min(number + 1, len(points) - 1)].error <= error:
            if number == 0 or not points[number - 1].error > error:
                return point.median
            coarse = points[number - 1]
            part = math.log(error / coarse.error) / math.log(max(point.error, 1e-300) / coarse.error)
            return coarse.median * (point.median / coarse.median) ** part
    return math.inf


def order_in_stiffness(points: list) -> float:
    """Exponent with which the error falls with the stiffness, over the last three levels; NaN of fewer points."""
    kept = [(point.level, math.log10(point.error)) for point in points if point.error > 0.0][-3:]
    if len(kept) < 3:
        return math.nan
    levels, errors = np.array(kept).T
    return float(-np.polyfit(levels, errors, 1)[0])


def read_comparison(folder: Path) -> Comparison:
    """What the points in a folder say."""
    return Comparison(read_samples(folder))
