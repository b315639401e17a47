"""A study under way: which points there shall be, and in which order they are measured."""

from __future__ import annotations

import json
import math
import random
import shutil
import time
from dataclasses import dataclass
from pathlib import Path

from polydem_post.base.result_file import ResultError, cannot_write

from .codes import CODES, polydem
from .measure import BISECTIONS, measure
from .problems import Collective, Problem, Threshold
from .runs import Code, Missing, Places, RunError, Series
from .samples import ORIGIN, Points, Sample

#: Processor seconds that a point may be expected to take, from the coarser ones of its series, in a whole and in a
#: short study; up to how many it is measured again; a run is given up after so many times the first
LIMIT, QUICK_LIMIT = 30.0, 8.0
REPEATED, QUICK_REPEATED, PATIENCE = 3.0, 0.5, 10.0

#: A short study has every so many levels of a series
STRIDE = 2


@dataclass(frozen=True)
class Plan:
    """What a study shall have."""

    problems: list
    laws: list
    without: list
    repeats: int = 3
    quick: bool = False

    def seeds(self, problem: Problem) -> tuple:
        """Seeds of a problem."""
        return problem.seeds[:1] if self.quick else problem.seeds

    def levels(self, series: Series) -> list[int]:
        """Levels of a series, the coarsest first."""
        levels = sorted(series.knobs)
        return levels[::STRIDE] if self.quick else levels

    def series(self, word: str, problem: Problem) -> list[Series]:
        """All series of a code in a problem."""
        if CODES[word].omits(problem):
            return []
        laws = [each for law in self.laws for each in polydem.series_of_law(problem, law)] if word == "polydem" else []
        return [*CODES[word].series(problem), *laws]


@dataclass(frozen=True)
class Task:
    """A point to be measured."""

    word: str
    problem: Problem
    series: Series
    level: int
    seed: int
    repeat: int


class Study:
    """A study in a folder."""

    def __init__(self, folder: Path, plan: Plan, program: Path, environment: Path, say=print):
        self.folder, self.plan, self.say = Path(folder).resolve(), plan, say
        self.points = Points(self.folder)
        scratch = self.folder / "runs"
        try:
            scratch.mkdir(exist_ok=True)
            environment.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise cannot_write(Path(error.filename or scratch), error) from error
        self.places = Places(environment.resolve(), scratch, program)
        self._durations: dict[str, float] = {}
        self.codes, self.missing = self._find()
        self._insist_on_laws()
        self._write_origin()

    def _find(self) -> tuple:
        """The codes that are here, and why others are not."""
        found: dict[str, Code] = {}
        missing: dict[str, str] = {}
        for word, module in CODES.items():
            if word in self.plan.without:
                missing[word] = "left out by --without"
                continue
            try:
                found[word] = module.find(self.places)
            except Missing as error:
                if word == "polydem":
                    raise ResultError(f"{self.places.program}: cannot be run ({error})") from error
                missing[word] = str(error)
            self.say(f"missing: {module.NAME}: {missing[word]}" if word in missing else f"found: {found[word].version}")
        return found, missing

    def _insist_on_laws(self) -> None:
        """ResultError for a law that the program does not know."""
        for law in self.plan.laws if "polydem" in self.codes else []:
            problem = self.plan.problems[0]
            knobs = polydem.series_of_law(problem, law)[0].knobs
            self.codes["polydem"].run.check(problem.scene(problem.seeds[0]), knobs[min(knobs)])

    def _write_origin(self) -> None:
        lines = [f"{CODES[word].NAME}: {code.version}" for word, code in self.codes.items()]
        lines += [f"{CODES[word].NAME}: missing, {why}" for word, why in self.missing.items()]
        (self.folder / ORIGIN).write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")

    def tasks(self, repeat: int) -> list[Task]:
        """The points of a repeat: problem after problem, in each the coarse ones first, the codes in a random order."""
        found = []
        for problem in self.plan.problems:
            tasks = [Task(word, problem, series, level, seed, repeat)
                     for word in self.codes for series in self.plan.series(word, problem)
                     for level in self.plan.levels(series) for seed in self.plan.seeds(problem)]
            random.Random(repeat).shuffle(tasks)
            found += sorted(tasks, key=lambda task: self.plan.levels(task.series).index(task.level))
        return found

    def measure(self) -> None:
        """Make all points that are missing, one at a time."""
        try:
            for repeat in range(self.plan.repeats):
                todo = [task for task in self.tasks(repeat) if self._wanted(task)]
                self.say(f"repeat {repeat + 1} of {self.plan.repeats}: {len(todo)} points")
                for number, task in enumerate(todo, 1):
                    if self._wanted(task):
                        self._keep(task, f"{number}/{len(todo)}")
        finally:
            for code in self.codes.values():
                code.run.end()
            shutil.rmtree(self.places.scratch, ignore_errors=True)

    def _same(self, task: Task) -> list[Sample]:
        """Points of the series of a task by the version of its code that is here."""
        return self.points.of(task.problem.name, task.series.name, self.codes[task.word].version)

    def _wanted(self, task: Task) -> bool:
        """Whether a point is not there yet, and the coarser ones were not too slow for it."""
        limit, repeated = (QUICK_LIMIT, QUICK_REPEATED) if self.plan.quick else (LIMIT, REPEATED)
        for sample in self._same(task):
            cost = self._cost(sample, task.problem)
            if sample.level < task.level and cost * task.series.growth ** (task.level - sample.level) > limit:
                return False
            if (sample.level, sample.seed) == (task.level, task.seed):
                if sample.repeat == task.repeat or sample.status == "failed" or cost > repeated:
                    return False
        return task.repeat == 0 or len(self.plan.seeds(task.problem)) == 1

    def _cost(self, sample: Sample, problem: Problem) -> float:
        """Processor seconds of the runs of a point."""
        if sample.status == "failed":
            return sample.spent
        if problem.name not in self._durations:
            self._durations[problem.name] = problem.scene(problem.seeds[0]).duration
        searched = 2 + BISECTIONS if isinstance(problem, Threshold) else 1
        return sample.median * self._durations[problem.name] * searched

    def _keep(self, task: Task, place: str) -> None:
        """Measure a point and add it to the file."""
        knobs = task.series.knobs[task.level]
        code = self.codes[task.word]
        known = [sample.load for sample in self._same(task) if sample.level == task.level]
        limit = QUICK_LIMIT if self.plan.quick else LIMIT
        began, message, status = time.monotonic(), "", "finished"
        error, median, least, runs, steps, load = math.nan, math.nan, math.nan, 0, math.nan, math.nan
        try:
            found = measure(code.run, task.problem, knobs, task.seed, PATIENCE * limit, known[0] if known else math.nan)
            error, steps, load = found.error, found.steps, found.load
            least, median, runs = min(found.seconds), sorted(found.seconds)[len(found.seconds) // 2], len(found.seconds)
        except RunError as reason:
            status, message = "failed", str(reason)
        spent = time.monotonic() - began
        name = task.series.column or CODES[task.word].NAME
        self.points.add(Sample(task.problem.name, name, task.series.name, task.level, json.dumps(knobs), task.seed,
                               task.repeat, code.version, status, error, median, least, runs, steps, load, spent,
                               message))
        kind = "value" if isinstance(task.problem, Collective) else "error"
        what = message or f"{'' if math.isnan(error) else f'{kind} {error:.1e}, '}{median:.1e} s/s"
        self.say(f"{place} {task.problem.name}, {task.series.name}, level {task.level}: {what}")
