"""The fine-grained parallel sweep beside the tree: its waiting per pass against its work per part, and who wins.

From samples on one thread come the work that threads share and the rest, which one thread does alone; from the machine,
measured beside the samples, the cost of a barrier and of starting threads. With n threads

    sweep:  rest + work/n uneven(n) + fetched(n) + passes barrier(n) + region(n)
    tree:   rest + work/n + wait(n) + fetched(n) +      3 barrier(n) + region(n)

All threads of the sweep meet after every pass, so a pass takes as long as the part with most work. The work of a part
is that of its ends, of which all parts have as many, and that of its exchanges, which are counted from the trace
(`sweep_parts.py`); what an end and an exchange cost follows from the steps on one thread.

The threads of the tree share the search for boxes that left their leaf. Then the first thread repairs the tree and, if
few boxes moved, searches for them, while the others compare candidates, of which it takes so many that all end at the
same time. wait(n) is the time by which repair and search alone take longer than that. If many boxes moved, all
threads search afterwards. What the repair costs follows from the steps on one thread.

fetched(n) = (cost per box * boxes + cost per search * searches) (n - 1)/n / n: of the boxes, and of the nodes that a
search visits, the part (n - 1)/n has been written by another core. These costs are the only fitted numbers: one for the
sweep, two for the tree, for all scenes, fitted to the fewest several threads. Samples on more threads check the model.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations

import numpy as np

from ..bench import series
from ..bench.samples import Bench, Case
from ..bench.series import TREE
from ..bench.statistics import Estimate, median, of_one_bench, typical
from .exchanges import Exchanges, exchanges_of

#: The sweep that all threads sort together
PARTITIONED = "partitioned_sweep"

#: How it sorts, for readers
BLOCKS = "blocks, changes kept by each thread"

#: Sweeps as one would first write them (`src/laboratory/obvious_sweeps.f90`) -> how they sort
OBVIOUS = {
    "odd_even_sweep": "single ends, a barrier per pass",
    "locked_sweep": "blocks, a lock on the shared list",
    "mended_sweep": "blocks, one thread repairs the borders",
}

#: Finder -> phases whose work threads share
SHARED = {PARTITIONED: ("structure",), TREE: ("structure", "search", "filter")}

#: Finder -> counts of a step, for each of which threads fetch what another core has written
FETCHED: dict[str, tuple[str, ...]] = {PARTITIONED: ("boxes",), TREE: ("boxes", "searches")}

#: All phases of a finder but waiting
WORKING = ("structure", "search", "filter", "order", "merge")

#: Barriers of the tree in a step; passes of the sweep where none were counted
TREE_BARRIERS, USUAL_PASSES = 3, 2.0

#: Time in which the tree expects to repair and to search for one box that left its leaf, in comparisons of candidates
#: (`src/neighbours/finders/quadtree/quadtree.f90`)
MOVE_COST, SEARCH_COST = 500, 1600

#: Most threads for which the model is asked
MOST_THREADS = 256


@dataclass(frozen=True)
class Waiting:
    """Cost of waiting on a machine: threads -> seconds, as measured, and between and beyond by straight lines."""

    barrier: dict
    region: dict

    def of(self, which: str, threads: int) -> float:
        """Cost of a barrier or of a region with so many threads [s]; NaN if none was measured."""
        known = sorted(getattr(self, which).items())
        if threads == 1:
            return 0.0
        if not known:
            return np.nan
        counts, costs = (np.array(each, dtype=float) for each in zip(*known))
        if threads <= counts[-1]:
            return float(np.interp(threads, counts, costs))
        slope = np.polyfit(counts, costs, 1)[0] if len(counts) > 1 else costs[0] / counts[0]
        return float(costs[-1] + max(0.0, slope) * (threads - counts[-1]))


@dataclass(frozen=True)
class Split:
    """Time of a step on one thread [s]: work that threads share, and the rest."""

    shared: float
    rest: float
    #: Phase -> its time
    parts: dict[str, float]


@dataclass(frozen=True)
class Prediction:
    """Time of a step by the model, in its parts [s]."""

    #: What one thread does alone, and the mean work of the threads
    rest: float
    work: float
    #: What waiting itself costs; how much more than the mean the part with most works; what other cores have written
    waits: float
    uneven: float = 0.0
    fetched: float = 0.0

    @property
    def total(self) -> float:
        """Time of a step [s]."""
        return self.rest + self.work + self.waits + self.uneven + self.fetched

    @property
    def waiting(self) -> float:
        """Mean time in which a thread does not work [s]."""
        return self.waits + self.uneven


@dataclass
class Contest:
    """The sweep and the tree on one scene, with all numbers of threads that were measured."""

    sweep: dict[int, Case]
    tree: dict[int, Case]
    waiting: Waiting
    #: Exchanges in the parts of the sweep, if the trace is there
    parts: Exchanges | None = None
    #: Part of the shared work of the sweep on one thread that exchanges are; the rest are ends
    exchanging: float = 0.0
    #: Part of the structure of the tree on one thread that repair is; the rest finds boxes that left their leaf
    repairing: float = 0.0
    #: Finder -> costs of fetching, as FETCHED names them [s]
    fetch: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def one(self) -> Case:
        """The sweep on one thread."""
        return self.sweep[1]

    @cached_property
    def splits(self) -> dict[str, Split]:
        """Finder -> shared work and rest on one thread."""
        return {finder: split_of(self.cases(finder)[1]) for finder in FETCHED}

    @property
    def exchanges(self) -> float:
        """Exchanges of ends per box and step: how much moves."""
        return self.one.count("swaps") / self.one.boxes

    @property
    def threads(self) -> list[int]:
        """Numbers of threads that both were measured with."""
        return sorted(set(self.sweep) & set(self.tree))

    @property
    def free_threads(self) -> list[int]:
        """Those with a processor for each thread."""
        return [n for n in self.threads if n == 1 or n <= int(self.sweep[n].provenance.get("processors", n))]

    def passes(self, threads: int) -> float:
        """Passes of the sweep in a step; those of most threads stand for more."""
        if threads == 1:
            return 1.0
        counted = {n: case.count("passes") for n, case in self.sweep.items() if n > 1}
        near = max((n for n in counted if n <= threads and counted[n] > 0.0), default=None)
        return counted[near] if near else USUAL_PASSES

    def unevenness(self, threads: int) -> float:
        """Work of the part with most over the mean of the parts; 1 if it is not known."""
        if self.parts is None:
            return 1.0
        return 1.0 - self.exchanging + self.exchanging * self.parts.unevenness(threads)

    def predict(self, finder: str, threads: int) -> Prediction:
        """Time of a step by the model, in its parts."""
        split = self.splits[finder]
        work = split.shared / threads
        if threads == 1:
            return Prediction(split.rest, work, 0.0)
        barrier, region = (self.waiting.of(which, threads) for which in ("barrier", "region"))
        if finder == PARTITIONED:
            barriers, uneven = self.passes(threads), work * (self.unevenness(threads) - 1.0)
        else:
            barriers, uneven = TREE_BARRIERS, self.wait_for_first(threads)
        fetched = float(self.foreign(finder, threads) @ self.fetch[finder]) if finder in self.fetch else 0.0
        return Prediction(split.rest, work, barriers * barrier + region, uneven, fetched)

    def wait_for_first(self, threads: int) -> float:
        """Time by which the first thread of the tree takes longer than its share, with repair and search alone [s]."""
        parts = self.splits[TREE].parts
        alone = self.repairing * parts["structure"]
        together = alone + parts["filter"]
        if self.first_searches(threads):
            alone, together = alone + parts["search"], together + parts["search"]
        return max(0.0, alone - together / threads)

    def first_searches(self, threads: int) -> bool:
        """Whether so few boxes leave their leaf in a step that the first thread searches for all of them."""
        one = self.tree[1]
        share = one.count("candidates") / (threads - 1)
        return bool(one.count("left_leaf") <= share / (MOVE_COST + SEARCH_COST))

    def foreign(self, finder: str, threads: int) -> np.ndarray:
        """How many of what FETCHED names a thread finds written by another core in a step."""
        one = self.cases(finder)[1]
        counts = [one.boxes if name == "boxes" else np.nan_to_num(one.count(name)) for name in FETCHED[finder]]
        return np.array(counts, dtype=float) * (threads - 1) / threads**2

    def cases(self, finder: str) -> dict[int, Case]:
        """Number of threads -> case of a finder."""
        return self.sweep if finder == PARTITIONED else self.tree

    def model(self, finder: str, threads: int) -> float:
        """Predicted time of a step [s]."""
        return float(self.predict(finder, threads).total)

    def measured(self, finder: str, threads: int) -> Estimate:
        """Measured time of a step [s]."""
        case = self.cases(finder)[threads]
        return median([1e-9 * case.boxes * value for value in of_one_bench(series.elapsed_time(case))])

    def beyond_model(self, finder: str, threads: int) -> float:
        """Measured time over that of the model."""
        return self.measured(finder, threads).value / self.model(finder, threads)

    def speed_up(self, finder: str) -> Estimate:
        """How much faster the most threads are than one, not more threads than there are processors."""
        cases, most = self.cases(finder), self.free_threads[-1]
        return series.ratio(cases[1], cases[most], series.elapsed_time)

    def ratio(self, threads: int) -> Estimate:
        """Measured time of the sweep over that of the tree with as many threads."""
        return series.ratio(self.sweep[threads], self.tree[threads], series.elapsed_time)

    def waiting_per_pass(self, threads: int) -> Estimate:
        """Measured waiting of a thread in a pass [s]."""
        case = self.sweep[threads]
        waits = of_one_bench(case.phase("waiting"))
        return median([1e-9 * case.boxes * value / self.passes(threads) for value in waits])

    def work_per_part(self, threads: int) -> float:
        """Mean work of a part in a pass, by the model [s]."""
        step = self.predict(PARTITIONED, threads)
        return (step.work + step.fetched) / self.passes(threads)

    @property
    def has_model(self) -> bool:
        """Whether the samples say what waiting costs."""
        return bool(np.isfinite(self.model(PARTITIONED, self.threads[-1])))

    def loses_at(self) -> int | None:
        """Least number of threads with which the model says that the sweep takes as long as the tree."""
        return next((n for n in range(1, MOST_THREADS + 1)
                     if self.model(PARTITIONED, n) >= self.model(TREE, n)), None)

    def nearest_to_lose(self) -> tuple[float, int]:
        """Greatest time of the sweep over that of the tree with several threads by the model, and their number."""
        return max((self.model(PARTITIONED, n) / self.model(TREE, n), n) for n in range(2, MOST_THREADS + 1))

    def seen_to_lose_at(self) -> int | None:
        """Least measured number of threads with which the sweep takes as long as the tree."""
        return next((n for n in self.threads if self.ratio(n).value >= 1.0), None)

    def best_threads(self) -> int | None:
        """Number of threads beyond which the model says that more of them make the sweep slower."""
        times = [self.model(PARTITIONED, n) for n in range(1, MOST_THREADS + 1)]
        return 1 + int(np.argmin(times)) if np.all(np.isfinite(times)) else None


def split_of(case: Case) -> Split:
    """Shared work and rest of a step on one thread, by elapsed time in the proportion of the phases."""
    whole = 1e-9 * case.boxes * typical(series.elapsed_time(case)).value
    parts = {name: typical(case.phase(name)).value for name in WORKING}
    parts = {name: whole * value / sum(parts.values()) for name, value in parts.items()}
    shared = sum(parts[name] for name in SHARED[case.finder])
    return Split(shared, whole - shared, parts)


def waiting_of(bench: Bench) -> Waiting:
    """The cost of waiting, as the samples of a bench have it."""
    found: dict = {"barrier": {}, "region": {}}
    for case in bench.select():
        if case.threads > int(case.provenance.get("processors", case.threads)):
            continue
        for which, values in found.items():
            costs = [float(sample.case.get(f"{which}_cost", 0.0)) for sample in case.samples]
            values.setdefault(case.threads, []).extend(cost for cost in costs if cost > 0.0)
    return Waiting(*({n: float(np.median(costs)) for n, costs in values.items() if costs}
                     for values in found.values()))


def contests(bench: Bench) -> list[Contest]:
    """All scenes on which both were measured with one thread and with more, in order of size and motion."""
    waiting, found = waiting_of(bench), []
    for scene in dict.fromkeys(case.scene for case in bench.select(mode="replay", finder=PARTITIONED)):
        sweep, tree = ({case.threads: case for case in bench.select(mode="replay", finder=finder, scene=scene)
                        if case.time()} for finder in (PARTITIONED, TREE))
        contest = Contest(sweep, tree, waiting)
        if 1 in contest.threads and len(contest.threads) > 1:
            contest.parts = exchanges_of(contest.one, MOST_THREADS)
            found.append(contest)
    for boxes in {contest.one.boxes for contest in found}:
        same_size = [contest for contest in found if contest.one.boxes == boxes]
        for contest, part in zip(same_size, growing_parts([contest.one for contest in same_size], "swaps")):
            contest.exchanging = part
        for contest, part in zip(same_size, growing_parts([contest.tree[1] for contest in same_size], "left_leaf")):
            contest.repairing = part
    for finder in FETCHED:
        set_fetch(found, finder)
    return sorted(found, key=lambda each: (each.one.boxes, each.exchanges))


def growing_parts(cases: list[Case], counted: str) -> list[float]:
    """Part of the phase `structure` of each case that grows with a count, by one line for cases of one size."""
    steps = [points for case in cases if len(points := steps_of(case, counted))]
    counts, seconds = np.concatenate(steps).T if steps else (np.zeros(0), np.zeros(0))
    if len(counts) < 2 or np.ptp(counts) == 0.0:
        return [0.0] * len(cases)
    slope, constant = np.maximum(np.polyfit(counts, seconds, 1), 0.0)
    growing = [slope * case.count(counted) for case in cases]
    return [float(each / (each + constant)) if each > 0.0 else 0.0 for each in growing]


def steps_of(case: Case, counted: str) -> np.ndarray:
    """(count, seconds of the phase `structure`) of the steps but the first, medians over repeats."""
    counts = next((sample.counts[counted] for sample in case.samples if counted in sample.counts), np.empty(0))
    times = [sample.phases["structure"] for sample in case.samples
             if sample.repeat >= 1 and "structure" in sample.phases]
    if not times or any(len(each) != len(counts) for each in times):
        return np.empty((0, 2))
    return np.column_stack([counts, np.median(times, axis=0)])[1:]


def set_fetch(found: list[Contest], finder: str) -> None:
    """Fit what fetching costs a finder on all scenes to the samples on the fewest several threads."""
    rows, lacking = [], []
    for contest in found:
        several = contest.free_threads[1:]
        if several and np.isfinite(contest.model(finder, several[0])):
            seconds = contest.measured(finder, several[0]).value
            rows.append(contest.foreign(finder, several[0]) / seconds)
            lacking.append(1.0 - contest.model(finder, several[0]) / seconds)
    if rows:
        costs = not_negative(np.array(rows), np.array(lacking))
        for contest in found:
            contest.fetch[finder] = costs


def not_negative(rows: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Least squares with no negative number; of equally good ones that with fewest numbers."""
    columns = rows.shape[1]
    best, least = np.zeros(columns), float(values @ values)
    for size in range(1, columns + 1):
        for chosen in map(list, combinations(range(columns), size)):
            solved = np.linalg.lstsq(rows[:, chosen], values, rcond=None)[0]
            off = float(np.sum((rows[:, chosen] @ solved - values) ** 2))
            if solved.min() >= 0.0 and off < least * (1.0 - 1e-9):
                best, least = np.zeros(columns), off
                best[chosen] = solved
    return best
