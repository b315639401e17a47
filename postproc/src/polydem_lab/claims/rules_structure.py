"""Rules for claims about structures and counts: C5, C7, C8, C15, C16, C17."""

from __future__ import annotations

import numpy as np

from ..bench import paper, series
from ..bench.samples import Bench
from ..bench.scene_kinds import rates_of_walls
from ..bench.series import SWEEP, TREE
from ..bench.statistics import NOTHING, every, number
from ..costs import complexity
from ..fine_grained.model import BLOCKS, MOST_THREADS, OBVIOUS, PARTITIONED, contests
from ..tables.bench_tables import visits_per_search
from ..tables.fine_grained_tables import error_told
from .verdicts import CONFIRMED, CONTRADICTED, Finding, Missing, Part, claim, in_parts, needed, of_parts, said, word

#: Stands for a gain by threads on a machine that had more to do than it has processors
TOO_BUSY = "the machine was too busy"

#: Begins what claim C5 says of each fine-grained sweep
FAILS = "it fails: "


@claim(
    "C5",
    "The fine-grained parallel sweep fails; one axis per thread and the tree's list can be parallelised",
    "no numbers",
    "elapsed time on the drums of the paper's sizes with the most threads of which there are processors, against "
    "one thread: a fine-grained sweep on none faster than sort_and_sweep; on the largest sort_and_sweep (two threads) "
    "and quadtree at least 1.2 times as fast; intervals included; larger drums are told apart",
    "speed_up, fine_grained, fine_grained_gains, fine_grained_error, fine_grained_limits",
)
def parallel(bench: Bench) -> Finding:
    here = bench.on()
    gains = {finder: _gains(here, finder) for finder in (PARTITIONED, *OBVIOUS, SWEEP, TREE)}
    of_paper = {finder: {boxes: gain for boxes, (_, gain) in found.items() if boxes <= 1.1 * paper.SIZES[1]}
                for finder, found in gains.items()}
    for finder in (PARTITIONED, SWEEP, TREE):
        needed(of_paper[finder],
               f"./polydem bench on drums of the paper's sizes with '{finder}' on one and on several threads")
    parts = [Part(f"{FAILS}{what} ({finder})", every(gain.at_most(1.0) for gain in of_paper[finder].values()),
                  _told(finder, gains[finder]))
             for finder, what in {PARTITIONED: BLOCKS, **OBVIOUS}.items() if of_paper[finder]]
    for finder, what in ((SWEEP, "one axis per thread"), (TREE, "the list of the tree")):
        largest = of_paper[finder][max(of_paper[finder])]
        parts.append(Part(f"{what} can be parallelised", largest.at_least(1.2), _told(finder, gains[finder])))
    told = said(**dict(zip((*(finder for finder in (PARTITIONED, *OBVIOUS) if of_paper[finder]), "per_axis", "tree"),
                           (part.holds for part in parts))))
    return in_parts(parts, f"As said: {told}. All against sort_and_sweep or quadtree on one thread.{_limits(here)}")


def _told(finder: str, found: dict) -> str:
    """How much faster a finder is on each drum."""
    return f"{finder} " + ", ".join(f"{boxes} boxes, {threads} threads: {gain.text() if gain else TOO_BUSY}"
                                    for boxes, (threads, gain) in found.items())


def _gains(bench: Bench, finder: str) -> dict:
    """Boxes of a drum -> (most threads, not more than there are processors, how much faster than one thread).

    Fine-grained sweeps are compared with the plain one, the others with themselves.
    """
    found: dict = {}
    for case in series.cases_of(bench, "drum", finder=finder, mode="replay"):
        most = 2 if finder == SWEEP else case.threads
        one = bench.select(scene=case.scene, mode="replay", threads=1,
                           finder=SWEEP if finder in (PARTITIONED, *OBVIOUS) else finder)
        usual = rates_of_walls(case.settings) == [paper.RATE]
        if one and usual and 1 < case.threads <= min(most, int(case.provenance.get("processors", case.threads))):
            gain = NOTHING if case.is_disturbed else series.ratio(one[0], case, series.elapsed_time)
            found[case.boxes] = max(found.get(case.boxes, (0, gain)), (case.threads, gain), key=lambda each: each[0])
    return found


