"""Rules for claims about times: C1 to C4, C6, C10, C13, C18."""

from __future__ import annotations

import numpy as np

from ..bench import paper, series
from ..bench.samples import Bench
from ..bench.series import SWEEP, TREE
from ..bench.statistics import median, number, of_one_bench, pooled, ratio_of_means, ratio_of_medians, some
from ..costs.cache import read_records
from ..tables.paper_tables import clock_of
from .verdicts import NOT_TESTABLE, Elsewhere, Finding, Missing, Part, claim, in_parts, needed, of_parts, word

#: How far from 1 a ratio of times is before it is a gain or a loss: less cannot be told from what moving the code in
#: memory changes
NO_CHANGE = 0.1

#: What has to be run for the drums of all sizes
DRUMS = "./polydem bench on drums of at least three sizes, one thread, finders "


def _series(bench: Bench, finder: str, mode: str = "replay") -> list:
    return needed(series.over_size(bench.on(), finder, mode=mode), DRUMS + f"'{finder}'")


def _law(bench: Bench, finder: str, quantity=series.total_time) -> series.Law:
    return needed(series.law(_series(bench, finder), quantity), DRUMS + f"'{finder}'")


def _pairs(bench: Bench, upper: str = TREE, lower: str = SWEEP, mode: str = "replay", paper_sizes: bool = True) -> list:
    """Cases of two finders side by side, on the drums of the paper's sizes."""
    both = series.pairs_of(_series(bench, upper, mode), _series(bench, lower, mode))
    low, high = paper.SIZES
    return needed(
        [pair for pair in both if not paper_sizes or 0.9 * low <= pair[0].boxes <= 1.1 * high],
        DRUMS + f"'{upper}', '{lower}'",
    )


@claim(
    "C1",
    "Both algorithms are O(N) per step",
    "slopes 0.992 (sweep), 0.994 (tree), making of the boxes included",
    "both slopes over the paper's own sizes within 1.00 +- 0.05, intervals (which know how well a power law fits) "
    "included; times of whole steps with the making of the boxes, as in the paper's Fig. 9, or of the replay if whole "
    "steps of fewer than three of these sizes were measured; larger sizes are told apart",
    "figure_09_total, finders_over_size, local_exponents, slopes",
)
def linear(bench: Bench) -> Finding:
    parts, reasons = [], []
    for finder, name in ((SWEEP, "sweep"), (TREE, "tree")):
        replayed, whole = _series(bench, finder), series.whole_steps(bench.on(), finder)
        law = needed(series.law_of_paper(whole or replayed), DRUMS + f"'{finder}', sizes between those of the paper")
        told = [f"{finder} {law.exponent.text()}"]
        without, beyond = series.law_of_paper(replayed), series.law_beyond(replayed)
        if whole and without:
            told.append(f"without the boxes {without.exponent.text()}")
        if beyond:
            told.append(f"{beyond.sizes[0]:.0f} to {beyond.sizes[-1]:.0f} boxes {beyond.exponent.text()}")
        parts.append(Part(f"the {name} is O(N)", law.exponent.within(0.95, 1.05), ", ".join(told)))
        if parts[-1].holds is not True:
            reasons.append(_growth_of_work(bench, finder))
    if reasons:
        reasons.insert(0, GROWTH)
    return in_parts(parts, " ".join(reasons))


#: Why times of a drum grow faster than its size
GROWTH = (
    "Expected at the paper's constant rate of rotation: speeds grow as N^0.5, and ends of boxes lie N^0.5 times as "
    "dense along an axis, so exchanges grow as N^2 (N^1.5 at one speed) and leaf changes as N^1.5 (N)."
)


def _growth_of_work(bench: Bench, finder: str) -> str:
    """Exponents of what a finder does per step in the drums, and of its time where speeds do not grow with size."""
    counted = {name: series.count_slope(_series(bench, finder), name) for name in ("tests", "swaps", "leaf_changes")}
    told = ", ".join(f"{name.replace('_', ' ')} {number(value)}" for name, value in counted.items()
                     if np.isfinite(value))
    even = series.law(series.over_size(bench.on(), finder, of_kind="even"))
    return (
        f"{finder}: counted exponents {told or 'none'}"
        + (f"; exponent of the time in a gas of one speed {even.exponent.text()}." if even else ".")
    )


