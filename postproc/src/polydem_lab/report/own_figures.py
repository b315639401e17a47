"""Figures that every bench has, whatever its scenes are: time over size, and all scenes with all finders."""

from __future__ import annotations

import matplotlib

from ..bench import series
from ..bench.samples import Bench
from ..bench.statistics import typical
from ..claims.own_scenes import families, family_name, way_of
from .style import (
    LOOKS,
    SETTINGS,
    Drawing,
    draw_estimates,
    grid_with_legend,
    over_size,
    readable_decades,
    shared_legend,
    style_of,
)

#: Most families of scenes in one figure, and most panels side by side
MOST_PANELS, COLUMNS = 6, 3


def own_drawings(bench: Bench) -> list[Drawing]:
    """Those that the samples can give."""
    here = bench.on()
    with matplotlib.rc_context(SETTINGS):
        drawn = [own_over_size(here), all_scenes(here)]
    return [drawing for drawing in drawn if drawing]


def own_over_size(bench: Bench) -> Drawing | None:
    """Time over size of scenes that are no drums, one panel for scenes that differ in their size alone."""
    found = [cases for cases in families(bench) if len({case.boxes for case in cases}) > 1] or families(bench)
    if not found:
        return None
    found = found[:MOST_PANELS]
    columns = min(COLUMNS, len(found))
    rows = -(-len(found) // columns)
    figure, grid, below = grid_with_legend(rows, columns, 6.4 if columns == 1 else 3.4, 3.0, rows=3)
    axes = [axis for row in grid for axis in row]
    for axis, cases in zip(axes, found):
        for finder in sorted({case.finder for case in cases}, key=_rank):
            own = sorted((case for case in cases if case.finder == finder), key=lambda case: case.boxes)
            draw_estimates(axis, [case.boxes for case in own], [typical(case.time()) for case in own], label=finder,
                           **style_of(finder))
        over_size(axis, "time per box and step [ns]")
        axis.set_title(family_name(cases), fontsize=9)
    for axis in axes[len(found):]:
        axis.axis("off")
    shared_legend(below, axes[: len(found)], columns=4 if columns > 1 else 3)
    return Drawing(
        "own_over_size", figure,
        f"Time per box and step over the number of boxes ({way_of(bench).text}), first step excluded: one panel for "
        "scenes that differ in their size alone; drums on one thread are in figures of their own, scenes of one "
        "size in `all_scenes` if others have several. Median and 95 % interval.",
    )


def all_scenes(bench: Bench) -> Drawing | None:
    """All scenes with all finders: which one suits what."""
    way = way_of(bench)
    cases = [case for case in bench.select(threads=way.threads, mode=way.mode) if case.time()]
    scenes = list(dict.fromkeys(case.scene for case in sorted(cases, key=lambda case: (series.kind(case), case.boxes))))
    finders = sorted({case.finder for case in cases}, key=_rank)
    if not scenes:
        return None
    rows = -(-len(finders) // 4)
    figure, ((axis,),), below = grid_with_legend(1, 1, 7.0, max(2.0, 0.26 * len(scenes) + 0.8), rows=rows)
    for k, finder in enumerate(finders):
        of_finder = {case.scene: typical(case.time()) for case in cases if case.finder == finder}
        shift = 0.7 * ((k + 0.5) / len(finders) - 0.5)
        places = [scenes.index(scene) + shift for scene in of_finder]
        values = [estimate.value for estimate in of_finder.values()]
        axis.plot(values, places, label=finder, **{**style_of(finder), "linestyle": "none", "markersize": 4.0})
    for k in range(0, len(scenes), 2):
        axis.axhspan(k - 0.5, k + 0.5, color="0.94", zorder=-1)
    axis.set(xscale="log", xlabel="time per box and step [ns]", ylim=(len(scenes) - 0.5, -0.5))
    readable_decades(axis.xaxis)
    axis.set_yticks(range(len(scenes)), scenes, fontsize=7)
    shared_legend(below, [axis], columns=4)
    return Drawing(
        "all_scenes", figure,
        f"Time per box and step of all finders on all scenes, by kind and size ({way.text}), first step excluded: "
        "medians. Within a row "
        "the finders are shifted, so that none hides another.",
    )


def _rank(finder: str) -> int:
    """Place of a finder in legends."""
    return list(LOOKS).index(finder) if finder in LOOKS else len(LOOKS)
