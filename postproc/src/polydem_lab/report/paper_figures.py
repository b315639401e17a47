"""The paper's Figs. 1 and 8 to 13 with our measurements; what the paper gives as a number is drawn beside them."""

from __future__ import annotations

import matplotlib
import numpy as np

from ..bench import paper, series
from ..bench.samples import Bench
from ..bench.series import SWEEP, TREE
from ..bench.statistics import median, of_one_bench, typical
from .style import (
    PAPER,
    SETTINGS,
    Drawing,
    draw_estimates,
    draw_law,
    mark_caches,
    over_size,
    panels,
    panels_with_legend,
    shared_legend,
    style_of,
)

#: Label of times
TIME = "time per step [ms]"


def paper_drawings(bench: Bench) -> list[Drawing]:
    """Those of the figures that the samples can give."""
    here = bench.on()
    with matplotlib.rc_context(SETTINGS):
        drawn = [idle_swaps(here), machines(bench), total(here), update(here), inlining(here), interpreted(here)]
    return [drawing for drawing in drawn if drawing]


def idle_swaps(bench: Bench) -> Drawing | None:
    """Fig. 1: how many of the exchanges of the sweep concern boxes that cannot touch."""
    cases = [case for case in series.over_size(bench, SWEEP) if case.count("swaps") > 0.0]
    shares = [100.0 * case.count("idle_swaps") / case.count("swaps") for case in cases]
    if not cases or not np.any(np.isfinite(shares)):
        return None
    figure, (axis,) = panels()
    axis.plot([case.boxes for case in cases], shares, linewidth=1.1, **style_of(SWEEP))
    axis.axhline(50.0, **PAPER)
    axis.annotate(
        "most: more than half (paper, no number)", (0.02, 51.0), xycoords=("axes fraction", "data"), fontsize=8
    )
    over_size(axis, "idle exchanges [%]", logarithmic=False)
    axis.set_ylim(0.0, 102.0)
    return Drawing(
        "figure_01_idle_swaps",
        figure,
        "Fig. 1: share of the exchanges of ends in sort-and-sweep that concern boxes which cannot touch, because "
        "they are apart on the other axis before and after the step. Exact counts.",
    )


def machines(bench: Bench) -> Drawing | None:
    """Figs. 8 and 13: the same run on several machines."""
    figure, (axis,), below = panels_with_legend(1, 5.2, 3.3, rows=2)
    drawn = 0
    for k, machine in enumerate(bench.named("machine")):
        cases = series.over_size(bench.on(machine), TREE)
        if cases:
            colour, marker, line = list(looks_of_machines())[k % 6]
            draw_estimates(
                axis,
                [case.boxes for case in cases],
                _per_step(cases),
                label=machine,
                color=colour,
                marker=marker,
                linestyle=line,
                markersize=4.5,
            )
            drawn += 1
    if drawn == 0:
        return None
    over_size(axis, TIME)
    shared_legend(below, [axis], columns=2)
    alone = " Only one machine is in these samples: give the folders of others too, to compare." if drawn == 1 else ""
    return Drawing(
        "figure_08_13_machines",
        figure,
        "Figs. 8 and 13: time of the quadtree per step on several machines, one thread." + alone + " In the paper "
        "Xeon56 (2.4 GHz, DDR4) is faster than Xeon32 (3.3 GHz, DDR3); against Xeon56 the Apple M2 is 1.8 and the "
        "M4 3.5 (small systems) to 3 times (large systems) faster.",
    )


def looks_of_machines():
    """Colours, markers and lines for machines."""
    return zip(("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#000000", "#56B4E9"), "osP^Xv",
               ("-", "--", "-.", ":", "-", "--"))


def total(bench: Bench) -> Drawing | None:
    """Fig. 9: all of the neighbourhood, tree and sweep."""
    drawing = _two_finders(
        bench,
        series.total_time,
        "figure_09_total",
        "Fig. 9: time for the list of pairs",
        paper.TOTAL_SLOPE,
        paper.TOTAL_RATIO,
        "0.9",
    )
    if drawing and series.whole_steps(bench, TREE) and series.whole_steps(bench, SWEEP):
        drawing.caption += " Open: within whole steps, the making of the boxes included, as in the paper's figure."
    return drawing