@claim(
    "C2",
    "The tree takes about 0.9 of the time of the sweep",
    "0.9 for 2522 to 12651 boxes",
    "geometric mean of the ratios over the drums of these sizes within 0.8 to 1.0, interval included; times as for C1: "
    "of whole steps with the making of the boxes, as in the paper's Fig. 9, or of the replay; larger drums are told "
    "apart, of the replay",
    "figure_09_total",
)
def total_ratio(bench: Bench) -> Finding:
    replayed = _pairs(bench)
    whole = series.pairs_of(*(series.whole_steps(bench.on(), finder) for finder in (TREE, SWEEP)))
    ratio, without = series.pooled_ratio(whole or replayed), series.pooled_ratio(replayed)
    each = ", ".join(f"{tree.boxes}: {series.ratio(tree, sweep).text()}" for tree, sweep in whole or replayed)
    of = "Whole steps, with the making of the boxes" if whole else "Replay, without the making of the boxes"
    reason = f"{of}. By size: {each}." + (f" Replay, without the making of the boxes: {without.text()}." if whole
                                          else "")
    larger = [pair for pair in _pairs(bench, paper_sizes=False) if pair[0].boxes > 1.1 * paper.SIZES[1]]
    told = ", ".join(f"{tree.boxes} boxes {number(series.ratio(tree, sweep).value, 2)}" for tree, sweep in larger)
    ours = ratio.text() + (f"; larger drums (below 1 the tree wins): {told}" if told else "")
    return Finding(of_parts([ratio.within(0.8, 1.0)]), ours, reason)


@claim(
    "C3",
    "Updating the structure alone takes the tree 0.1 of the time of the sweep",
    "0.1; slopes 1.43 (sweep), 1.39 (tree)",
    "geometric mean of the ratios within 0.05 to 0.2, and both slopes at the paper's sizes within 0.1 of the paper's, "
    "intervals included",
    "figure_10_update, phases",
)
def update_ratio(bench: Bench) -> Finding:
    both = needed([pair for pair in _pairs(bench) if all(map(series.structure_time, pair))], DRUMS + "with phases")
    ratio = series.pooled_ratio(both, series.structure_time)
    parts = [Part("the tree takes 0.1 of the time of the sweep", ratio.within(0.05, 0.2), ratio.text())]
    for finder, name in ((SWEEP, "sweep"), (TREE, "tree")):
        law = series.law_of_paper(_series(bench, finder), series.structure_time)
        whole = _law(bench, finder, series.structure_time)
        if law is None:
            raise Missing(DRUMS + f"'{finder}', sizes between those of the paper")
        said = paper.UPDATE_SLOPE[finder]
        parts.append(Part(f"slope of the {name} {said:g}", law.exponent.within(said - 0.1, said + 0.1),
                          f"{law.exponent.text()} (all sizes {whole.exponent.text()})"))
    told = [word(part.holds) for part in parts]
    return in_parts(parts, f"As said: ratio {told[0]}, slope of the sweep {told[1]}, of the tree {told[2]}.")


@claim(
    "C4",
    "Most of the time of the tree goes into the list of pairs",
    "about 80 %",
    "share of search, filter, order and merge within 0.7 to 0.9, interval included, geometric mean over the drums "
    "of the "
    "paper's sizes",
    "phases",
)
def list_share(bench: Bench) -> Finding:
    shares = [{key[1]: value for key, value in series.list_share(tree).items()} for tree, _ in _pairs(bench)]
    share = needed(pooled(shares), DRUMS + "with phases")
    return Finding(
        of_parts([share.within(0.7, 0.9)]),
        share.text(),
        "All but the structure; our tree keeps possible pairs from step to step and compares all of them at "
        "every step.",
    )


@claim(
    "C6",
    "Inlining the traversal brings nothing, or harm, below about 5000 boxes, and helps beyond about 10000",
    "slopes 0.994 (inlined), 1.1 (not)",
    "geometric means of inlined / not inlined: at least 0.9 over the drums below 5000 boxes (no gain), less than 0.9 "
    "over those beyond 10000, intervals included; a gain is 10 % as in C18",
    "figure_11_inlining",
)
def inlining(bench: Bench) -> Finding:
    both = _pairs(bench, TREE, "quadtree_called", paper_sizes=False)
    small = series.pooled_ratio([pair for pair in both if pair[0].boxes < paper.INLINING_HURTS_BELOW])
    large = series.pooled_ratio([pair for pair in both if pair[0].boxes > paper.INLINING_HELPS_BEYOND])
    if not small or not large:
        raise Missing(DRUMS + "'quadtree', 'quadtree_called' with sizes below 5000 and beyond 10000")
    parts = [Part("below 5000 boxes it brings nothing, or harm", small.at_least(1.0 - NO_CHANGE), small.text()),
             Part("beyond 10000 boxes it helps", large.below(1.0 - NO_CHANGE), large.text())]
    told = [word(part.holds) for part in parts]
    slopes = [series.law_of_paper(_series(bench, finder)) for finder in (TREE, "quadtree_called")]
    fitted = "; ".join(f"slope {law.exponent.text()} ({name})" for law, name in zip(slopes, ("inlined", "not")) if law)
    ratios = ", ".join(f"{a.boxes}: {series.ratio(a, b).text()}" for a, b in both)
    return in_parts(
        parts, f"As said: no gain below 5000 {told[0]}, gain beyond 10000 {told[1]}. {fitted[:1].upper()}{fitted[1:]}. "
        f"By size: {ratios}.")


