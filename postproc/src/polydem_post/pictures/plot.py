"""Pictures of frames."""

from __future__ import annotations

import io
import math
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PathCollection
from matplotlib.colorbar import Colorbar
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.axes_grid1.anchored_artists import AnchoredSizeBar  # type: ignore[import-untyped]

from ..base.new_file import insist_on_own, new_file
from ..base.result_file import ResultError, cannot_write
from ..read.frames import Frame
from ..read.trajectory import Trajectory
from . import drawing
from .drawing import Look, SettledLook
from .figure_style import FORMS, SETTINGS

#: Longest side of the picture of one frame, and of a page of several [mm]
LONGEST_SIDE, PAGE = 178.0, 260.0

#: Millimetres in an inch
INCH = 25.4

#: Picture elements per inch, unless they are given
DPI = 150

#: Greatest length of the bar of a scale as a share of the width of what is shown
BAR = 0.25

#: Frames that stand in one row, unless they are more than so many times wider than high
ONE_ROW, WIDEST = 3, 3.0


def plot_frames(trajectory: Trajectory, numbers: list[int], look: Look | None = None, size: tuple | None = None,
                columns: int | None = None, dpi: float = DPI) -> Figure:
    """Draw frames in one figure on one scale of colours and lengths; `size` is its width and height [mm]."""
    settled = drawing.settle(trajectory, numbers, look or Look())
    return _figure([trajectory[number] for number in numbers], settled, size, columns, dpi)


def picture(frame: Frame) -> bytes:
    """A frame as notebooks show it: PNG, coloured by the speed."""
    file = io.BytesIO()
    figure = _figure([frame], drawing.settle_frames(frame, [frame], Look()), None, None, DPI)
    figure.savefig(file, format="png")
    return file.getvalue()