def update(bench: Bench) -> Drawing | None:
    """Fig. 10: the update of the structure alone."""
    return _two_finders(
        bench,
        series.structure_time,
        "figure_10_update",
        "Fig. 10: time to update the structure alone",
        paper.UPDATE_SLOPE,
        paper.UPDATE_RATIO,
        "0.1",
    )


def _two_finders(bench: Bench, quantity, name: str, what: str, slopes: dict, ratio: float, ratio_text: str):
    """Time over size of tree and sweep with fitted slopes, and their ratio."""
    cases = {finder: [c for c in series.over_size(bench, finder) if quantity(c)] for finder in (TREE, SWEEP)}
    if not any(cases.values()):
        return None
    figure, (left, right), below = panels_with_legend(2, 4.2, 3.2, rows=4)
    for finder, found in cases.items():
        laws = [law for law in (series.law_of_paper(found, quantity), series.law_beyond(found, quantity)) if law]
        told = [f"{finder}: exponent {laws[0].exponent.text()}; paper {slopes[finder]:g}"] if laws else [finder]
        draw_estimates(
            left, [c.boxes for c in found], _per_step(found, quantity), label=told[0],
            **{**style_of(finder), "linestyle": "none"},
        )
        for law, line in zip(laws, ("-", "--")):
            label = f"{finder}, larger sizes: {law.exponent.text()}" if line == "--" else None
            draw_law(left, law, color=style_of(finder)["color"], linestyle=line, label=label)
        if laws:
            _draw_paper_slope(left, laws[0], slopes[finder])
    both = series.pairs_of(cases[TREE], cases[SWEEP])
    draw_estimates(
        right,
        [tree.boxes for tree, _ in both],
        [series.ratio(tree, sweep, quantity) for tree, sweep in both],
        color="black",
        marker="o",
        markersize=4.5,
        label="tree / sweep, these samples",
    )
    right.plot(paper.SIZES, (ratio, ratio), label=f"paper: about {ratio_text}", **PAPER)
    if quantity is series.total_time:
        _draw_whole_steps(left, right, bench)
    over_size(left, TIME)
    over_size(right, "tree / sweep", logarithmic=False)
    right.set_ylim(bottom=0.0)
    shared_legend(below, [left, right], columns=2)
    return Drawing(
        name,
        figure,
        what + " per step against the number of boxes, one thread, with fitted power laws (95 % "
        "intervals): solid through the sizes of the paper, dashed through larger ones; dotted: the slopes that the "
        "paper gives, through the middle of our solid lines; right: ratio of the two. Fixed boxes count. The making of "
        "the boxes is not in.",
    )


def _draw_whole_steps(left, right, bench: Bench) -> None:
    """Open markers: the times of whole steps, with the making of the boxes."""
    whole = {finder: series.whole_steps(bench, finder) for finder in (TREE, SWEEP)}
    for finder, found in whole.items():
        law = series.law_of_paper(found)
        if law:
            draw_estimates(left, [c.boxes for c in found], _per_step(found), markerfacecolor="none",
                           label=f"{finder}, with boxes: {law.exponent.text()}",
                           **{**style_of(finder), "linestyle": "none"})
    both = series.pairs_of(whole[TREE], whole[SWEEP])
    if both:
        draw_estimates(right, [tree.boxes for tree, _ in both], [series.ratio(*pair) for pair in both], color="black",
                       marker="o", markerfacecolor="none", linestyle="--", markersize=4.5,
                       label="tree / sweep, with boxes")


def _draw_paper_slope(axis, law: series.Law, slope: float) -> None:
    """The paper's exponent through the middle of our law."""
    middle = np.exp(np.mean(np.log(law.sizes)))
    axis.plot(law.sizes, law.at(middle) * (law.sizes / middle) ** slope, zorder=0, **PAPER)


