"""Rules for claims about kinds of scenes and whole runs: C9, C11, C12, C14, C19."""

from __future__ import annotations

import numpy as np

from ..bench import paper, series
from ..bench.samples import Bench
from ..bench.series import OTHERS, SWEEP, TREE
from ..bench.statistics import every, median, number, of_one_bench, some, typical
from .verdicts import NOT_TESTABLE, Finding, Missing, Part, claim, in_parts, needed, of_parts, said

#: What scenes of a kind are
WHAT_TO_RUN = {
    "soft": "a gas whose grains overlap (scene.overlap) and cover its box or more",
    "range": "a gas with a long range (boxes.margin)",
}

#: Finders that are no incremental ones, for rules
ANEW = ", ".join(OTHERS)

WEEK = 7.0 * 24.0 * 3600.0


@claim(
    "C9",
    "Compiled over interpreted MATLAB",
    "8 (small) to 18 (large)",
    "needs MATLAB and its compiler",
    "figure_12_interpreted",
)
def interpreter(bench: Bench) -> Finding:
    reason = "It needs MATLAB, its Coder and the authors' program in both forms."
    cases = series.over_size(bench.on(), TREE)
    near = [
        (case, size) for case in cases for size in paper.OCTAVE if abs(case.boxes - size) <= 0.02 * size and case.time()
    ]
    if not near:
        return Finding(NOT_TESTABLE, "-", reason)
    gains = [
        1e6 * paper.OCTAVE[size][0] / (case.boxes * typical(case.time()).value) for case, size in near
    ]
    return Finding(
        NOT_TESTABLE,
        f"indication: {number(min(gains), 2)} to {number(max(gains), 2)}",
        reason + " The indication is the authors' published example in GNU Octave over polydem: other interpreter, "
        "machine, program and scene, and the making of the boxes in the former only.",
    )


@claim(
    "C11",
    "Walls cut into boxes work at any ratio of sizes",
    "Fig. 7 (hopper), no number",
    "quadtree finds the list of the oracle on a hopper and on scenes of at least two ratios, the largest at least 10, "
    "and some body there has several boxes",
    "scenes",
)
def ratios(bench: Bench) -> Finding:
    here = bench.on()
    what = "./polydem bench on a hopper and on gases of two size ratios (scene.size_ratio), finder 'quadtree'"
    hoppers = needed(series.cases_of(here, "hopper", finder=TREE), what)
    cases = needed(series.cases_of(here, "sizes", finder=TREE, threads=1), what)
    sizes = [series.parameter(case, "scene.size_ratio") for case in cases]
    if len(set(sizes)) < 2 or not np.nanmax(sizes) >= 10.0:
        raise Missing(what + ", up to 10 or more")
    everything = hoppers + cases
    agreed = [_agrees(here, case) for case in everything]
    cut = any(int(case.facts.get("bodies", case.boxes)) < case.boxes for case in everything)
    unchecked = [case.scene for case in everything if "all_pairs" not in str(case.facts.get("checked", ""))]
    ours = ", ".join(f"{case.scene}: {typical(case.time()).text()} ns/box" for case in everything)
    if unchecked:
        raise Missing(f"the comparison with all_pairs on {', '.join(unchecked)}")
    return Finding(
        of_parts([all(agreed), cut]),
        ours,
        f"Equal lists on {sum(agreed)} of {len(agreed)} scenes; "
        + ("bodies" if cut else "no body")
        + " cut into several boxes.",
    )


def _agrees(bench: Bench, case) -> bool:
    """Whether all finders on the scene of a case have found the same pairs."""
    same = [
        other for other in bench.select(scene=case.scene, mode=case.mode) if other.facts["steps"] == case.facts["steps"]
    ]
    return len({str(other.facts.get("pair_hash")) for other in same}) == 1


