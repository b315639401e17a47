"""Figures that the paper has no counterpart of: all finders over size, threads, cache misses, candidates and visits."""

from __future__ import annotations

import matplotlib
import numpy as np

from ..bench import paper, series
from ..bench.samples import Bench
from ..bench.series import SWEEP, TREE
from ..bench.statistics import slope, typical
from ..costs import cache
from ..tables.bench_tables import visits_per_search
from .style import (
    LOOKS,
    SETTINGS,
    Drawing,
    draw_estimates,
    over_size,
    panels_with_legend,
    readable_decades,
    shared_legend,
    style_of,
)

#: Curves within this part of each other are drawn as one
CLOSE = 0.05

#: Finders in the figure of threads, and what they stand for
PARALLEL = {
    "partitioned_sweep": "sweep, partitioned lists",
    "sort_and_sweep": "sweep, one axis per thread",
    "quadtree": "quadtree, search",
    "linked_cells": "linked cells, scan",
}


def bench_drawings(bench: Bench) -> list[Drawing]:
    """Those of the figures that the samples can give."""
    here = bench.on()
    with matplotlib.rc_context(SETTINGS):
        drawn = [all_finders(here), local(here), threads(here), misses(bench), work(here)]
    return [drawing for drawing in drawn if drawing]


def all_finders(bench: Bench) -> Drawing | None:
    """Time per box over size."""
    figure, (axis,), below = panels_with_legend(1, 6.4, 3.8, rows=8)
    for finder in _finders(bench):
        cases = [case for case in series.over_size(bench, finder) if case.time()]
        if not cases:
            continue
        law = series.law(cases)
        told = "" if law is None else f": slope {law.exponent.text()}"
        draw_estimates(
            axis,
            [case.boxes for case in cases],
            [typical(case.time()) for case in cases],
            label=finder + told,
            **style_of(finder),
        )
    if not axis.has_data():
        return None
    over_size(axis, "time per box and step [ns]")
    shared_legend(below, [axis], columns=2)
    return Drawing(
        "finders_over_size",
        figure,
        "Time per box and step of all finders on the drum, one thread, first step excluded: median and 95 % interval. "
        "The slopes are those of the time per step against the number of boxes (1: the time per box is constant).",
    )


def local(bench: Bench) -> Drawing | None:
    """Exponents between neighbouring sizes, of the list and of the structure alone."""
    figure, axes, below = panels_with_legend(2, 4.2, 3.2, rows=2)
    for axis, quantity, said in ((axes[0], series.total_time, paper.TOTAL_SLOPE),
                                 (axes[1], series.structure_time, paper.UPDATE_SLOPE)):
        for finder in (TREE, SWEEP):
            points = series.steps_over_size(series.over_size(bench, finder), quantity)
            if len(points) < 3:
                continue
            pairs = list(zip(points, points[1:]))
            draw_estimates(axis, [np.sqrt(a[0] * b[0]) for a, b in pairs],
                           [slope([a[0], b[0]], [a[1], b[1]]) for a, b in pairs], label=finder, **style_of(finder))
            axis.plot(paper.SIZES, (said[finder],) * 2, label=f"{finder}, paper", color=style_of(finder)["color"],
                      linestyle=(0, (1, 1.5)), linewidth=1.4)
    if not axes[0].has_data():
        return None
    for axis, label in zip(axes, ("exponent of the time of the list", "exponent of the time of the structure")):
        over_size(axis, label, logarithmic=False)
    shared_legend(below, axes, columns=4)
    return Drawing(
        "local_exponents",
        figure,
        "Exponents of the time per step between neighbouring numbers of boxes, one thread, with 95 % intervals, at the "
        "geometric mean of both numbers; dotted: the exponent that the paper gives for its own sizes. A power law "
        "would be a horizontal line.",
    )


def threads(bench: Bench) -> Drawing | None:
    """The parallel finders over threads, from the smallest to the largest scene that was run on several threads."""
    scenes = _threaded_scenes(bench)
    if not scenes:
        return None
    figure, axes, below = panels_with_legend(len(scenes), 5.0 if len(scenes) == 1 else 3.2, 3.2, rows=3)
    for axis, scene in zip(axes, scenes):
        for k, (finder, name) in enumerate(PARALLEL.items()):
            cases = bench.select(scene=scene, finder=finder, mode="replay")
            one = [case for case in cases if case.threads == 1]
            if not one or len(cases) < 2:
                continue
            gains = [series.ratio(one[0], case, series.elapsed_time) for case in cases]
            draw_estimates(axis, [case.threads * (1.0 + 0.015 * k) for case in cases], gains, label=name,
                           **style_of(finder))
        counts = np.arange(1, max(case.threads for case in bench.select(scene=scene, mode="replay")) + 1)
        axis.plot(counts, counts, color="0.75", linewidth=0.8, zorder=0, label="as many as threads")
        axis.axhline(1.0, color="0.75", linewidth=0.8, linestyle="--", zorder=0)
        axis.set(xlabel="threads", xticks=counts if len(counts) <= 16 else counts[::8], title=scene)
        axis.title.set_fontsize(9)
        axis.set_ylim(0.0, axis.get_ylim()[1] * 1.1)
    axes[0].set_ylabel("speed-up against one thread")
    shared_legend(below, axes, columns=2 if len(scenes) == 1 else 3)
    cores = bench.cases[0].provenance.get("processors", "?")
    return Drawing(
        "speed_up",
        figure,
        "Speed-up (ratio of elapsed times, median and 95 % interval) against one thread of the same finder, over "
        f"sizes; {cores} processors. Below the dashed line threads make it slower.",
    )