def _limits(bench: Bench) -> str:
    """With how many threads the partitioned sweep loses to the tree, as measured and by the model."""
    told, found = [], contests(bench)
    for contest in found:
        seen, model = contest.seen_to_lose_at(), contest.loses_at()
        predicted = f"from {model}" if model else f"not to {MOST_THREADS}" if contest.has_model else "-"
        told.append(f"{contest.one.scene} {f'from {seen}' if seen else 'not'} (model: {predicted})")
    if not told:
        return ""
    limits = f" Threads with which the partitioned sweep loses to the tree: {', '.join(told)}."
    return f"{limits} {error_told(found)}".rstrip()


@claim(
    "C7",
    "Depth of the tree and nodes reserved for it",
    "depth 9 (87381 nodes) to 5058 boxes, 10 (349525) to 12651",
    "depth equal to the paper's within one level at each of its sizes that was measured; from its two smallest to its "
    "three largest sizes the mean depth grows by one level within a half, if both were measured",
    "table_2",
)
def depth(bench: Bench) -> Finding:
    cases = [case for case in series.over_size(bench.on(), TREE) if np.isfinite(case.count("depth"))]
    rows = [(case, size) for case in cases for size in paper.DEPTH_AND_NODES if abs(case.boxes - size) <= 0.02 * size]
    needed(rows, "./polydem bench on the drums of the paper's sizes, finder 'quadtree'")
    depths = {size: (case.count("depth"), paper.DEPTH_AND_NODES[size][0]) for case, size in rows}
    ours = "; ".join(
        f"{case.boxes}: depth {number(case.count('depth'))}, {number(case.count('nodes'), 5)} nodes" for case, _ in rows
    )
    parts = [Part("levels", all(abs(ours - theirs) <= 1.0 for ours, theirs in depths.values()), ours)]
    groups = [[ours for ours, theirs in depths.values() if theirs == level] for level in (9, 10)]
    grown = float(np.mean(groups[1]) - np.mean(groups[0])) if all(groups) else np.nan
    if np.isfinite(grown):
        parts.append(Part("growth by one level", abs(grown - 1.0) <= 0.5, f"{number(grown)} levels"))
    saved = [paper.DEPTH_AND_NODES[size][1] / case.count("nodes") for case, size in rows]
    return in_parts(
        parts,
        f"Levels as said: {word(parts[0].holds)}"
        + (f"; growth as said: {word(parts[1].holds)}, by {number(grown)} levels" if len(parts) > 1 else "")
        + ". Our root is a power of two times the finest cell, so up to twice as wide as the scene: a level more. A "
        f"tree that holds only nodes in use needs {number(min(saved), 2)} to {number(max(saved), 2)} times fewer than "
        "the paper reserves.",
    )


@claim(
    "C8",
    "Complexity: the tree costs more than the sweep, about four times as much inlined, about the same not inlined",
    "70 sweep, 273 inlined, 77 not",
    "tree / sweep above 1; not inlined within 0.75 to 1.5; of the inlined tree there is no source of its own",
    "table_3, complexity",
)
def complexities(_: Bench) -> Finding:
    if complexity.counter() is None:
        raise Missing(complexity.HOW_TO_GET)
    sweep, tree = (complexity.totals(finder, complexity.SOURCES) for finder in (SWEEP, TREE))
    if not sweep or not tree:
        raise Missing(f"it beside the sources {complexity.SOURCES}")
    ratio = tree["total"] / sweep["total"]
    worst = {
        name: max(p.complexity for p in complexity.count_finder(name, complexity.SOURCES)) for name in (SWEEP, TREE)
    }
    ours = f"{sweep['total']} sweep, {tree['total']} tree: {number(ratio)}"
    parts = [Part("the tree costs more than the sweep", ratio > 1.0, ours),
             Part("about the same if not inlined", 0.75 <= ratio <= 1.5, ours)]
    return in_parts(
        parts,
        f"As said: {said(more_than_the_sweep=parts[0].holds, about_the_same_not_inlined=parts[1].holds)}. "
        "Inlined or not our tree is one source, so inlining adds no complexity to it. Greatest single procedures: "
        f"{worst[SWEEP]} (sweep), {worst[TREE]} (tree); both below the 50 that the paper quotes as untestable.",
    )


