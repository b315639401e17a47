"""The fine-grained parallel sweep beside the tree: its waiting per pass against its work per part, and who wins.

The model has no fitted number. From samples on one thread come the work that threads share and the rest; from the
machine, measured beside the samples, the cost of a barrier and of starting threads. With n threads

    sweep:  rest + work/n + passes barrier(n) + region(n)
    tree:   rest + work/n + regions region(n)

where all threads of the sweep meet after every pass, and the tree has three parallel regions in a step, none of which
waits for another thread in its middle. The repair of the tree is no shared work: one thread does it. The model is a
lower bound: what it leaves out (boxes that another core has written, parts of unequal work, other processes) only adds
time, and the tables say how much.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import series
from .bench import Bench, Case
from .emit import Table
from .series import TREE
from .statistics import Estimate, median, number, of_one_bench, typical

#: The sweep that all threads sort together
PARTITIONED = "partitioned_sweep"

#: Finder -> phases whose work threads share
SHARED = {PARTITIONED: ("structure",), TREE: ("search", "filter")}

#: All phases of a finder but waiting
WORKING = ("structure", "search", "filter", "order", "merge")

#: Parallel regions of the tree in a step; passes of the sweep where none were counted
TREE_REGIONS, USUAL_PASSES = 3, 2.0

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


@dataclass
class Contest:
    """The sweep and the tree on one scene, with all numbers of threads that were measured."""

    sweep: dict[int, Case]
    tree: dict[int, Case]
    waiting: Waiting

    @property
    def one(self) -> Case:
        """The sweep on one thread."""
        return self.sweep[1]

    @property
    def exchanges(self) -> float:
        """Exchanges of ends per box and step: how much moves."""
        return self.one.count("swaps") / self.one.boxes

    @property
    def threads(self) -> list[int]:
        """Numbers of threads that both were measured with."""
        return sorted(set(self.sweep) & set(self.tree))

    def passes(self, threads: int) -> float:
        """Passes of the sweep in a step; those of most threads stand for more."""
        if threads == 1:
            return 1.0
        counted = {n: case.count("passes") for n, case in self.sweep.items() if n > 1}
        near = max((n for n in counted if n <= threads and counted[n] > 0.0), default=None)
        return counted[near] if near else USUAL_PASSES

    def model(self, finder: str, threads: int) -> float:
        """Predicted time of a step [s]."""
        split = split_of(self.sweep[1] if finder == PARTITIONED else self.tree[1])
        barrier, region = (self.waiting.of(which, threads) for which in ("barrier", "region"))
        waits = self.passes(threads) * barrier + region if finder == PARTITIONED else TREE_REGIONS * region
        return split.rest + split.shared / threads + waits * (threads > 1)

    def measured(self, finder: str, threads: int) -> Estimate:
        """Measured time of a step [s]."""
        case = (self.sweep if finder == PARTITIONED else self.tree)[threads]
        return median([1e-9 * case.boxes * value for value in of_one_bench(series.elapsed_time(case))])

    def beyond_model(self, finder: str, threads: int) -> float:
        """Measured time over that of the model."""
        return self.measured(finder, threads).value / self.model(finder, threads)

    def speed_up(self, finder: str) -> Estimate:
        """How much faster the most threads are than one, not more threads than there are processors."""
        cases = self.sweep if finder == PARTITIONED else self.tree
        most = max(n for n in self.threads if n == 1 or n <= int(cases[n].provenance.get("processors", n)))
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
        """Work of one part in one pass, from one thread [s]."""
        return split_of(self.one).shared / threads / self.passes(threads)

    @property
    def has_model(self) -> bool:
        """Whether the samples say what waiting costs."""
        return bool(np.isfinite(self.model(PARTITIONED, self.threads[-1])))

    def loses_at(self) -> int | None:
        """Least number of threads with which the model says that the sweep takes as long as the tree."""
        return next((n for n in range(1, MOST_THREADS + 1)
                     if self.model(PARTITIONED, n) >= self.model(TREE, n)), None)

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
    share = sum(parts[name] for name in SHARED[case.finder]) / sum(parts.values())
    return Split(share * whole, (1.0 - share) * whole)


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
            found.append(contest)
    return sorted(found, key=lambda each: (each.one.boxes, each.exchanges))


def fine_grained_tables(bench: Bench) -> list[Table]:
    """The model beside the measurement, and where the sweep loses."""
    found = contests(bench)
    return [times_table(found), limits_table(found), waiting_table(bench)] if found else []


def _micro(seconds: float) -> str:
    return number(1e6 * seconds)


def _micros(estimate: Estimate) -> str:
    return Estimate(1e6 * estimate.value, 1e6 * estimate.low, 1e6 * estimate.high).text()


def times_table(found: list[Contest]) -> Table:
    """Measured and predicted times of a step."""
    table = Table(
        "fine_grained", "Fine-grained sweep against parallel tree: time of a step [us]",
        ("scene", "boxes", "exchanges per box", "threads", "sweep", "measured / model", "tree", "measured / model",
         "sweep / tree", "model", "passes", "work per part and pass", "waiting per pass", "barrier"),
    )
    for contest in found:
        for n in contest.threads:
            sweep, tree = contest.model(PARTITIONED, n), contest.model(TREE, n)
            table.add(
                contest.one.scene, contest.one.boxes, number(contest.exchanges), n,
                _micros(contest.measured(PARTITIONED, n)), number(contest.beyond_model(PARTITIONED, n)),
                _micros(contest.measured(TREE, n)), number(contest.beyond_model(TREE, n)), contest.ratio(n).text(),
                number(sweep / tree), number(contest.passes(n), 2),
                _micro(contest.work_per_part(n)), _micros(contest.waiting_per_pass(n)) if n > 1 else "-",
                _micro(contest.waiting.of("barrier", n)) if n > 1 else "-",
            )
    table.note = (
        "Model: rest + work / threads + what waiting costs on this machine (table waiting), from samples on one "
        "thread; a lower bound, since it knows nothing of boxes that another core has written, parts of unequal work "
        "and other processes. Waiting per pass: mean time in which a thread of the sweep does not work."
    )
    return table


def limits_table(found: list[Contest]) -> Table:
    """With how many threads the sweep loses to the tree."""
    table = Table(
        "fine_grained_limits", "With how many threads the fine-grained sweep loses to the tree",
        ("scene", "boxes", "exchanges per box", "loses from, model", "loses from, measured", "measured up to",
         "agree", "best number of threads for the sweep, model"),
    )
    for contest in found:
        model, seen, most = contest.loses_at(), contest.seen_to_lose_at(), contest.threads[-1]
        predicted = model or f"not to {MOST_THREADS}" if contest.has_model else "-"
        table.add(contest.one.scene, contest.one.boxes, number(contest.exchanges), predicted,
                  seen or f"not to {most}", most, agreement(contest), contest.best_threads() or "-")
    table.note = (
        "Agree: model and measurement name the same winner with every measured number of threads; undecided where the "
        "interval of the measured ratio holds 1."
    )
    return table


def agreement(contest: Contest) -> str:
    """Whether the model names the winner that was measured: 3 of 3, 1 undecided."""
    if not contest.has_model:
        return "-"
    right, open_ones = 0, 0
    for n in contest.threads:
        won = contest.ratio(n).at_least(1.0)
        predicted = contest.model(PARTITIONED, n) >= contest.model(TREE, n)
        right += won is predicted
        open_ones += won is None
    text = f"{right} of {len(contest.threads) - open_ones}"
    return f"{text}, {open_ones} undecided" if open_ones else text


def waiting_table(bench: Bench) -> Table:
    """What waiting costs on this machine."""
    waiting = waiting_of(bench)
    table = Table("waiting", "Cost of waiting on this machine [us]", ("threads", "barrier", "start and join threads"))
    for n in sorted(waiting.barrier):
        table.add(n, _micro(waiting.barrier[n]), _micro(waiting.region.get(n, np.nan)))
    table.note = "Medians of what was measured just before each sample: 15 batches of 20 barriers and 20 empty regions."
    return table