def _threaded_scenes(bench: Bench, most: int = 3) -> list[str]:
    """Scenes with most parallel finders on several threads, spread over size; drums if there are any."""
    finders: dict = {}
    for case in bench.select(mode="replay"):
        if case.threads > 1 and case.finder in PARALLEL and series.elapsed_time(case):
            finders.setdefault((series.kind(case) == "drum", case.boxes, case.scene), set()).add(case.finder)
    best = max(((key[0], len(found)) for key, found in finders.items()), default=None)
    kept = sorted(key for key, found in finders.items() if (key[0], len(found)) == best)
    return [kept[k][2] for k in np.unique(np.linspace(0, len(kept) - 1, most).round().astype(int))] if kept else []


def misses(bench: Bench) -> Drawing | None:
    """Simulated misses per box over size."""
    records = series.records_of(bench, cache.read_records(bench.folders), "drum")
    models = list(dict.fromkeys(record.model for record in records))
    if not records:
        return None
    records = [record for record in records if record.model == models[0]]
    figure, axes, below = panels_with_legend(2, 4.2, 3.2, rows=3)
    finders = list(dict.fromkeys(record.finder for record in records))
    for finder in sorted(finders, key=_rank):
        found = [record for record in records if record.finder == finder]
        for axis, level in zip(axes, ("first_level", "last_level")):
            axis.plot(
                [r.boxes for r in found],
                [getattr(r, level) for r in found],
                linewidth=1.1,
                label=finder,
                **style_of(finder),
            )
    for axis, label in zip(axes, ("first-level misses", "last-level misses")):
        over_size(axis, f"{label} per box and step", logarithmic=False)
        axis.set_ylim(bottom=0.0)
    shared_legend(below, axes, columns=4)
    return Drawing(
        "cache_misses",
        figure,
        f"Misses of data, reads and writes, per box and step, simulated by cachegrind ({models[0]}) on one thread. "
        "The counts are the same at every call; real machines fetch ahead and miss less.",
    )


def work(bench: Bench) -> Drawing | None:
    """Candidates per box and nodes per search, over size."""
    figure, (left, right), below = panels_with_legend(2, 4.2, 3.2, rows=4)
    for axis, points_of in ((left, _candidates), (right, _visits)):
        for finders, points in _alike({finder: points_of(series.over_size(bench, finder))
                                       for finder in _finders(bench) if finder != "all_pairs"}):
            axis.plot(*np.array(points).T, linewidth=1.1, label=", ".join(finders), **style_of(finders[0]))
    if not left.has_data() and not right.has_data():
        return None
    for axis, label in ((left, "candidates per box"), (right, "nodes or cells per search")):
        over_size(axis, label)
        readable_decades(axis.yaxis)
    shared_legend(below, [left, right], columns=2)
    return Drawing(
        "work_over_size",
        figure,
        "Left: possible pairs that a finder keeps from step to step. Right: nodes or cells that it looks at when the "
        "neighbours of one box are searched. Finders whose counts differ by less than "
        "5 % share a curve. Exact counts, means over the steps but the first.",
    )


def _candidates(cases: list) -> tuple:
    """(boxes, possible pairs per box)"""
    return tuple((c.boxes, c.count("candidates") / c.boxes) for c in cases if c.count("candidates") > 0.0)


def _visits(cases: list) -> tuple:
    """(boxes, nodes or cells per search)"""
    return tuple((c.boxes, visits_per_search(c)) for c in cases if visits_per_search(c) > 0.0)


def _alike(points: dict) -> list:
    """[(finders, points)]: finders whose points are nearly the same share a curve, since one would hide the other."""
    found: list[tuple] = []
    for finder, values in points.items():
        same = next((finders for finders, others in found if _are_close(values, others)), None)
        if same:
            same.append(finder)
        elif values:
            found.append(([finder], values))
    return found


def _are_close(one: tuple, other: tuple) -> bool:
    """Whether two curves have the same sizes and values that a drawing cannot tell apart."""
    return [x for x, _ in one] == [x for x, _ in other] and all(
        abs(a - b) <= CLOSE * b for (_, a), (_, b) in zip(one, other)
    )


def _finders(bench: Bench) -> list:
    return sorted(bench.named("finder"), key=_rank)


def _rank(finder: str) -> int:
    """Place of a finder in legends."""
    return list(LOOKS).index(finder) if finder in LOOKS else len(LOOKS)
