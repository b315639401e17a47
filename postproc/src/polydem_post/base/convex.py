"""Convex polygons: whether an outline is one, and its decomposition into some."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .polygons import FloatArray, area_of

#: A vertex is dropped if it is closer to its neighbour, or to the line of its neighbours, than this fraction of the
#: size: redundant_share of src/geometry/polygon.f90
REDUNDANT_SHARE = 1e-9

#: Areas of triangles that count as none in a decomposition, relative to the size of the outline squared
ROUNDOFF = 1e-12

#: Vertices, neighbours on the outline, that are compared together
RUN = 64

#: Greatest coordinate [m]: areas and moments of inertia of greater polygons overflow
GREATEST = 1e50


class OutlineError(Exception):
    """What is wrong with an outline, without its name."""


def tidy(points: FloatArray) -> FloatArray:
    """The outline anticlockwise, without repeated and without redundant vertices; OutlineError if it has no area.

    The rule is that of the program (src/geometry/polygon.f90), so that both accept the same outlines.
    """
    if points.ndim != 2 or points.shape[1] != 2:
        raise OutlineError("its vertices are not pairs of x and y")
    if not np.isfinite(points).all():
        raise OutlineError("a coordinate is not a finite number")
    greatest = float(np.abs(points).max(initial=0.0))
    if greatest > GREATEST:
        raise OutlineError(f"a coordinate is beyond {GREATEST:g} m")
    extent = _extent(points)
    tolerance = REDUNDANT_SHARE * extent + 16.0 * np.finfo(float).eps * greatest
    area = area_of(points)
    kept = _without_redundant(points, tolerance, area > 0.0)
    if len(kept) < 3:
        raise OutlineError(f"it has {len(kept)} different vertices that are not on one line, but needs 3")
    if abs(area) <= tolerance * extent:
        raise OutlineError("it has no area")
    return points[kept] if area > 0.0 else points[[*kept[1:], kept[0]]]


def _extent(points: FloatArray) -> float:
    """Greatest distance of two vertices. Runs of neighbours are compared only if their boxes are far enough apart."""
    if not len(points):
        return 0.0
    runs = [points[k : k + RUN] for k in range(0, len(points), RUN)]
    low, high = (np.array([each(run, axis=0) for run in runs]) for each in (np.min, np.max))
    far = points[np.argmax(np.hypot(*(points - points[0]).T))]
    extent = float(np.hypot(*(points - far).T).max())
    for k, run in enumerate(runs):
        reach = np.maximum(high[k] - low[: k + 1], high[: k + 1] - low[k])
        for other in np.flatnonzero(np.hypot(*reach.T) > extent):
            x, y = (np.subtract.outer(one, two) for one, two in zip(run.T, runs[other].T))
            extent = max(extent, math.sqrt((x * x + y * y).max()))
    return extent


def _without_redundant(points: FloatArray, tolerance: float, is_anticlockwise: bool) -> list[int]:
    """Numbers of the vertices that stay, in anticlockwise order from the first."""
    n = len(points)
    order = list(range(n)) if is_anticlockwise else [-k % n for k in range(n)]
    place = points[order].tolist()
    following, former = [*range(1, n), 0], [n - 1, *range(n - 1)]
    stays, left = [True] * n, n
    here = in_order = 0
    while in_order < left and left > 2:
        (x0, y0), (x1, y1), (x2, y2) = place[former[here]], place[here], place[following[here]]
        if _is_redundant((x1 - x0, y1 - y0), (x2 - x1, y2 - y1), tolerance):
            stays[here] = False
            following[former[here]], former[following[here]] = following[here], former[here]
            left -= 1
            in_order = 0
        else:
            in_order += 1
        here = following[here]
    return [vertex for vertex, keeps in zip(order, stays) if keeps]


def _is_redundant(arriving: tuple[float, float], leaving: tuple[float, float], tolerance: float) -> bool:
    """Whether a vertex repeats the next one or lies between its neighbours; not the tip of a spike."""
    (ax, ay), (bx, by) = arriving, leaving
    return (math.hypot(bx, by) <= tolerance
            or (abs(ax * by - ay * bx) <= tolerance * math.hypot(ax + bx, ay + by) and ax * bx + ay * by > 0.0))


def concave_vertices(outline: FloatArray) -> list[int]:
    """Vertices of a tidy outline at which it does not turn left, or from which on it goes round twice."""
    edge = np.roll(outline, -1, axis=0) - outline
    before = np.roll(edge, 1, axis=0)
    wrong = np.flatnonzero(_turns(before, edge) <= 0.0)
    if len(wrong):
        return [int(k) for k in wrong]
    down = (edge[:, 1] < 0.0) | ((edge[:, 1] == 0.0) & (edge[:, 0] < 0.0))
    rounds = np.cumsum(np.roll(down, 1) & ~down)
    return [int(np.argmax(rounds > 1))] if rounds[-1] > 1 else []


def _is_convex(points: FloatArray) -> bool:
    """Whether an outline can be one body."""
    try:
        return not concave_vertices(tidy(points))
    except OutlineError:
        return False


def insist_on_simple(outline: FloatArray) -> None:
    """OutlineError if two edges of an outline cross or touch. Runs of edges are compared if their boxes meet."""
    n = len(outline)
    begin, end = outline, np.roll(outline, -1, axis=0)
    runs = [np.arange(k, min(k + RUN, n)) for k in range(0, n, RUN)]
    low = np.array([np.minimum(begin[run], end[run]).min(axis=0) for run in runs])
    high = np.array([np.maximum(begin[run], end[run]).max(axis=0) for run in runs])
    for k, run in enumerate(runs):
        crossing: list[tuple[int, int]] = []
        for other in k + np.flatnonzero(((low[k:] <= high[k]) & (high[k:] >= low[k])).all(axis=1)):
            one, two = (each.ravel() for each in np.meshgrid(run, runs[other], indexing="ij"))
            apart = (two > one + 1) & ((one > 0) | (two < n - 1))
            one, two = one[apart], two[apart]
            meets = _meet(begin[one], end[one], begin[two], end[two])
            crossing += zip(one[meets].tolist(), two[meets].tolist())
        if crossing:
            first, second = min(crossing)
            raise OutlineError(f"its edges {first + 1} and {second + 1} cross")


def decompose(outline: FloatArray) -> list[FloatArray]:
    """Convex pieces of a simple outline with anticlockwise vertices; their areas add up to its area.

    Ears are cut off (Meisters, Amer. Math. Monthly 82 (1975) 648), then triangles are merged as long as the result is
    convex (Hertel & Mehlhorn, LNCS 158 (1983) 207): at most four times as many pieces as needed.
    """
    insist_on_simple(outline)
    pieces = _triangles(outline)
    merged = True
    while merged:
        merged = False
        for a in range(len(pieces)):
            for b in range(a + 1, len(pieces)):
                joined = _joined(outline, pieces[a], pieces[b])
                if joined is not None:
                    pieces[a] = joined
                    del pieces[b]
                    merged = True
                    break
            if merged:
                break
    return [tidy(outline[piece]) for piece in pieces]


def _triangles(outline: FloatArray) -> list[list[int]]:
    left, found = list(range(len(outline))), []
    size = float(np.abs(outline - outline.mean(axis=0)).max())
    while len(left) > 3:
        ears = []
        for k in range(len(left)):
            corner = left[k - 1], left[k], left[(k + 1) % len(left)]
            a, b, c = outline[list(corner)]
            if _cross(a, b, c) > ROUNDOFF * size**2 and not any(
                    _inside(outline[other], a, b, c) for other in left if other not in corner):
                ears.append((_least_angle(a, b, c), k, corner))
        if not ears:
            raise OutlineError("it cannot be decomposed: its edges touch")
        _, k, corner = max(ears)
        found.append(list(corner))
        del left[k]
        left = _without_straight(outline, left, size)
    return [*found, left] if len(left) == 3 else found


def _without_straight(outline: FloatArray, left: list[int], size: float) -> list[int]:
    """The rest of an outline, as long as it has an area."""
    area = abs(area_of(outline[left]))
    return left if area > ROUNDOFF * size**2 else []


def _joined(outline: FloatArray, one: list[int], other: list[int]) -> list[int] | None:
    """Two pieces with a common edge as one, if that is convex."""
    for k in range(len(one)):
        edge = one[k], one[(k + 1) % len(one)]
        for m in range(len(other)):
            if (other[(m + 1) % len(other)], other[m]) == edge:
                whole = one[k + 1 :] + one[: k + 1] if k + 1 < len(one) else one[:]
                rest = [other[(m + 1 + step) % len(other)] for step in range(1, len(other) - 1)]
                whole = whole + rest
                return whole if _is_convex(outline[whole]) else None
    return None


def _turn(arriving: FloatArray, leaving: FloatArray) -> float:
    """Cross product of two edges; positive: a turn to the left."""
    return float(arriving[0] * leaving[1] - arriving[1] * leaving[0])


def _cross(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    """Twice the area of a triangle; positive: anticlockwise."""
    return _turn(b - a, c - b)


def _inside(point: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray) -> bool:
    return min(_cross(a, b, point), _cross(b, c, point), _cross(c, a, point)) >= 0.0


def _least_angle(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    """A measure of the least angle of a triangle: twice its area over its longest side squared."""
    return _cross(a, b, c) / max(float(np.sum(side**2)) for side in (b - a, c - b, a - c))


def _meet(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> Any:
    """Whether the segments from a to b and from c to d, (segment, 2), have a point in common."""
    one, two, three, four = (_turns(q - p, r - q) for p, q, r in ((a, b, c), (a, b, d), (c, d, a), (c, d, b)))
    on_one_side = (((np.maximum(one, two) < 0.0) | (np.minimum(one, two) > 0.0))
                   | ((np.maximum(three, four) < 0.0) | (np.minimum(three, four) > 0.0)))
    low, high = np.maximum(np.minimum(a, b), np.minimum(c, d)), np.minimum(np.maximum(a, b), np.maximum(c, d))
    return ~on_one_side & (~((one == 0.0) & (two == 0.0)) | (low <= high).all(axis=1))


def _turns(arriving: FloatArray, leaving: FloatArray) -> FloatArray:
    """Cross products of edges, (edge, 2); positive: a turn to the left."""
    turns: FloatArray = arriving[:, 0] * leaving[:, 1] - arriving[:, 1] * leaving[:, 0]
    return turns
