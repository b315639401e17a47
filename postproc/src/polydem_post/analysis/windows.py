"""Windows: convex areas over which is averaged."""

from __future__ import annotations

from typing import Any, Union

import numpy as np

from ..base.convex import OutlineError, concave_vertices, tidy
from ..base.polygons import FloatArray, area_of, clip_convex
from ..base.result_file import ResultError
from ..read.frames import Frame

#: A rectangle (least x, least y, greatest x, greatest y) [m], or the vertices of a convex polygon [m]
Window = Union[tuple[float, float, float, float], FloatArray]


def rectangle(low_x: float, low_y: float, high_x: float, high_y: float) -> FloatArray:
    """Vertices of a rectangle, anticlockwise [m]."""
    return np.array([(low_x, low_y), (high_x, low_y), (high_x, high_y), (low_x, high_y)])


def outline_of(window: Any) -> FloatArray:
    """Vertices of a window, anticlockwise; ResultError if it is not convex or has no area."""
    values = np.asarray(window, dtype=float)
    try:
        outline = tidy(rectangle(*values) if values.shape == (4,) else values)
    except OutlineError as error:
        raise ResultError(f"the window cannot be used: {error}") from error
    if concave_vertices(outline):
        raise ResultError("the window cannot be used: it is not convex")
    if values.shape == (4,) and not (values[0] < values[2] and values[1] < values[3]):
        raise ResultError("the window cannot be used: it is (least x, least y, greatest x, greatest y)")
    return outline


def shifts_into(frame: Frame, window: FloatArray) -> FloatArray:
    """Vectors by which bodies are moved to be counted in a window: none, and those to the copies of a periodic cell.

    ResultError if the window reaches beyond the copies around the cell, or out of a sheared cell along y, where copies
    have other velocities.
    """
    own = np.zeros((1, 2))
    periodic = frame.cell_size > 0.0
    if not periodic.any():
        return own
    margin = np.where(periodic, frame.cell_size, np.inf)
    if frame.shift > 0.0:
        margin[1] = 0.0
    slack = 1e-9 * frame.cell_size
    low, high = frame.cell_low - margin - slack, frame.cell_low + frame.cell_size + margin + slack
    if np.any(window.min(axis=0) < low) or np.any(window.max(axis=0) > high):
        raise ResultError("the window cannot be used: it reaches further out of the periodic cell than its copies; "
                          f"the cell is {frame.cell_size[0]:g} m wide and {frame.cell_size[1]:g} m high, from "
                          f"{frame.cell_low[0]:g}, {frame.cell_low[1]:g}")
    return np.concatenate([own, frame.shifts])


def _edges(window: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """A point and the outward normal of each edge."""
    after = np.roll(window, -1, axis=0)
    return [(point, np.array([end[1] - point[1], point[0] - end[0]])) for point, end in zip(window, after)]


def contains(window: FloatArray, points: FloatArray) -> Any:
    """Whether each point is inside the window or on its edge, (n)."""
    inside = np.ones(len(points), dtype=bool)
    for point, normal in _edges(window):
        inside &= (points - point) @ normal <= 0.0
    return inside


def share_inside(window: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """The share of the length of each segment that is inside the window, (n)."""
    enter, leave = np.zeros(len(start)), np.ones(len(start))
    for point, normal in _edges(window):
        depth, change = (start - point) @ normal, (end - start) @ normal
        with np.errstate(divide="ignore", invalid="ignore"):
            at = -depth / change
        enter = np.where(change < 0.0, np.maximum(enter, at), enter)
        leave = np.where(change > 0.0, np.minimum(leave, at), leave)
        leave = np.where((change == 0.0) & (depth > 0.0), -1.0, leave)
    return np.maximum(leave - enter, 0.0)


def area_inside(frame: Frame, window: FloatArray) -> FloatArray:
    """The area of each body inside the window [m2], (n): exact, by clipping the polygons that cross its edge.

    In a periodic cell that of all copies of the body.
    """
    area = np.zeros(len(frame))
    for shift in shifts_into(frame, window):
        # Fixed bodies that span the cell have no copies along it.
        alone = (frame.spans & (shift != 0.0)).any(axis=1)
        area += np.where(alone, 0.0, _own_area_inside(frame, window - shift))
    return area


def _own_area_inside(frame: Frame, window: FloatArray) -> FloatArray:
    """The area of each body inside the window, without copies [m2], (n)."""
    area = np.zeros(len(frame))
    low, high = window.min(axis=0), window.max(axis=0)
    bounds = frame.bounds
    near = np.flatnonzero((bounds[:, 0] < high[0]) & (bounds[:, 2] > low[0])
                          & (bounds[:, 1] < high[1]) & (bounds[:, 3] > low[1]))
    inside = contains(window, frame.vertex)
    whole = np.logical_and.reduceat(inside, frame.vertex_start[:-1]) if len(frame) else np.empty(0, dtype=bool)
    for k in near:
        area[k] = frame.area[k] if whole[k] else area_of(clip_convex(frame.vertices[k], window))
    return area
