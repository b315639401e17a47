"""How figures of the laboratory look and how they are written."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from polydem_post.base.result_file import cannot_write
from polydem_post.pictures.figure_style import FORMS, SETTINGS

from ..bench import series

#: Finder -> colour (Okabe & Ito 2008, told apart by the colour-blind), marker and line; no two have the same marker,
#: and lines differ in print without colours
LOOKS = {
    "quadtree": ("#0072B2", "o", "-"),
    "sort_and_sweep": ("#D55E00", "s", "-"),
    "quadtree_called": ("#56B4E9", "v", "--"),
    "quadtree_o2": ("#004A73", "$2$", ":"),
    "filtered_quadtree": ("#3B7DD8", "H", "-."),
    "pruned_quadtree": ("#CC79A7", "^", "--"),
    "partitioned_sweep": ("#B8860B", "D", "--"),
    "unsorted_sweep": ("#8B4513", "<", "-."),
    "sort_and_sweep_o2": ("#A23B00", "$S$", ":"),
    "odd_even_sweep": ("#E69F00", "1", "-"),
    "locked_sweep": ("#5B2C83", "$L$", ":"),
    "mended_sweep": ("#2F6F4F", "$M$", "-."),
    "linked_cells": ("#009E73", "P", "-"),
    "verlet": ("#000000", "X", "-"),
    "two_level": ("#7A1F5C", "d", "-."),
    "hierarchical_grid": ("#6A3D9A", "p", "--"),
    "binary_tree": ("#7F7F7F", ">", ":"),
    "all_pairs": ("#9A9A9A", "*", "-"),
}

#: The paper's numbers are drawn thus
PAPER = {"color": "0.45", "linestyle": (0, (1, 1.5)), "linewidth": 1.4}

@dataclass
class Drawing:
    """A figure with its name and what is to be read under it."""

    name: str
    figure: Figure
    caption: str


def panels(count: int = 1, width: float = 4.6, height: float = 3.4) -> tuple:
    """A figure with panels side by side."""
    figure = Figure(figsize=(width * count, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(1, count, squeeze=False)[0]


def panels_with_legend(count: int, width: float, height: float, rows: int) -> tuple:
    """A figure with panels side by side, and below them an empty one for a legend of so many rows that all share."""
    figure, (row,), below = grid_with_legend(1, count, width, height, rows)
    return figure, row, below


def grid_with_legend(rows_of_panels: int, columns: int, width: float, height: float, rows: int) -> tuple:
    """Rows of panels, and below them an empty one for a legend of so many rows that all share."""
    figure = Figure(figsize=(width * columns, height * rows_of_panels + 0.22 * rows), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(rows_of_panels + 1, columns, height_ratios=[height] * rows_of_panels + [0.22 * rows])
    below = figure.add_subplot(grid[rows_of_panels, :])
    below.axis("off")
    panels_of_rows = [[figure.add_subplot(grid[r, k]) for k in range(columns)] for r in range(rows_of_panels)]
    return figure, panels_of_rows, below


def shared_legend(below, axes, columns: int) -> None:
    """Every label once, in the empty panel."""
    entries: dict = {}
    for axis in axes:
        for handle, label in zip(*axis.get_legend_handles_labels()):
            entries.setdefault(label, handle)
    below.legend(entries.values(), entries.keys(), ncol=columns, loc="center", fontsize=8, borderpad=0.0)


def style_of(finder: str) -> dict:
    """Colour, marker and line of a finder."""
    colour, marker, line = LOOKS.get(finder, ("0.3", "h", "-"))
    return {"color": colour, "marker": marker, "markersize": 4.5, "linestyle": line}


def over_size(axis, label: str, logarithmic: bool = True) -> None:
    """Boxes from left to right, what the label says upwards."""
    axis.set(xscale="log", xlabel="boxes", ylabel=label, yscale="log" if logarithmic else "linear")
    axis.xaxis.set_major_formatter(FuncFormatter(_thousands))
    if logarithmic:
        readable_decades(axis.yaxis)
    low, high = axis.get_xlim()
    axis.xaxis.set_minor_formatter(NullFormatter())
    if high / low < 300.0:
        axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high / low < 30.0 else (1.0, 3.0)))


def readable_decades(axis) -> None:
    """Plain numbers at a logarithmic axis, with 2 and 5 between if it is short."""
    low, high = axis.get_view_interval()
    if high / max(low, 1e-300) < 30.0:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def _thousands(value: float, _) -> str:
    if value >= 1e6:
        return f"{value / 1e6:g}M"
    return f"{value / 1e3:g}k" if value >= 1e3 else f"{value:g}"


def draw_estimates(axis, x, estimates: list, **style) -> None:
    """Points with their intervals, joined by a line unless the style says otherwise."""
    y = np.array([estimate.value for estimate in estimates])
    low = np.array([estimate.low if np.isfinite(estimate.low) else estimate.value for estimate in estimates])
    high = np.array([estimate.high if np.isfinite(estimate.high) else estimate.value for estimate in estimates])
    spread = np.maximum(np.stack([y - low, high - y]), 0.0)
    bars = axis.errorbar(x, y, yerr=spread, elinewidth=0.9, capsize=2.0, **{"linewidth": 1.1, **style})
    for bar in bars.lines[2]:
        bar.set_linestyle("-")  # intervals are no curves


def draw_law(axis, law: series.Law, **style) -> None:
    """A fitted power law over the sizes that it was fitted to."""
    axis.plot(law.sizes, law.at(law.sizes), **{"linewidth": 1.1, "zorder": 1, **style})


def mark_caches(axis, sizes: list) -> None:
    """Vertical lines where a finder outgrows a level of the caches: [(name, boxes)]."""
    low, high = axis.get_xlim()
    for name, boxes in sizes:
        if low < boxes < high:
            axis.axvline(boxes, color="0.6", linewidth=0.8, linestyle="--", zorder=0)
            axis.annotate(
                name,
                (boxes, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(2, -2),
                fontsize=8,
                textcoords="offset points",
                va="top",
                color="0.35",
            )


def save_drawing(drawing: Drawing, folder: Path) -> list[Path]:
    """Write a figure in all FORMS, without anything in it that changes from call to call."""
    paths = [folder / f"{drawing.name}.{form}" for form in FORMS]
    try:
        with matplotlib.rc_context(SETTINGS):
            for path, metadata in zip(paths, FORMS.values()):
                drawing.figure.savefig(path, dpi=200, metadata=metadata)
    except OSError as error:
        raise cannot_write(folder, error) from error
    return paths
