"""The figures of the fine-grained parallel sweeps beside the parallel tree, drawn from the tables of their numbers."""

from __future__ import annotations

import csv
import re
from functools import cache
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from polydem_post.base.emit import Table

from ..bench import paper
from ..bench.samples import Bench
from ..bench.series import SWEEP, TREE
from ..bench.statistics import Estimate, number
from ..fine_grained.model import BLOCKS, MOST_THREADS, OBVIOUS, PARTITIONED, Contest, contests
from ..tables.fine_grained_tables import fine_grained_tables
from .style import SETTINGS, Drawing, draw_estimates, grid_with_legend, readable_decades, shared_legend, style_of

#: Colour, marker and line of the scenes, in order of size and motion
LOOKS = (("#0072B2", "o", "-"), ("#D55E00", "s", "--"), ("#009E73", "^", "-."), ("#000000", "X", ":"),
         ("#CC79A7", "D", (0, (5, 1, 1, 1, 1, 1))), ("#56B4E9", "v", (0, (8, 2))))

#: Times of the sweep and the tree on up to sixteen threads of another machine
SIXTEEN = Path(__file__).parent / "sixteen_threads.csv"

#: Finder -> how it works, for legends
FINE_GRAINED = {PARTITIONED: BLOCKS, **OBVIOUS}
SHOWN = {**FINE_GRAINED, SWEEP: "one axis per thread", TREE: "traversal of the tree"}


def fine_grained_drawings(bench: Bench) -> list[Drawing]:
    """The figures, if the samples give them."""
    here = bench.on()
    tables = {table.name: table for table in fine_grained_tables(here)}
    found = contests(here)
    drawn = []
    with matplotlib.rc_context(SETTINGS):
        if "fine_grained_gains" in tables:
            drawn.append(what_fails(tables["fine_grained_gains"], tables.get("fine_grained"),
                                    tables.get("fine_grained_error")))
        if any(each.seen_to_lose_at() or (each.has_model and each.loses_at()) for each in found):
            drawn.append(limits(found))
    return drawn


def what_fails(gains: Table, contest: Table | None = None, error: Table | None = None) -> Drawing:
    """Which parallel sweeps fail, what they wait for, and the one that works beside the tree."""
    rows = [dict(zip(gains.heading, row)) for row in gains.rows]
    scenes = scenes_of(rows)
    figure, (above, (waits, wins, beside)), below = grid_with_legend(2, 3, 3.3, 2.9, rows=4)
    for axis, scene in zip(above, scenes):
        draw_gains(axis, [row for row in rows if row["scene"] == scene])
    for axis in above[len(scenes):]:
        axis.axis("off")
    above[0].set_ylabel("times as fast as one thread\nof sort_and_sweep")
    draw_waits(waits, rows, scenes)
    draw_contest(wins, contest or contest_of(rows))
    beside.axis("off")
    beside.legend(*wins.get_legend_handles_labels(), fontsize=7, loc="upper left")
    told = error_in(error)
    beside.annotate(told.replace(": ", ":\n").replace(", quadtree", ",\nquadtree"), (0.0, 0.02), fontsize=7,
                    xycoords="axes fraction", va="bottom")
    shared_legend(below, above, columns=2)
    message(figure, rows)
    return Drawing(
        "fine_grained", figure,
        "Above: gain of parallel sweeps and of the tree over one thread of the plain sweep, with 95 % intervals; above "
        "the line at 1 threads pay. Titles: how far free boxes move in a step, over their side. Below left: barriers "
        "and locks of a step, counted, with the most threads that have a processor each. Below right: time of the "
        "sweep that works (partitioned_sweep) over that of the tree; above 1 the sweep loses. Filled: measured here, "
        "lines: the model, if there is one; open: measured on up to sixteen threads of another "
        f"machine ({sixteen()[0]['source']}). {told}".rstrip(),
    )


def scenes_of(rows: list[dict]) -> list[str]:
    """Scenes of one size, in order of motion: the size with most motions, of such the largest of the paper's sizes."""
    found: dict[str, tuple[int, float]] = {}
    for row in rows:
        found[row["scene"]] = (int(row["boxes"]), value_of(row["way per step over side of a box"]))
    sizes = [boxes for boxes, _ in found.values()]
    size = max(set(sizes), key=lambda boxes: (min(sizes.count(boxes), 3), boxes <= 1.1 * paper.SIZES[1], boxes))
    return sorted((scene for scene, (boxes, _) in found.items() if boxes == size),
                  key=lambda scene: np.nan_to_num(found[scene][1]))[:3]


