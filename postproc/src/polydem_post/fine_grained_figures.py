"""The figure of the fine-grained parallel sweep beside the parallel tree, with the model of both."""

from __future__ import annotations

import matplotlib
import numpy as np

from .bench import Bench
from .figure_style import SETTINGS, Drawing, draw_estimates, grid_with_legend, readable_decades, shared_legend
from .fine_grained import MOST_THREADS, PARTITIONED, Contest, contests
from .fine_grained_tables import error_told
from .series import TREE
from .statistics import Estimate

#: Colour, marker and line of the scenes, in order of size and motion
LOOKS = (("#0072B2", "o", "-"), ("#D55E00", "s", "--"), ("#009E73", "^", "-."), ("#000000", "X", ":"),
         ("#CC79A7", "D", (0, (5, 1, 1, 1, 1, 1))), ("#56B4E9", "v", (0, (8, 2))))

#: The model is drawn up to so many times the measured threads
BEYOND = 4


def fine_grained_drawings(bench: Bench) -> list[Drawing]:
    """The figures, if the samples give them."""
    found = contests(bench.on())
    if not found:
        return []
    loses = any(each.seen_to_lose_at() or (each.has_model and each.loses_at()) for each in found)
    with matplotlib.rc_context(SETTINGS):
        return [side_by_side(found), *([limits(found)] if loses else [])]


def shown(found: list[Contest]) -> list[Contest]:
    """As many scenes as can be told apart, spread over size and motion."""
    if len(found) <= len(LOOKS):
        return found
    return [found[k] for k in np.unique(np.linspace(0, len(found) - 1, len(LOOKS)).round().astype(int))]


def side_by_side(found: list[Contest]) -> Drawing:
    """Time over threads: sweep left, tree right, below waiting against work, and who wins."""
    figure, axes, below = grid_with_legend(2, 2, 4.3, 2.9, rows=3)
    (failed, working), (waits, wins) = axes
    scenes = shown(found)
    for contest, (colour, marker, line) in zip(scenes, LOOKS):
        label = f"{contest.one.scene}: {contest.one.boxes} boxes"
        look = {"color": colour, "marker": marker, "markersize": 4.5, "linestyle": "none"}
        threads = contest.threads
        curve = model_threads(threads)
        per_box = 1e9 / contest.one.boxes
        for axis, finder in ((failed, PARTITIONED), (working, TREE)):
            draw_estimates(axis, threads, [scaled(contest.measured(finder, n), per_box) for n in threads],
                           label=label, **look)
            axis.plot(curve, [per_box * contest.model(finder, n) for n in curve], color=colour, linestyle=line,
                      linewidth=1.0)
        several = [n for n in threads if n > 1]
        draw_estimates(waits, several, [contest.waiting_over_work(n) for n in several], **look)
        waits.plot(curve[1:], [contest.predicted_waiting_over_work(n) for n in curve[1:]], color=colour,
                   linestyle=line, linewidth=1.0)
        draw_estimates(wins, threads, [contest.ratio(n) for n in threads], **look)
        wins.plot(curve, [contest.model(PARTITIONED, n) / contest.model(TREE, n) for n in curve], color=colour,
                  linestyle=line, linewidth=1.0)
    _label(axes, scenes)
    shared_legend(below, [failed], columns=2)
    return Drawing(
        "fine_grained", figure,
        "Above: time per box and step over threads, left of the sweep that all threads sort together, right of the "
        "tree; titles: gain of the most threads over one, of all scenes; both have the same axis. Below left: waiting "
        "of a thread in a pass over its work; above 1 threads wait longer than they work. Below right: time of the "
        "sweep over that of the tree; above 1 the sweep loses. Points: measured, with 95 % intervals; lines: the model "
        "of work, of parts that are uneven by exchanges counted from the trace, of fetching and of waiting; on grey "
        f"ground it is a prediction. {error_told(found)}",
    )