def _figure(frames: list[Frame], settled: SettledLook, size: tuple | None, columns: int | None, dpi: float) -> Figure:
    columns = min(columns or _columns(len(frames), settled), len(frames))
    rows = -(-len(frames) // columns)
    width, height = size or _size(settled, rows, columns)
    figure = Figure(figsize=(width / INCH, height / INCH), dpi=dpi, layout="compressed")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
    for axis in axes[len(frames) :]:
        axis.remove()
    axes = axes[: len(frames)]
    for place, (axis, frame) in enumerate(zip(axes, frames)):
        prepare(axis, settled, f"t = {frame.time:.4g} s")
        if settled.scale_bar and place == (rows - 1) * columns:
            add_scale_bar(axis, settled)
        axis.label_outer()
        if place + columns >= len(axes):  # the lowest of its column, also above an empty place
            axis.xaxis.set_tick_params(labelbottom=True)
            axis.set_xlabel("x [m]")
    _finish(figure, axes, frames, settled)
    return figure


def draw(frame: Frame, axes: Axes, **look: Any) -> PathCollection:
    """Draw a frame into axes of a figure of your own, as `plot` does; returns the free bodies, for a `colorbar`.

    Keywords are those of `pictures.drawing.Look`: `colour` (a quantity, "none" unless given), `show` (names of
    overlays, as ("forces",)), `limits` (x0, x1, y0, y1) [m], `colour_range` (least, greatest), `colours` (a colour map
    of matplotlib), `greatest_force` [N/m], `greatest_stress` [N/m2] and `scale_bar`. What is not given is found from
    this frame: give the ranges where several frames shall be on one scale.

    The axes get limits and equal scales; titles, labels and legends are left to you. Lines that are as wide as forces
    suit the size that the axes have now, so give them their place before.
    """
    wanted = Look(**look)
    wanted.check()
    settled = drawing.settle_frames(frame, [frame], wanted)
    x0, x1, y0, y1 = settled.limits
    axes.set(xlim=(x0, x1), ylim=(y0, y1))
    axes.set_aspect("equal", adjustable="box")
    axes.apply_aspect()
    if settled.scale_bar:
        add_scale_bar(axes, settled)
    return _fill(axes, frame, settled, drawing.draw_bodies(axes, frame, settled)[1]).artist


def prepare(axis, look: SettledLook, title: str) -> None:
    """Limits, labels and equal scales of axes."""
    x0, x1, y0, y1 = look.limits
    axis.set(xlim=(x0, x1), ylim=(y0, y1), xlabel="x [m]", ylabel="y [m]")
    axis.set_aspect("equal", adjustable="box")
    if look.title:
        axis.set_title(title, fontsize=9)
    axis.spines[["top", "right"]].set_visible(False)
    if look.scale_bar:
        axis.set_axis_off()


def add_scale_bar(axis: Axes, look: SettledLook) -> None:
    """A bar of a round length below the axes, in their place."""
    axis.set_axis_off()
    length = round_length(BAR * (look.limits[1] - look.limits[0]))
    axis.add_artist(AnchoredSizeBar(axis.transData, length, length_text(length), "upper left", pad=0.0, borderpad=0.4,
                                    sep=3.0, frameon=False, bbox_to_anchor=(0.0, 0.0), bbox_transform=axis.transAxes,
                                    size_vertical=0.004 * (look.limits[3] - look.limits[2]), fill_bar=True))


def round_length(most: float) -> float:
    """The greatest of 1, 2 and 5 times a power of ten that is not above a length."""
    power = 10.0 ** math.floor(math.log10(most))
    return max(digit * power for digit in (1.0, 2.0, 5.0) if digit * power <= most * (1.0 + 1e-12))


def length_text(length: float) -> str:
    """A length [m] in a unit in which it is a number from 1 to 999, if there is one."""
    for unit, size in (("km", 1e3), ("m", 1.0), ("mm", 1e-3), ("µm", 1e-6)):
        if length >= size * (1.0 - 1e-12):
            return f"{length / size:.4g} {unit}"
    return f"{length:.4g} m"


def add_scale(figure: Figure, axes, grains, look: SettledLook, extend: str | None = None,
              materials: Sequence[str] = ()) -> Colorbar | None:
    """The scale of colours beside the axes, with arrows where bodies lie outside it, unless they are given.

    Colours of materials have their names.
    """
    if not look.quantity:
        return None
    low, high = look.colour_range
    values = np.concatenate([each.shown for each in grains])
    values = values[np.isfinite(values)]
    below, above = bool((values < low).any()), bool((values > high).any())
    arrows = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}
    x0, x1, y0, y1 = look.limits
    rows, columns = axes[0].get_gridspec().get_geometry()
    bar = figure.colorbar(grains[0].artist, ax=list(axes), label=look.quantity.title, pad=0.02, fraction=0.05,
                          aspect=30.0 * float(np.clip(rows * (y1 - y0) / (columns * (x1 - x0)), 1.0, 1.6)),
                          extend=extend or arrows[below, above])
    if look.quantity.label == "material" and materials:
        bar.set_ticks(range(1, len(materials) + 1), labels=materials)
        bar.ax.set_ylim(0.5, len(materials) + 0.5)
    elif look.quantity.count:
        bar.set_ticks(range(0, look.quantity.count, max(look.quantity.count // 10, 1)))
    elif look.quantity.span == "turn" and look.colour_range == (0.0, 2.0 * np.pi):
        bar.set_ticks([0.0, 0.5 * np.pi, np.pi, 1.5 * np.pi, 2.0 * np.pi], labels=["0", "π/2", "π", "3π/2", "2π"])
    return bar


def _finish(figure: Figure, axes, frames: list[Frame], look: SettledLook) -> None:
    """Draw bodies, scale and legend; then, as the axes have their size, what is as wide as bodies."""
    grains = [drawing.draw_bodies(axis, frame, look)[1] for axis, frame in zip(axes, frames)]
    add_scale(figure, axes, grains, look, materials=frames[0].material_names)
    finish_axes(figure, axes, frames[0], look)
    for axis, frame, each in zip(axes, frames, grains):
        _fill(axis, frame, look, each)


def _fill(axis: Axes, frame: Frame, look: SettledLook, grains: drawing.Bodies) -> drawing.Bodies:
    """Give bodies in axes of their final size outlines, overlays and the border of the cell."""
    drawing.fit_outlines(grains, frame, drawing.points_per_metre(axis))
    drawing.overlays(axis, frame, look)
    drawing.CellOutline(axis, frame, look)
    return grains


def finish_axes(figure: Figure, axes, frame: Frame, look: SettledLook) -> None:
    """Give the axes their final size, with ticks that have room and the legend of overlays."""
    legend = None
    for _ in range(2):  # the legend takes room, which changes the scale
        _lay_out(figure)
        for axis in axes:
            _fit_ticks(axis)
        if legend:
            legend.remove()
        lines = drawing.legend_of(frame, look, drawing.points_per_metre(axes[0]))
        if not lines:
            break
        legend = figure.legend(handles=lines, loc="outside lower center", ncols=_legend_columns(figure, lines),
                               frameon=False, fontsize=7, handlelength=2.2)
    _lay_out(figure)


def _lay_out(figure: Figure) -> None:
    """Give everything its place."""
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message=".*layout not applied")
        try:
            figure.draw_without_rendering()
        except UserWarning as warning:
            raise ResultError(f"the figure of {figure.get_figwidth() * INCH:.0f} mm x "
                              f"{figure.get_figheight() * INCH:.0f} mm is too small for its contents; give a "
                              "larger --size") from warning


def _fit_ticks(axis) -> None:
    """As many numbers at the axes as there is room for."""
    box = axis.get_window_extent()
    for which, length, room in ((axis.xaxis, box.width, 0.8), (axis.yaxis, box.height, 0.4)):
        which.set_major_locator(MaxNLocator(nbins=int(np.clip(length / axis.figure.dpi / room, 1, 7)),
                                            steps=[1, 2, 2.5, 5, 10], min_n_ticks=2))


def _legend_columns(figure: Figure, lines: list) -> int:
    """As many entries side by side as the figure has room for."""
    longest = max(len(line.get_label()) for line in lines)
    return max(1, min(len(lines), int(figure.get_figwidth() / (0.058 * longest + 0.5))))


def save(figure: Figure, path: Path, dpi: float = DPI, tight: bool = False) -> None:
    """Write a figure without anything in it that changes from run to run; `tight`: without empty margins."""
    form = check_form(path)
    insist_on_own(path)
    with new_file(path) as part, matplotlib.rc_context(SETTINGS):
        try:
            figure.savefig(part, dpi=dpi, metadata=FORMS[form], bbox_inches="tight" if tight else None,
                           pad_inches=0.05)
        except ValueError as error:
            raise cannot_write(path, error) from error


def check_form(path: Path) -> str:
    """The form of a picture by the end of its name."""
    form = path.suffix[1:].lower()
    if form not in FORMS:
        hint = "; ./polydem movie makes films" if form in ("gif", "mp4") else ""
        raise ResultError(f"{path}: cannot be written: the name must end with {', '.join('.' + each for each in FORMS)}"
                          f"{hint}")
    return form


def _columns(count: int, look: SettledLook) -> int:
    """Panels side by side: up to three in a row, more so that the figure is about as wide as a page."""
    x0, x1, y0, y1 = look.limits
    if count <= ONE_ROW and x1 - x0 <= WIDEST * (y1 - y0):
        return count
    return max(1, min(count, round(math.sqrt(1.6 * count * (y1 - y0) / (x1 - x0)))))


def _size(look: SettledLook, rows: int, columns: int) -> tuple[float, float]:
    """Width and height of a figure whose panels have their shape [mm]."""
    x0, x1, y0, y1 = look.limits
    extent = np.array([x1 - x0, y1 - y0])
    longest = LONGEST_SIDE if rows * columns == 1 else PAGE / max(rows, columns)
    panel = np.maximum(longest * extent / extent.max(), 30.0)
    return columns * (panel[0] + 8.0) + 32.0, rows * (panel[1] + 14.0) + 12.0 + 6.0 * bool(look.show)