def draw_gains(axis, rows: list[dict]) -> None:
    """Gain over threads on one scene."""
    for k, (finder, what) in enumerate(SHOWN.items()):
        here = [row for row in rows if row["finder"] == finder]
        if here:
            draw_estimates(axis, [int(row["threads"]) * 1.02 ** (k - 3) for row in here],
                           [estimate_of(row["times as fast"]) for row in here],
                           label=f"{finder}: {what}", **style_of(finder))
    axis.axhline(1.0, color="0.5", linewidth=0.8, zorder=0)
    axis.set(yscale="log", title=f"{rows[0]['scene']}: {moving(rows[0])}", xlabel="threads", xscale="log")
    axis.title.set_fontsize(8.5)
    gains = [gain for row in rows if np.isfinite(gain := value_of(row["times as fast"]))]
    axis.set_ylim(min([0.5, *(0.7 * gain for gain in gains)]), max([2.0, *(1.4 * gain for gain in gains)]))
    readable_decades(axis.yaxis)
    threads_along(axis, {int(row["threads"]) for row in rows})


def moving(row: dict) -> str:
    """How much moves, in words."""
    way = value_of(row["way per step over side of a box"])
    return f"boxes move by\n{100.0 * way:.2g} % of their side per step" if np.isfinite(way) else "\n"


def threads_along(axis, threads: set[int]) -> None:
    """Numbers of threads from left to right."""
    axis.set_xticks(sorted(threads), [str(n) for n in sorted(threads)])
    axis.minorticks_off()
    axis.set_xlabel("threads")


def draw_waits(axis, rows: list[dict], scenes: list[str]) -> None:
    """Barriers, locks and waits for the lock in a step, over the scenes."""
    free = free_rows(rows)
    most = max((int(row["threads"]) for row in free), default=1)
    for finder in FINE_GRAINED:
        for column, what, line in (("barriers per step", "barriers", "-"), ("locks per step", "locks", "--"),
                                   ("waits for the lock per step", "waits", ":")):
            if column != "barriers per step" and finder != "locked_sweep":
                continue
            points = [(k, value_of(row[column])) for k, scene in enumerate(scenes) for row in free
                      if row["scene"] == scene and row["finder"] == finder and int(row["threads"]) == most]
            if points:
                style = {**style_of(finder), "linestyle": line}
                axis.plot(*zip(*points), **style)
                axis.annotate(f" {what}" if finder == "locked_sweep" else "", points[-1], fontsize=7, va="center")
    axis.set_yscale("symlog", linthresh=1.0)
    axis.set(title=f"counted, {most} threads", ylabel="per step", xlim=(-0.3, len(scenes) - 0.2))
    axis.set_ylim(bottom=0.0)
    axis.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axis.set_xticks(range(len(scenes)), [scene.replace("_", "\n") for scene in scenes])
    axis.title.set_fontsize(8.5)


def contest_of(rows: list[dict]) -> Table:
    """The sweep over the tree on the drums of a table of gains, as medians and without a model."""
    gains = {(row["finder"], row["scene"], row["threads"]): value_of(row["times as fast"]) for row in rows
             if int(row["threads"]) == 1 or row in free_rows(rows)}
    table = Table("fine_grained", "", ("scene", "threads", "sweep / tree", "model"))
    for finder, scene, threads in gains:
        if finder == PARTITIONED and (TREE, scene, threads) in gains:
            ratio = gains[TREE, scene, threads] / gains[PARTITIONED, scene, threads]
            table.add(scene, int(threads), number(ratio), "-")
    return table


def draw_contest(axis, contest: Table | None) -> None:
    """The sweep over the tree: measured here, the model, and on sixteen threads elsewhere."""
    threads = {1}
    rows = contest.rows if contest else []
    place = {name: k for k, name in enumerate(contest.heading)} if contest else {}
    # The first column `model` is that of the ratio
    model = contest.heading.index("model") if contest else 0
    for scene, (colour, marker, line) in zip(spread([row[0] for row in rows]), LOOKS):
        here = [row for row in rows if row[0] == scene]
        at = [int(row[place["threads"]]) for row in here]
        threads |= set(at)
        draw_estimates(axis, at, [estimate_of(row[place["sweep / tree"]]) for row in here], label=scene, color=colour,
                       marker=marker, markersize=4.0, linestyle="none")
        axis.plot(at, [value_of(row[model]) for row in here], color=colour, linestyle=line, linewidth=0.9)
    for boxes, marker in ((12651, "o"), (100000, "s")):
        times = {(row["finder"], int(row["threads"])): float(row["ns"]) for row in sixteen()
                 if int(row["boxes"]) == boxes}
        at = sorted({n for _, n in times})
        threads |= set(at)
        axis.plot(at, [times[PARTITIONED, n] / times[TREE, n] for n in at], color="0.35", marker=marker,
                  markerfacecolor="none", linestyle=(0, (1, 1.5)), linewidth=1.0, label=f"{boxes} boxes, other machine")
    axis.axhline(1.0, color="0.5", linewidth=0.8, zorder=0)
    ratios = [value_of(row[place["sweep / tree"]]) for row in rows]
    axis.set(ylabel="sweep / tree", xscale="log", ylim=(0.0, max([1.7, *(1.1 * ratio for ratio in ratios)])))
    axis.set_title("above 1 the tree wins", fontsize=8.5)
    threads_along(axis, threads)