@claim(
    "C10",
    "Memory matters more than the clock",
    "2.4 GHz with DDR4 beats 3.3 GHz with DDR3",
    "of two machines the one with the lower clock is faster on the same drums: ratio of the geometric means of their "
    "times below 1, interval included",
    "figure_08_13_machines, table_1",
)
def memory(bench: Bench) -> Finding:
    machines = bench.named("machine")
    if len(machines) < 2:
        raise Elsewhere("the samples of a second machine: ./polydem paper --other DIR")
    times = {
        machine: {
            (case.boxes, case.making): of_one_bench(case.time())
            for case in series.over_size(bench.on(machine), TREE)
            if case.time()
        }
        for machine in machines
    }
    shared = sorted(set.intersection(*(set(each) for each in times.values())))
    needed(shared, "the same drums with 'quadtree' on all machines")
    mean = {
        machine: float(np.exp(np.mean([np.log(np.median(times[machine][drum])) for drum in shared])))
        for machine in machines
    }
    clocks = {machine: clock_of(bench.provenance(machine)) for machine in machines}
    ours = "; ".join(f"{machine} ({clocks[machine]} GHz): {number(mean[machine])} ns/box" for machine in machines)
    if any(clock == "-" for clock in clocks.values()):
        return Finding(
            NOT_TESTABLE,
            ours,
            "Not all machines state their clock; take machines that do, and differ in clock and memory.",
        )
    pairs = [(a, b) for a in machines for b in machines if float(clocks[a]) < float(clocks[b])]
    if not pairs:
        return Finding(NOT_TESTABLE, ours, "All have one clock; take machines that differ in it.")
    ratios = [ratio_of_means(*([times[each][drum] for drum in shared] for each in pair)) for pair in pairs]
    wins = [ratio.below(1.0) for ratio in ratios]
    told = ", ".join(f"{a} / {b} {ratio.text()}" for (a, b), ratio in zip(pairs, ratios))
    won = f"{wins.count(True)} of {len(pairs)}"
    return Finding(of_parts(wins), ours, f"The lower clock won in {won} comparisons: {told}.")


@claim(
    "C13",
    "Times rise above the trend where the data outgrow a cache",
    "near 5000 boxes",
    "time of the quadtree to compare one candidate (the same work at every size) at least 10 % greater where the "
    "data outgrow a level (twice its bytes or more, as far as the next level) than where they fit into it, interval of "
    "the ratio included, for at least one level",
    "figure_11_inlining, cache_misses",
)
def caches(bench: Bench) -> Finding:
    cases = [case for case in _series(bench, TREE) if np.isfinite(series.held_bytes(case)) and _time_per_test(case)]
    levels = needed(
        series.cache_levels(cases[0].provenance) if cases else [], DRUMS + "'quadtree', with bytes and caches"
    )
    ends = [size for _, size in levels[1:]] + [np.inf]
    found, rises = [], []
    for (name, size), end in zip(levels, ends):
        inside = [case for case in cases if 0.5 * size >= series.held_bytes(case)]
        beyond = [case for case in cases if 2.0 * size <= series.held_bytes(case) <= max(end, 4.0 * size)]
        if not inside or not beyond:
            continue
        below, above = (of_one_bench(_time_per_test(group[-1])) for group in (inside, beyond))
        rise = ratio_of_medians(above, below)
        rises.append(rise.at_least(1.1))
        found.append(
            f"{name}: {inside[-1].boxes} boxes {median(below).text()}, {beyond[-1].boxes} boxes "
            f"{median(above).text()} ns "
            f"per test, ratio {rise.text()}"
        )
    if not found:
        raise Missing(DRUMS + "'quadtree', of which some fit into half a level of the caches and others take twice "
                      "that level")
    misses = [r for r in series.records_of(bench, read_records(bench.folders), "drum") if r.finder == TREE]
    told = ", ".join(f"{r.boxes}: {number(r.last_level)}" for r in misses)
    return Finding(
        of_parts([some(rises)]),
        "; ".join(found),
        f"Rises at {rises.count(True)} of {len(rises)} levels, undecided at {rises.count(None)}."
        + (f" Simulated last-level misses per box: {told}." if told else ""),
    )


def _time_per_test(case) -> dict:
    """Repeat -> time to compare a candidate [ns]."""
    tests = case.count("tests") / case.boxes
    return {key: value / tests for key, value in case.phase("filter").items()} if tests > 0.0 else {}


@claim(
    "C18",
    "-O3 brings nothing over -O2",
    "no significant change",
    "geometric mean of the ratios -O3 / -O2 over the drums within 0.9 to 1.1, interval included, for tree and sweep: "
    "less cannot be told from what moving the code in memory changes",
    "times",
)
def optimisation(bench: Bench) -> Finding:
    parts = []
    for finder, name in ((SWEEP, "sweep"), (TREE, "tree")):
        both = series.pairs_of(series.over_size(bench, finder), series.over_size(bench, f"{finder}_o2"))
        needed(both, DRUMS + f"'{finder}' and '{finder}_o2'")
        mean = series.pooled_ratio(both)
        parts.append(Part(f"nothing for the {name}", mean.within(1.0 - NO_CHANGE, 1.0 + NO_CHANGE), mean.text()))
    reason = "-O3 over -O2 of the sources of the finder alone; the paper compares whole runs, of which this is a part."
    return in_parts(parts, reason)