@claim(
    "C15",
    "A search costs the equal-leaf tree log N, the minimal tree a constant",
    "N log N against N",
    "visits per search from the smallest to the largest drum: of pruned_quadtree grown by at least half as much as "
    "log N, of quadtree by less than half as much",
    "list_cost, work_over_size",
)
def searches(bench: Bench) -> Finding:
    parts = []
    for finder, grows, what in (("pruned_quadtree", True, "the equal-leaf tree log N"),
                                (TREE, False, "the minimal tree a constant")):
        points = [(case.boxes, visits_per_search(case)) for case in series.over_size(bench.on(), finder)]
        points = [(boxes, visits) for boxes, visits in points if np.isfinite(visits)]
        if len(points) < 3:
            raise Missing(f"./polydem bench on drums of at least three sizes, one thread, finder '{finder}'")
        (small, few), (large, many) = points[0], points[-1]
        logarithm = np.log(large) / np.log(small) - 1.0
        grown = many / few - 1.0
        parts.append(Part(
            what, bool(grown >= 0.5 * logarithm) is grows,
            f"{finder} {number(few)} to {number(many)} visits per search ({100 * grown:+.0f} %, log N "
            f"{100 * logarithm:+.0f} %)",
        ))
    reason = (
        f"As said: {said(equal_leaves=parts[0].holds, minimal_tree=parts[1].holds)}. Both search from the lowest "
        "ancestor that holds the padded cell, on average a constant number of levels above it (H. Samet, Comput. "
        "Graph. Image Process. 18 (1982) 37); log N is the worst case, and the paper names it as such."
    )
    return in_parts(parts, reason)


@claim(
    "C16",
    "From a bad order the sweep can need N^2 at the start; sorting the centres first cures it",
    "no numbers",
    "exchanges of the first step, several sizes: exponent of unsorted_sweep at least 1.8, of sort_and_sweep at most "
    "1.6, since about N^1.5 pairs overlap along one axis and every sweep must enter them; one size: at least N^2/20 "
    "and at most a twentieth of that",
    "first_step",
)
def worst_order(bench: Bench) -> Finding:
    counts = {}
    for finder in ("unsorted_sweep", SWEEP):
        cases = series.cases_of(bench.on(), "worst", finder=finder, threads=1)
        points = {case.boxes: case.count("swaps", first=True) for case in cases}
        counts[finder] = {boxes: swaps for boxes, swaps in points.items() if np.isfinite(swaps)}
        needed(counts[finder], "./polydem bench on scenes worst_order_N, finders 'unsorted_sweep', 'sort_and_sweep'")
    bad, good = counts.values()
    if min(len(bad), len(good)) >= 2:
        bad_slope, good_slope = (
            float(np.polyfit(np.log(list(each)), np.log([max(v, 1.0) for v in each.values()]), 1)[0])
            for each in (bad, good)
        )
        parts = [Part("from a bad order it needs N^2", bad_slope >= 1.8, f"exponent {number(bad_slope)}"),
                 Part("sorting the centres cures it", good_slope <= 1.6, f"exponent {number(good_slope)}")]
        return in_parts(parts, f"Exchanges: {_listed(bad)} without; {_listed(good)} with.")
    boxes = max(set(bad) & set(good) or {max(bad)})
    parts = [bad[boxes] >= boxes**2 / 20.0, good.get(boxes, np.inf) <= bad[boxes] / 20.0]
    return Finding(
        of_parts(parts),
        f"{boxes} boxes: {number(bad[boxes], 4)} exchanges without, {number(good.get(boxes, np.nan), 4)} with",
        f"N^2 is {number(float(boxes) ** 2)}.",
    )


def _listed(counts: dict) -> str:
    return ", ".join(f"{boxes}: {number(swaps, 4)}" for boxes, swaps in counts.items())


@claim(
    "C17",
    "Most of what the sweep keeps in order concerns boxes that cannot touch",
    "Fig. 1, no number",
    "more than half of the exchanges are idle on every drum",
    "figure_01_idle_swaps",
)
def idle(bench: Bench) -> Finding:
    cases = [case for case in series.over_size(bench.on(), SWEEP) if case.count("swaps") > 0.0]
    shares = {case.boxes: case.count("idle_swaps") / case.count("swaps") for case in cases}
    shares = {boxes: share for boxes, share in shares.items() if np.isfinite(share)}
    needed(shares, "./polydem bench on drums, finder 'sort_and_sweep'")
    low, high = min(shares.values()), max(shares.values())
    return Finding(
        CONFIRMED if low > 0.5 else CONTRADICTED,
        f"{100 * low:.1f} to {100 * high:.1f} % of the exchanges",
        f"{min(shares)} to {max(shares)} boxes, exact counts.",
    )
