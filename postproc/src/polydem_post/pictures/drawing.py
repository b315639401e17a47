"""Draws one frame into axes: bodies and what is laid over them. Pictures and films share it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.colors import Colormap, ListedColormap, Normalize
from matplotlib.lines import Line2D
from matplotlib.path import Path
from matplotlib.transforms import Affine2D

from ..base.polygons import FloatArray
from ..base.result_file import ResultError
from ..read.frames import Frame
from ..read.trajectory import Trajectory
from .limits import MARGIN, Span
from .quantities import QUANTITIES, Quantity, range_of, stress
from .tree_cells import CellGrid, cell_grid, tree_cells

#: What can be laid over the bodies, with its meaning in a legend
OVERLAYS = {
    "contacts": "contact points",
    "forces": "contact forces",
    "boxes": "bounding boxes",
    "cells": "cells of the quadtree",
    "stress": "principal stresses",
}
NEED_CONTACTS = ("contacts", "forces", "stress")

#: Colours of the fixed bodies and of bodies without a scale, of overlays, and of values that are not known
WALL_COLOUR, PLAIN_COLOUR, UNKNOWN_COLOUR = "0.62", "#d9b98a", "0.85"
FORCE_COLOUR, CONTACT_COLOUR, BOX_COLOUR, CELL_COLOUR = "#a01020", "#d55e00", "#0072b2", "#7a3db8"
COMPRESSED_COLOUR, PULLED_COLOUR = "#a01020", "#0072b2"

#: How the border of a periodic cell is drawn, above the bodies and below what is laid over them
CELL_OUTLINE = {"color": "black", "linewidth": 0.6, "linestyle": (0.0, (4.0, 2.0)), "zorder": 2.5}

#: Colours of materials 0 to 9, as light as differ in grey too, the first ones most
MATERIAL_COLOURS = ("#e0be97", "#044786", "#eed453", "#0f9e7d", "#bb3939", "#f59b5a", "#571c53", "#cff3b4", "#0f82b1",
                    "#de7fb4")
matplotlib.colormaps.register(ListedColormap(MATERIAL_COLOURS, "materials"), force=True)

#: Width of the line of the largest force as a share of the median equivalent diameter of the free bodies, and greatest
#: width [pt]
WIDEST_FORCE, WIDEST_LINE = 0.45, 8.0

#: Share of the forces and stresses that the scale of widths and lengths covers: those of a few impacts are greater
COVERED_FORCES = 99.0

#: Widths of lines that are told apart
WIDTHS = 32

#: Width of outlines as a share of the median equivalent diameter of the free bodies, and least and greatest width [pt]
OUTLINE, OUTLINES = 0.05, (0.05, 0.8)


@dataclass(frozen=True)
class Look:
    """What pictures of a run show, alike for all frames."""

    #: Name of a quantity, or "none"
    colour: str = "none"
    #: Names of OVERLAYS
    show: tuple = ()
    #: x0, x1, y0, y1 [m]; by default those of `limits.Span`
    limits: tuple | None = None
    #: Least and greatest value of the scale of colours; found from the frames if absent
    colour_range: tuple | None = None
    #: Colour map of matplotlib; that of the quantity if absent
    colours: str | None = None
    #: Force that has the widest line [N/m]; found from the frames if absent
    greatest_force: float | None = None
    #: Pressure that has the longest cross [N/m2]; found from the frames if absent
    greatest_stress: float | None = None
    #: Whether each frame has its time as a title
    title: bool = True
    #: Whether a bar of a round length stands in place of the axes
    scale_bar: bool = False
    #: Grid of the quadtree
    grid: CellGrid | None = field(default=None, compare=False)

    @property
    def quantity(self) -> Quantity | None:
        """The quantity of the colours."""
        return QUANTITIES.get(self.colour)

    def colour_map(self, quantity: Quantity) -> Colormap:
        """The colour map."""
        colours = matplotlib.colormaps[self.colours or quantity.colours].with_extremes(bad=UNKNOWN_COLOUR)
        return colours.resampled(quantity.count) if quantity.count else colours

    @property
    def needs_contacts(self) -> bool:
        """Whether contacts must be read."""
        return any(name in NEED_CONTACTS for name in self.show) or bool(self.quantity and self.quantity.needs_contacts)

    def check(self) -> None:
        """Refuse what is not known."""
        if self.colour != "none" and self.colour not in QUANTITIES:
            raise ResultError(f"there is no colour {self.colour}; there are {', '.join(QUANTITIES)} and none")
        for name in self.show:
            if name not in OVERLAYS:
                raise ResultError(f"{name} cannot be shown; there are {', '.join(OVERLAYS)}")
        if self.colours is not None and self.colours not in matplotlib.colormaps:
            raise ResultError(f"there is no colour map {self.colours}; there are viridis, cividis, inferno, magma, "
                              "plasma, coolwarm, PuOr, twilight and the others of matplotlib")


@dataclass(frozen=True)
class SettledLook(Look):
    """A look that leaves nothing open."""

    limits: tuple[float, float, float, float] = (0.0, 1.0, 0.0, 1.0)
    colour_range: tuple[float, float] = (0.0, 1.0)
    greatest_force: float = 0.0
    greatest_stress: float = 0.0


class _Extent:
    """What all frames together span."""

    def __init__(self, start: Frame) -> None:
        self.span = Span(start)
        self.values: list[np.ndarray] = []
        self.forces: list[np.ndarray] = []
        self.stresses: list[np.ndarray] = []

    def add(self, frame: Frame, look: Look) -> None:
        """Take a frame into account."""
        self.span.add(frame)
        free = ~frame.fixed
        if look.quantity and look.colour_range is None:
            self.values += _shown(frame, look.quantity.values_with_copies(frame), free)
        if "forces" in look.show and look.greatest_force is None:
            self.forces.append(frame.contacts.force_magnitude)
        if "stress" in look.show and look.greatest_stress is None:
            self.stresses.append(np.abs(np.linalg.eigvalsh(stress(frame)[free])).max(axis=1, initial=0.0))

    def settle(self, look: Look) -> SettledLook:
        """The look with all that was left open."""
        limits, colour_range = look.limits, look.colour_range
        if limits is None:
            low, high = self.span.limits()
            limits = (low[0], high[0], low[1], high[1])
        elif np.any(self.span.everything()[1] < limits[::2]) or np.any(self.span.everything()[0] > limits[1::2]):
            spans = (f"{axis} {low:.4g} to {high:.4g} m" for axis, low, high in zip("xy", *self.span.everything()))
            raise ResultError(f"no body is within the limits {','.join(f'{side:g}' for side in limits)}; the bodies "
                              f"are at {', '.join(spans)}")
        if colour_range is None:
            colour_range = range_of(look.quantity, _joined(self.values)) if look.quantity else (0.0, 1.0)
        found = {"limits": limits, "colour_range": colour_range,
                 "greatest_force": look.greatest_force or _covered(self.forces),
                 "greatest_stress": look.greatest_stress or _covered(self.stresses)}
        return SettledLook(**{**vars(look), **found})


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    return np.concatenate(parts) if parts else np.empty(0)


def _covered(parts: list[np.ndarray]) -> float:
    values = _joined(parts)
    return float(np.percentile(values, COVERED_FORCES)) if len(values) else 0.0


def settle(trajectory: Trajectory, numbers: list[int], look: Look) -> SettledLook:
    """Find from frames what a look leaves open: limits, ranges and the grid of the quadtree."""
    look.check()
    if look.needs_contacts and not trajectory.has_contacts:
        named = [name for name in look.show if name in NEED_CONTACTS] or [look.colour]
        raise ResultError(f"{trajectory.folder}: holds no contacts, which {named[0]} needs; run with "
                          "output.contacts = .true.")
    return settle_frames(trajectory[0], trajectory[numbers], look)


def settle_frames(start: Frame, frames: Iterable[Frame], look: Look) -> SettledLook:
    """The same from the first frame of a run and those that are shown."""
    extent = _Extent(start)
    for frame in frames:
        extent.add(frame, look)
    if "cells" in look.show:
        look = replace(look, grid=cell_grid(start))
    return extent.settle(look)


def _shown(frame: Frame, values: list[np.ndarray], chosen: np.ndarray) -> list[np.ndarray]:
    """Of the values of bodies and of their copies those of chosen bodies, and of their copies in the cell."""
    own, *copies = values
    return [own[chosen], *(values[chosen & _reaches_in(frame, shift)] for shift, values in zip(frame.shifts, copies))]


def _reaches_in(frame: Frame, shift: FloatArray) -> np.ndarray:
    """Which bodies reach into the periodic cell in its copy at a vector, (n)."""
    low, high = frame.bounds[:, :2] + shift, frame.bounds[:, 2:] + shift
    inside = (high > frame.cell_low) & (low < frame.cell_low + frame.cell_size)
    return np.all(inside | (frame.cell_size == 0.0), axis=1)


class Bodies:
    """The fixed or the free bodies in axes. Of a periodic cell with its copies only what is within its border is shown.

    Their outlines are views of one array, so moving them costs little.
    """

    def __init__(self, axis: Axes, frame: Frame, look: SettledLook, are_fixed: bool, **style):
        self._axis, self._are_fixed, self._style = axis, are_fixed, style
        self._paths = self._outline(frame)
        self.artist = PathCollection(self._paths, **style)
        axis.add_collection(self.artist, autolim=False)
        self.artists = [self.artist]
        self._place(frame, look)

    def _place(self, frame: Frame, look: SettledLook) -> None:
        """Put the copies where they are, which a sheared cell changes, and colour all."""
        for _ in frame.shifts[len(self.artists) - 1 :]:
            copy = PathCollection(self._paths, **self._style)
            copy.set_animated(self.artist.get_animated())
            self._axis.add_collection(copy, autolim=False)
            self.artists.append(copy)
        for k, artist in enumerate(self.artists[1:]):
            artist.set_visible(k < len(frame.shifts))
        _shift(self._axis, frame, self.artists[1:])
        _clip_to_cell(self._axis, frame, look, self.artists)
        if look.quantity and not self._are_fixed:
            values = look.quantity.values_with_copies(frame)
            for artist, each in zip(self.artists, values):
                artist.set_array(each[self.rows])
            self.shown = np.concatenate(_shown(frame, values, frame.free))

    def _outline(self, frame: Frame) -> list[Path]:
        """The outlines of the bodies of a frame."""
        start = frame.vertex_start
        self._present = frame.id
        self.rows = np.flatnonzero(frame.fixed == self._are_fixed)
        count = np.diff(start)[self.rows]
        ends = np.cumsum(count + 1)
        begins = ends - count - 1
        # Each outline and one row more, in which a closed path needs a point.
        self._chosen = np.repeat(start[self.rows] - begins, count + 1) + np.arange(ends[-1] if len(ends) else 0)
        self._chosen[ends - 1] = start[self.rows]
        self._vertices = frame.vertex[self._chosen]
        return [Path(self._vertices[a:b], closed=True) for a, b in zip(begins, ends)]

    def set(self, **properties: Any) -> None:
        """Set properties of the artist and of its copies, also of those that come later."""
        self._style |= properties
        for artist in self.artists:
            artist.set(**properties)

    def move(self, frame: Frame, look: SettledLook) -> None:
        """Move them to where they are in another frame, which may have other bodies."""
        if np.array_equal(frame.id, self._present):
            self._vertices[:] = frame.vertex[self._chosen]
        else:
            self._paths = self._outline(frame)
            for artist in self.artists:
                artist.set_paths(self._paths)
        self._place(frame, look)


class CellOutline:
    """The border of a periodic cell, with ends of the borders of the copies above and below, which a shear moves."""

    def __init__(self, axis: Axes, frame: Frame, look: SettledLook):
        self.artist = Line2D([], [], **CELL_OUTLINE)
        axis.add_line(self.artist)
        self.artists = [self.artist]
        self.move(frame, look)

    def move(self, frame: Frame, look: SettledLook) -> None:
        """Move it to where it is in another frame."""
        lines = cell_lines(frame, look)
        self.artist.set_data(*np.concatenate([np.vstack([line, [np.nan, np.nan]]) for line in lines]).T
                             if lines else ([], []))


def cell_lines(frame: Frame, look: SettledLook) -> list[FloatArray]:
    """Lines of the border of a periodic cell, (points, 2) each [m]; none in the plane."""
    (x0, y0), (x1, y1) = _visible_cell(frame, look)
    lines = [np.array(ends) for axis, ends in (
        (0, [(x0, y0), (x0, y1)]), (0, [(x1, y0), (x1, y1)]), (1, [(x0, y0), (x1, y0)]), (1, [(x0, y1), (x1, y1)]))
        if frame.cell_size[axis] > 0.0]
    if frame.shift > 0.0:
        stub = MARGIN * max(frame.cell_size)
        lines += [np.array([(x, y), (x, y + way)]) for x, y, way in (
            (x0 + frame.shift, y1, stub), (x1 - frame.shift, y0, -stub))]
    return lines


def _visible_cell(frame: Frame, look: SettledLook) -> FloatArray:
    """Lower left and upper right corner of the periodic cell, along another axis beyond the limits, (2, 2) [m]."""
    low, high = np.array(look.limits[::2]), np.array(look.limits[1::2])
    ends = np.array([low - (high - low), high + (high - low)])
    return np.where(frame.cell_size > 0.0, [frame.cell_low, frame.cell_low + frame.cell_size], ends)


def _clip_to_cell(axis: Axes, frame: Frame, look: SettledLook, artists: list[PathCollection]) -> None:
    """Show artists within a periodic cell only."""
    if not frame.cell_size.any():
        return
    (x0, y0), (x1, y1) = _visible_cell(frame, look)
    border = Path(np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]), closed=True)
    for artist in artists:
        artist.set_clip_path(border, axis.transData)


def _shift(axis: Axes, frame: Frame, copies: list[PathCollection]) -> None:
    """Put copies of an artist into the copies around a periodic cell."""
    for shift, copy in zip(frame.shifts, copies):
        copy.set_transform(Affine2D().translate(*shift) + axis.transData)


def draw_bodies(axis: Axes, frame: Frame, look: SettledLook) -> tuple[Bodies, Bodies]:
    """Draw the fixed and the free bodies."""
    walls = Bodies(axis, frame, look, True, facecolor=WALL_COLOUR, edgecolor="none", zorder=1)
    colours = {"cmap": look.colour_map(look.quantity), "norm": Normalize(*look.colour_range)} if look.quantity else {}
    grains = Bodies(axis, frame, look, False, facecolor=PLAIN_COLOUR, edgecolor="black", linewidth=0.2, zorder=2,
                    **colours)
    return walls, grains


def overlays(axis: Axes, frame: Frame, look: SettledLook) -> list[PathCollection]:
    """Draw what is laid over the bodies. Widths are in units of the axes, which must have their final size."""
    makers = {"cells": _cells, "boxes": _boxes, "stress": _stresses, "forces": _forces, "contacts": _contacts}
    scale = points_per_metre(axis)
    # Each artist, and the same again for each copy of a periodic cell.
    alike = [artists for name, make in makers.items() if name in look.show
             for artists in zip(*(make(frame, look, scale) for _ in range(1 + len(frame.shifts))))]
    for order, artists in enumerate(alike):
        for artist in artists:
            artist.set_zorder(3 + order)
            axis.add_collection(artist, autolim=False)
        _shift(axis, frame, list(artists[1:]))
        _clip_to_cell(axis, frame, look, list(artists))
    return [artist for artists in alike for artist in artists]


def points_per_metre(axis: Axes) -> float:
    """Points of a line width (1/72 inch) per metre of the axes."""
    inverse = axis.transData.transform([(0.0, 0.0), (1.0, 0.0)])
    return float(inverse[1, 0] - inverse[0, 0]) * 72.0 / axis.figure.dpi


def fit_outlines(grains: Bodies, frame: Frame, scale: float) -> None:
    """Give the outlines of bodies a width that suits the size in which they are drawn."""
    grains.set(linewidth=float(np.clip(OUTLINE * _typical_size(frame) * scale, *OUTLINES)))


def force_width(frame: Frame, scale: float) -> float:
    """Width in points of the line of the greatest force."""
    return float(np.clip(WIDEST_FORCE * _typical_size(frame) * scale, 1.0, WIDEST_LINE))


def _typical_size(frame: Frame) -> float:
    """Median equivalent diameter of the free bodies [m]."""
    free = ~frame.fixed
    return float(np.median(frame.equivalent_diameter[free])) if free.any() else 0.0


def _forces(frame: Frame, look: SettledLook, scale: float) -> list[PathCollection]:
    """Each contact as lines from the two centres to its point, as wide as its force is large."""
    contacts = frame.contacts
    if not look.greatest_force or not len(contacts):
        return []
    # A wall is large, and its centre may be anywhere: draw no line to it.
    ends = [np.where(frame.fixed[rows][:, None], contacts.point, contacts.point - arm)
            for rows, arm in ((contacts.first_index, contacts.first_arm),
                              (contacts.second_index, contacts.second_arm))]
    widths = np.minimum(contacts.force_magnitude / look.greatest_force, 1.0) * force_width(frame, scale)
    lines = np.stack([ends[0], contacts.point, ends[1]], axis=1)
    # Lines of about the same width are one path, which is drawn much faster.
    steps = np.ceil(np.clip(widths / widths.max(initial=1e-9), 0.0, 1.0) * WIDTHS).astype(int)
    used = [step for step in range(1, WIDTHS + 1) if (steps == step).any()]
    paths = [_strokes(lines[steps == step]) for step in used]
    means = [float(widths[steps == step].mean()) for step in used]
    return [PathCollection(paths, linewidths=means, edgecolor=FORCE_COLOUR, facecolor="none", capstyle="round")]


def _strokes(lines: np.ndarray) -> Path:
    """One path of lines of the same number of points, (lines, points, 2)."""
    codes = np.full(lines.shape[:2], Path.LINETO, dtype=Path.code_type)
    codes[:, 0] = Path.MOVETO
    return Path(lines.reshape(-1, 2), codes.ravel())


def _lines(lines: np.ndarray, width: float, colour: str) -> PathCollection:
    return PathCollection([_strokes(lines)], linewidths=[width], edgecolor=colour, facecolor="none")


def _contacts(frame: Frame, look: SettledLook, scale: float) -> list[PathCollection]:
    """The contact points as crosses."""
    point, size = frame.contacts.point, 0.07 * _typical_size(frame)
    lines = [np.stack([point - arm, point + arm], axis=1) for arm in (np.array([size, size]), np.array([size, -size]))]
    return [_lines(np.concatenate(lines), float(np.clip(0.5 * size * scale, 0.3, 1.2)), CONTACT_COLOUR)]


def _boxes(frame: Frame, look: SettledLook, scale: float) -> list[PathCollection]:
    x0, y0, x1, y1 = frame.bounds[~frame.fixed].T
    outlines = np.stack([x0, y0, x1, y0, x1, y1, x0, y1, x0, y0], axis=1).reshape(-1, 5, 2)
    return [_lines(outlines, 0.5, BOX_COLOUR)]


def _cells(frame: Frame, look: SettledLook, scale: float) -> list[PathCollection]:
    if look.grid is None:
        return []
    cells = tree_cells(look.grid, frame.bounds)
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]])
    return [_lines(cells.low[:, None, :] + cells.side[:, None, None] * corners, 0.5, CELL_COLOUR)]


def _stresses(frame: Frame, look: SettledLook, scale: float) -> list[PathCollection]:
    """Each free body's principal stresses as a cross; the longest as long as the bodies are wide."""
    free = ~frame.fixed
    if not look.greatest_stress or not free.any():
        return []
    values, axes = np.linalg.eigh(stress(frame)[free])
    size = 0.9 * _typical_size(frame)
    half = 0.5 * size * np.minimum(np.abs(values) / look.greatest_stress, 1.0)
    arm = half[:, :, None] * axes.transpose(0, 2, 1)
    centre = frame.position[free][:, None, :]
    lines = np.stack([centre - arm, centre + arm], axis=2)
    width = float(np.clip(0.1 * size * scale, 0.4, 2.0))
    return [_lines(lines[values >= 0.0], width, COMPRESSED_COLOUR), _lines(lines[values < 0.0], width, PULLED_COLOUR)]