def error_in(error: Table | None) -> str:
    """The error of the model with the most threads, in words; empty if there is no model."""
    rows = [dict(zip(error.heading, row)) for row in error.rows] if error else []
    most = max((int(row["threads"]) for row in rows), default=1)
    spans = [f"{row['finder']} {row['and fetching']}" for row in rows if int(row["threads"]) == most]
    return f"Measured time over that of the model with {most} threads: {', '.join(spans)}." if most > 1 else ""


def message(figure: Figure, rows: list[dict]) -> None:
    """The title: which fine-grained sweeps fail, and which work, with the most threads that have a processor each."""
    lines: dict[str, list[str]] = {"Fails": [], "Works": [], "Loses or gains": []}
    for finder, (low, high, most) in gains_by_finder(rows).items():
        verdict = "Fails" if high <= 1.0 else "Works" if low >= 1.0 else "Loses or gains"
        lines[verdict].append(f"{FINE_GRAINED[finder]} ({number(low, 2)} to {number(high, 2)} times as fast as one "
                              f"thread, on {most})")
    said = [f"{verdict}: {line}" for verdict, found in lines.items() for line in found]
    figure.suptitle("\n".join(said or [alone(rows)]), fontsize=9.5)


def alone(rows: list[dict]) -> str:
    """The title if no time on several threads is known: work on one thread, and barriers."""
    told = []
    for finder, what in FINE_GRAINED.items():
        work = [1.0 / value_of(row["times as fast"]) for row in rows
                if row["finder"] == finder and row["threads"] == "1"]
        barriers = [value_of(row["barriers per step"]) for row in free_rows(rows) if row["finder"] == finder]
        if work and barriers:
            told.append(f"{what}: {number(min(work), 2)} to {number(max(work), 2)} times the work of the plain sweep, "
                        f"{number(min(barriers), 2)} to {number(max(barriers), 2)} barriers per step")
    return "\n".join(told)


def gains_by_finder(rows: list[dict]) -> dict[str, tuple[float, float, int]]:
    """Fine-grained sweep -> least and greatest gain of all scenes with the most free threads, and their number."""
    free, found = free_rows(rows), {}
    for finder in FINE_GRAINED:
        here = [row for row in free if row["finder"] == finder and np.isfinite(value_of(row["times as fast"]))]
        if here:
            most = max(int(row["threads"]) for row in here)
            gains = [value_of(row["times as fast"]) for row in here if int(row["threads"]) == most]
            found[finder] = (min(gains), max(gains), most)
    return found


def free_rows(rows: list[dict]) -> list[dict]:
    """Rows of several threads that have a processor each."""
    return [row for row in rows if int(row["threads"]) > 1 and
            (not row["processors"].isdigit() or int(row["threads"]) <= int(row["processors"]))]


def spread(scenes: list[str]) -> list[str]:
    """As many scenes as can be told apart, spread over size and motion."""
    found = list(dict.fromkeys(scenes))
    if len(found) <= len(LOOKS):
        return found
    return [found[k] for k in np.unique(np.linspace(0, len(found) - 1, len(LOOKS)).round().astype(int))]


@cache
def sixteen() -> list[dict]:
    """Times of the sweep and the tree on up to sixteen threads, as published on the page that they name."""
    with SIXTEEN.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def estimate_of(text: str) -> Estimate:
    """The estimate that a cell holds, like 1.02 [0.99, 1.04]; NaN for -."""
    value, low, high = ([value_of(word) for word in re.sub(r"[\[\],]", "", text).split()] + [np.nan] * 3)[:3]
    return Estimate(value, low, high)


def value_of(text: str) -> float:
    """The first number of a cell; NaN for -."""
    word = text.split()[0] if text.split() else "-"
    return np.nan if word == "-" else float(word)


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