@claim(
    "C12",
    "Nearly static beds shrink the tree's edge, gases widen it, strong overlaps suit neither",
    "no numbers",
    "time of tree / sweep against that of the drum: greater on the bed, smaller in the gas (geometric mean over "
    f"densities), intervals apart; strong overlaps: a finder that begins anew at every step, or nearly so ({ANEW}), "
    "beats the tree on every scene, and the sweep, intervals clear of 1",
    "scenes",
)
def kinds(bench: Bench) -> Finding:
    here = bench.on()
    ratio = {}
    for of_kind in ("drum", "bed", "gas"):
        both = series.pairs_of(
            *(series.cases_of(here, of_kind, finder=finder, threads=1, mode="replay") for finder in (TREE, SWEEP))
        )
        both = [pair for pair in both if pair[0].boxes <= 1.1 * paper.SIZES[1]]
        if of_kind == "gas":
            both = list({series.parameter(pair[0], "scene.solid_fraction"): pair for pair in both}.values())
        most = paper.SIZES[1]
        needed(both, f"./polydem bench on a {of_kind} of at most {most} boxes, finders 'quadtree', 'sort_and_sweep'")
        ratio[of_kind] = series.pooled_ratio(both)
    worse, soft = _others_win(here, "soft")
    bed, gas, drum = ratio["bed"], ratio["gas"], ratio["drum"]
    parts = [
        Part("beds shrink the edge of the tree", bed.above_that(drum),
             f"tree / sweep: drum {drum.text()}, bed {bed.text()}"),
        Part("gases widen it", drum.above_that(gas), f"tree / sweep: drum {drum.text()}, gas {gas.text()}"),
        Part("strong overlaps do not suit the tree", worse[TREE], soft[TREE]),
        Part("strong overlaps do not suit the sweep", worse[SWEEP], soft[SWEEP]),
    ]
    bed_holds, gas_holds, tree, sweep = (part.holds for part in parts)
    told = said(bed=bed_holds, gas=gas_holds, overlaps_tree=tree, overlaps_sweep=sweep)
    return in_parts(parts, f"As said: {told}.")


def _others_win(bench: Bench, of_kind: str) -> tuple:
    """Finder of the paper -> whether another one beats it on every scene of a kind; and its times over the best."""
    cases = series.cases_of(bench, of_kind, threads=1, mode="replay")
    what = f"./polydem bench on {WHAT_TO_RUN[of_kind]}, finders 'quadtree', 'sort_and_sweep', 'linked_cells'"
    won: dict = {TREE: [], SWEEP: []}
    found: dict = {TREE: [], SWEEP: []}
    for scene in dict.fromkeys(case.scene for case in needed(cases, what)):
        here = {case.finder: case for case in cases if case.scene == scene and case.time()}
        others = [here[name] for name in OTHERS if name in here]
        if not all(name in here for name in won) or not others:
            raise Missing(what)
        best = min(others, key=_middle)
        for name, parts in won.items():
            parts.append(some(series.ratio(here[name], other).above(1.0) for other in others))
        for name, told in found.items():
            told.append(f"{scene}: over {best.finder} {series.ratio(here[name], best).text()}")
    return ({name: every(parts) for name, parts in won.items()},
            {name: f"{name}, {'; '.join(told)}" for name, told in found.items()})


def _middle(case) -> float:
    return typical(case.time()).value


@claim(
    "C14",
    "The largest run takes about a week on one core",
    "about a week",
    "not decidable: the paper does not say how many steps that run has; what a week is worth here is told",
    "live",
)
def week(bench: Bench) -> Finding:
    cases = [
        case
        for case in series.cases_of(bench.on(), "drum", mode="live", threads=1)
        if abs(case.boxes - paper.SIZES[1]) <= 0.1 * paper.SIZES[1]
    ]
    needed(cases, "./polydem bench with mode = 'live' on the drum of 12651 boxes, one thread")
    case = next((case for case in cases if case.finder == TREE), cases[0])
    step = median([1e-9 * case.boxes * value for value in of_one_bench(case.stage(*case.samples[0].stages))])
    needed(step, "./polydem bench with mode = 'live' and more than one step")
    steps = WEEK / step.value
    return Finding(
        NOT_TESTABLE,
        f"{number(1e3 * step.value)} ms per step; a week: {number(steps)} steps, "
        f"{number(steps * float(case.facts['dt']))} s of the drum",
        "It would need the number of steps of that run.",
    )


@claim(
    "C19",
    "With long interaction ranges neither incremental method pays",
    "no numbers",
    f"a finder that begins anew at every step, or nearly so ({ANEW}), beats the tree on every scene of a long range, "
    "and the sweep, intervals clear of 1",
    "scenes",
)
def long_range(bench: Bench) -> Finding:
    worse, found = _others_win(bench.on(), "range")
    parts = [Part("the tree does not pay", worse[TREE], found[TREE]),
             Part("the sweep does not pay", worse[SWEEP], found[SWEEP])]
    return in_parts(parts, f"As said: {said(tree=worse[TREE], sweep=worse[SWEEP])}.")
