"""Geometry of many polygons at once: areas, centroids, moments of inertia, clipping.

The vertices of all polygons are the rows of one array (total, 2); polygon k has the rows start[k] to start[k + 1] - 1.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


def join(outlines: list[FloatArray]) -> tuple[FloatArray, IntArray]:
    """Vertices of all outlines in one array, and where those of each begin, with the number of all at the end."""
    start = np.concatenate([[0], np.cumsum([len(outline) for outline in outlines])]).astype(np.int64)
    vertex = np.concatenate([np.empty((0, 2)), *(np.asarray(outline, dtype=float) for outline in outlines)])
    return vertex, start


def join_pieces(vertex: FloatArray, start: npt.NDArray[np.integer], piece: IntArray) -> tuple[FloatArray, IntArray]:
    """Outlines of bodies whose rows are those of several convex pieces; `piece` numbers them within each body."""
    outlines = []
    for first, last in zip(start, start[1:]):
        ends = np.flatnonzero(np.diff(piece[first:last])) + 1
        outlines.append(outline_of(np.split(vertex[first:last], ends)))
    return join(outlines)


def outline_of(pieces: list[FloatArray]) -> FloatArray:
    """The outline of anticlockwise polygons that touch: edges that two of them share, wholly or in part, are left out.

    If it is not one closed line (islands, holes), the lines are joined by two coincident edges each, so that sums
    over edges, such as areas, and fillings remain right.
    """
    if len(pieces) == 1:
        return pieces[0]
    points = np.concatenate(pieces)
    near = 1e-7 * float(np.ptp(points, axis=0).max())
    labels = np.array([np.argmin(np.hypot(*(points - point).T) > near) for point in points])
    edges: set[tuple[int, int]] = set()
    row = 0
    for polygon in pieces:
        own = labels[row : row + len(polygon)]
        row += len(polygon)
        for a, b in zip(own, np.roll(own, -1)):
            along = points[b] - points[a]
            offset = points - points[a]
            place = offset @ along / (along @ along)
            distance = np.abs(offset[:, 0] * along[1] - offset[:, 1] * along[0]) / np.hypot(*along)
            on_edge = np.flatnonzero((distance < near) & (place > 0.0) & (place < 1.0))
            stops = [a, *dict.fromkeys(labels[on_edge[np.argsort(place[on_edge])]].tolist()), b]
            stops = list(dict.fromkeys(int(stop) for stop in stops))
            for edge in zip(stops, stops[1:]):
                if edge[::-1] in edges:
                    edges.remove(edge[::-1])
                else:
                    edges.add(edge)
    return _chained(points, edges)


def _chained(points: FloatArray, edges: set[tuple[int, int]]) -> FloatArray:
    """Closed lines of edges, given by rows of points, in one outline."""
    after: dict[int, list[int]] = {}
    for a, b in sorted(edges):
        after.setdefault(a, []).append(b)
    rows: list[int] = []
    while any(after.values()):
        first = next(a for a, ends in after.items() if ends)
        line = [first]
        while after.get(line[-1]):
            line.append(after[line[-1]].pop())
            if line[-1] == first:
                break
        rows = [*rows, *line, rows[0]] if rows else line
    return points[rows[:-1]]


def following(start: npt.NDArray[np.integer]) -> IntArray:
    """Row of the next vertex of the same polygon, for each vertex."""
    rows = np.arange(1, int(start[-1]) + 1)
    rows[np.asarray(start[1:]) - 1] = start[:-1]
    return rows


def sums(values: FloatArray, start: npt.NDArray[np.integer]) -> FloatArray:
    """Sum of the rows of each polygon; none may be empty."""
    if len(start) < 2:
        return np.empty((0, *values.shape[1:]))
    total: FloatArray = np.add.reduceat(values, start[:-1], axis=0)
    return total


def moments(vertex: FloatArray, start: npt.NDArray[np.integer]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Signed areas [m2], centroids [m] and second moments about the centroids [m4]; anticlockwise areas are positive.

    The formulas of Green's theorem, with coordinates relative to the first vertex of each polygon, so that rounding
    errors scale with the size of a polygon and not with its place.
    """
    count = np.diff(start)
    origin = vertex[np.asarray(start[:-1])]
    here = vertex - np.repeat(origin, count, axis=0)
    after = here[following(start)]
    cross = here[:, 0] * after[:, 1] - here[:, 1] * after[:, 0]
    area = 0.5 * sums(cross, start)
    first = sums(cross[:, None] * (here + after), start) / 6.0
    square = np.sum(here * here + here * after + after * after, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        centre = first / area[:, None]
    second = sums(cross * square, start) / 12.0 - area * np.sum(centre * centre, axis=1)
    return area, origin + centre, second


def thicknesses(vertex: FloatArray, start: npt.NDArray[np.integer]) -> FloatArray:
    """Thickness of each convex polygon [m]: twice the smallest distance of an edge from the centroid."""
    _, centre, _ = moments(vertex, start)
    edge, arm = vertex[following(start)] - vertex, vertex - np.repeat(centre, np.diff(start), axis=0)
    distance = np.abs(arm[:, 0] * edge[:, 1] - arm[:, 1] * edge[:, 0]) / np.hypot(edge[:, 0], edge[:, 1])
    thickness: FloatArray = 2.0 * np.minimum.reduceat(distance, np.asarray(start[:-1]))
    return thickness


def clip(outline: FloatArray, point: FloatArray, normal: FloatArray) -> FloatArray:
    """The part of a polygon on the inner side of a line, which passes through a point and has an outward normal.

    Sutherland & Hodgman, Commun. ACM 17 (1974) 32; exact for any simple polygon as far as areas are concerned.
    """
    if len(outline) == 0:
        return outline
    depth = (outline - point) @ normal
    after, depth_after = np.roll(outline, -1, axis=0), np.roll(depth, -1)
    inside, crosses = depth <= 0.0, (depth <= 0.0) != (depth_after <= 0.0)
    pieces = []
    for k in range(len(outline)):
        if inside[k]:
            pieces.append(outline[k])
        if crosses[k]:
            share = depth[k] / (depth[k] - depth_after[k])
            pieces.append(outline[k] + share * (after[k] - outline[k]))
    return np.array(pieces) if pieces else np.empty((0, 2))


def clip_convex(outline: FloatArray, window: FloatArray) -> FloatArray:
    """The part of a polygon inside a convex window with anticlockwise vertices."""
    for point, end in zip(window, np.roll(window, -1, axis=0)):
        edge = end - point
        outline = clip(outline, point, np.array([edge[1], -edge[0]]))
    return outline


def area_of(outline: FloatArray) -> float:
    """Area of one polygon; clockwise vertices give a negative one."""
    if len(outline) < 3:
        return 0.0
    here = outline - outline[0]
    after = np.roll(here, -1, axis=0)
    return 0.5 * float(np.sum(here[:, 0] * after[:, 1] - here[:, 1] * after[:, 0]))