def inlining(bench: Bench) -> Drawing | None:
    """Fig. 11: the tree inlined and not, and where it outgrows the caches."""
    cases = {finder: series.over_size(bench, finder) for finder in (TREE, "quadtree_called")}
    if not all(cases.values()):
        return None
    figure, (left, right), below = panels_with_legend(2, 4.2, 3.2, rows=2)
    for finder, found in cases.items():
        law = series.law_of_paper(found)
        slope = "" if law is None else f": exponent {law.exponent.text()}; paper {paper.INLINING_SLOPE[finder]:g}"
        name = "inlined" if finder == TREE else "not inlined"
        draw_estimates(
            left,
            [c.boxes for c in found],
            [typical(c.time()) for c in found],
            label=name + slope,
            **style_of(finder),
        )
    both = series.pairs_of(cases[TREE], cases["quadtree_called"])
    draw_estimates(
        right,
        [a.boxes for a, _ in both],
        [series.ratio(a, b) for a, b in both],
        color="black",
        marker="o",
        markersize=4.5,
    )
    right.axhline(1.0, color="0.7", linewidth=0.8)
    for boxes, text, side in (
        (paper.INLINING_HURTS_BELOW, "paper: hurts ←", "right"),
        (paper.INLINING_HELPS_BEYOND, "→ helps", "left"),
    ):
        right.axvline(boxes, **PAPER)
        right.annotate(text, (boxes, 1.01), xycoords=("data", "axes fraction"), fontsize=8, ha=side, color="0.35")
    over_size(left, "time per box and step [ns]", logarithmic=False)
    over_size(right, "inlined / not inlined", logarithmic=False)
    left.set_ylim(bottom=0.0)
    mark_caches(left, outgrown(cases[TREE]))
    shared_legend(below, [left], columns=2)
    return Drawing(
        "figure_11_inlining",
        figure,
        "Fig. 11: the quadtree from one source, compiled with and without inlining. Dashed: the number of boxes at "
        "which what the finder holds (and the boxes) outgrows a level of the caches of this machine. Dotted: the "
        "numbers of boxes that the paper names. Exponents: of the time per step over the sizes of the paper.",
    )


def outgrown(cases: list) -> list:
    """[(level, boxes)] at which the bytes of a series pass the levels of the caches, between sizes by interpolation."""
    points = [(series.held_bytes(case), case.boxes) for case in cases if np.isfinite(series.held_bytes(case))]
    if not points:
        return []
    held, boxes = np.log(np.array(points, dtype=float)).T
    levels = series.cache_levels(cases[0].provenance)
    return [
        (name, float(np.exp(np.interp(np.log(size), held, boxes))))
        for name, size in levels
        if held.min() <= np.log(size) <= held.max()
    ]


def interpreted(bench: Bench) -> Drawing | None:
    """Fig. 12: an interpreter against compiled code; an indication only."""
    cases = series.over_size(bench, TREE)
    cases = [case for case in cases if case.boxes <= 2 * max(paper.OCTAVE)]
    if not cases:
        return None
    figure, (axis,), below = panels_with_legend(1, 5.2, 3.3, rows=3)
    sizes = sorted(paper.OCTAVE)
    axis.plot(
        sizes,
        [paper.OCTAVE[size][0] for size in sizes],
        color="0.35",
        marker="x",
        linewidth=1.1,
        label="MATLAB example of the authors in GNU Octave",
    )
    draw_estimates(axis, [case.boxes for case in cases], _per_step(cases), label="polydem, quadtree", **style_of(TREE))
    middle = np.array([case.boxes for case in cases], dtype=float)
    ours = np.array([estimate.value for estimate in _per_step(cases)])
    axis.fill_between(
        middle,
        paper.COMPILED_GAIN[0] * ours,
        paper.COMPILED_GAIN[1] * ours,
        color="0.88",
        linewidth=0,
        label="8 to 18 times polydem (gain of the paper)",
    )
    over_size(axis, TIME)
    shared_legend(below, [axis], columns=1)
    return Drawing(
        "figure_12_interpreted",
        figure,
        "Fig. 12 is not testable without MATLAB and its compiler. As an indication only: the authors' published "
        "example in GNU Octave, another interpreter on another machine with another scene, making of the boxes "
        "included, against our compiled program. The paper's gain by compiling one and the same program is 8 to 18.",
    )


def _per_step(cases: list, quantity=series.total_time) -> list:
    """Time per step [ms]."""
    return [median([1e-6 * case.boxes * value for value in of_one_bench(quantity(case))]) for case in cases]