def model_threads(threads: list[int]) -> list[int]:
    """Numbers of threads at which the model is drawn."""
    most = min(MOST_THREADS, BEYOND * threads[-1])
    return sorted({*range(1, min(most, 16) + 1), *np.geomspace(1, most, 20).round().astype(int).tolist()})


def scaled(estimate: Estimate, factor: float) -> Estimate:
    """An estimate in other units."""
    return Estimate(factor * estimate.value, factor * estimate.low, factor * estimate.high)


def _label(axes: list, scenes: list[Contest]) -> None:
    (failed, working), (waits, wins) = axes
    most = max(contest.threads[-1] for contest in scenes)
    drawn = [contest.measured(finder, n).value * 1e9 / contest.one.boxes
             for contest in scenes for n in contest.threads for finder in (PARTITIONED, TREE)]
    for axis, what, finder in ((failed, "one sort by all threads", PARTITIONED),
                               (working, "traversal of the tree", TREE)):
        axis.set(yscale="log", title=_titled(what, finder, scenes), ylabel="time per box and step [ns]")
        axis.set_ylim(0.3 * min(drawn), 2.0 * max(drawn))
        readable_decades(axis.yaxis)
        axis.title.set_fontsize(9)
    waits.set(ylabel="waiting / work in a pass")
    waits.set_ylim(bottom=0.0)
    waits.axhline(1.0, color="0.6", linewidth=0.8, zorder=0)
    wins.set(ylabel="sweep / tree")
    wins.set_ylim(bottom=0.0)
    wins.axhline(1.0, color="0.6", linewidth=0.8, zorder=0)
    for row in axes:
        for axis in row:
            axis.set(xscale="log", xlabel="threads")
            ticks = [2**k for k in range(10) if 2**k <= BEYOND * most]
            axis.set_xticks(ticks, [str(tick) for tick in ticks])
            axis.minorticks_off()
            axis.axvspan(most * 1.15, axis.get_xlim()[1], color="0.94", zorder=-1)


def _titled(what: str, finder: str, scenes: list[Contest]) -> str:
    """A title that says how much several threads gain."""
    gains = sorted(contest.speed_up(finder).value for contest in scenes)
    return f"{what}: {gains[0]:.2g} to {gains[-1]:.2g} times as fast"


def limits(found: list[Contest]) -> Drawing:
    """With how many threads the sweep loses, over how much moves."""
    figure, ((axis,),), below = grid_with_legend(1, 1, 5.2, 3.2, rows=2)
    sizes = sorted({contest.one.boxes for contest in found})
    for boxes, (colour, marker, line) in zip(sizes, LOOKS):
        of_size = [contest for contest in found if contest.one.boxes == boxes]
        motion = [contest.exchanges for contest in of_size]
        predicted = [contest.loses_at() or MOST_THREADS for contest in of_size]
        axis.plot(motion, predicted, color=colour, linestyle=line, marker=marker, markersize=7.0,
                  markerfacecolor="none", linewidth=1.0, label=f"{boxes} boxes, model")
        seen = [(m, each.seen_to_lose_at()) for m, each in zip(motion, of_size) if each.seen_to_lose_at()]
        if seen:
            axis.plot(*zip(*seen), color=colour, linestyle="none", marker=marker, markersize=3.5,
                      label=f"{boxes} boxes, measured")
    axis.set(xscale="log", yscale="log", xlabel="exchanges of ends per box and step",
             ylabel="threads from which the sweep loses")
    ticks = [2**k for k in range(9) if 2**k <= MOST_THREADS]
    axis.set_yticks(ticks, [str(tick) for tick in ticks])
    axis.minorticks_off()
    axis.set_ylim(0.8, 1.3 * MOST_THREADS)
    shared_legend(below, [axis], columns=3)
    return Drawing(
        "fine_grained_limits", figure,
        "Least number of threads with which the fine-grained sweep takes as long as the tree with as many, over how "
        f"much moves. Open: model; {MOST_THREADS}: not with fewer. Filled: measured; scenes in which the sweep does "
        "not lose on this machine have none.",
    )