def legend_of(frame: Frame, look: SettledLook, scale: float) -> list[Line2D]:
    """What the overlays are, with a scale of the widths of forces and the lengths of crosses."""
    lines = []
    for name in look.show:
        if name == "forces" and look.greatest_force:
            widest = force_width(frame, scale)
            lines += [Line2D([], [], color=FORCE_COLOUR, linewidth=share * widest, solid_capstyle="butt",
                             label=f"force {share * look.greatest_force:.3g} N/m{more}")
                      for share, more in ((1.0, " or more"), (0.3, ""))]
        elif name == "stress" and look.greatest_stress:
            lines += [Line2D([], [], color=colour, linewidth=1.2, label=label) for colour, label in (
                (COMPRESSED_COLOUR, f"compression {look.greatest_stress:.2g} N/m² or more"),
                (PULLED_COLOUR, "tension"))]
        elif name == "contacts":
            lines.append(Line2D([], [], color=CONTACT_COLOUR, marker="x", linestyle="none", label=OVERLAYS[name]))
        elif name in ("boxes", "cells"):
            colour = BOX_COLOUR if name == "boxes" else CELL_COLOUR
            lines.append(Line2D([], [], color=colour, marker="s", markerfacecolor="none", linestyle="none",
                                label=OVERLAYS[name]))
    return lines
