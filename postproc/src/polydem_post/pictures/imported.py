"""The outlines of imported bodies over the picture from which they were made."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from ..base.polygons import FloatArray, outline_of
from ..base.result_file import reading_any
from ..tracing import FORMAT_OF_SUFFIX, Picture, read_picture
from .figure_style import SETTINGS
from .plot import INCH, LONGEST_SIDE

#: Widths of the lines of outlines and of pieces [pt], and their colours, which no grey picture has
WIDTHS, COLOURS = (0.9, 0.35), ("tab:orange", "tab:cyan")
#: Bodies up to which each has its number
NUMBERED = 400


def draw_import(source: str | os.PathLike[str] | Picture, bodies: str | os.PathLike[str], *, form: str = "",
                scale: float | None = None) -> Figure:
    """Draw the bodies of a file, outlines thick, pieces thin, with their numbers, over the picture they are from.

    `source`, `form` and `scale` are those of `import_bodies`, or an array. Beside pictures there is nothing below.
    """
    outlines, pieces = _outlines(Path(bodies))
    behind = None
    if isinstance(source, np.ndarray):
        behind = source
    elif (form or FORMAT_OF_SUFFIX.get(Path(source).suffix.lower(), "")) == "picture":
        behind = read_picture(Path(source))
    everything = np.concatenate(outlines)
    low, high = everything.min(axis=0), everything.max(axis=0)
    if behind is not None:
        low, high = np.zeros(2), (scale or 1.0) * np.array(behind.shape[1::-1], dtype=float)
    width, height = LONGEST_SIDE / INCH * (high - low) / (high - low).max()
    with matplotlib.rc_context(SETTINGS):
        figure = Figure(figsize=(max(width, 1.0) + 0.6, max(height, 1.0) + 0.5), layout="compressed")
        FigureCanvasAgg(figure)
        axes = figure.subplots()
        if behind is not None:
            axes.imshow(behind, cmap="gray", extent=(low[0], high[0], low[1], high[1]), interpolation="nearest")
        _draw(axes, outlines, pieces)
        axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title=f"{len(outlines)} bodies")
    return figure


def _draw(axes: Any, outlines: list[FloatArray], pieces: list[FloatArray]) -> None:
    """Outlines, pieces and numbers."""
    for lines, width, colour in zip((pieces, outlines), WIDTHS[::-1], COLOURS[::-1]):
        axes.add_collection(LineCollection([np.concatenate([line, line[:1]]) for line in lines], linewidths=width,
                                           colors=colour))
    axes.autoscale_view()
    for number, outline in enumerate(outlines, 1) if len(outlines) <= NUMBERED else ():
        axes.text(*(0.5 * (outline.min(axis=0) + outline.max(axis=0))), str(number), color="yellow", fontsize=6.0,
                  ha="center", va="center", path_effects=[withStroke(linewidth=1.2, foreground="black")])


def _outlines(path: Path) -> tuple[list[FloatArray], list[FloatArray]]:
    """The outline of each body of a bodies file, and the pieces of those with several, before the shift [m]."""
    with reading_any(path) as file:
        vertex, start = file["vertex"][:], file["vertex_start"][:]
        piece = file["piece"][:] if "piece" in file else np.zeros(len(vertex), dtype=np.int64)
        vertex = vertex + np.array([file.attrs.get("origin_x", 0.0), file.attrs.get("origin_y", 0.0)])
    outlines, pieces = [], []
    for begin, end in zip(start, start[1:]):
        number = piece[begin:end]
        parts = [vertex[begin:end][number == k] for k in np.unique(number)]
        outlines.append(outline_of(parts) if len(parts) > 1 else parts[0])
        pieces += parts if len(parts) > 1 else []
    return outlines, pieces
