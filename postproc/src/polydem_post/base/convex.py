"""Convex polygons: whether an outline is one, and its decomposition into some."""

from __future__ import annotations

import heapq
import math
from typing import Any

import numpy as np

from .polygons import FloatArray, area_of, thicknesses

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
    """Few and thick convex pieces of a simple outline with anticlockwise vertices; their areas add up to its area.

    Triangles of ears that are cut off (Meisters, Amer. Math. Monthly 82 (1975) 648), with shapely also of Delaunay,
    are merged as long as the result is convex (Hertel & Mehlhorn, LNCS 158 (1983) 207): at most four times as many
    pieces as needed. Of several orders the one with the greatest thickness over number is taken.
    """
    insist_on_simple(outline)
    ears, delaunay = _triangles(outline), _delaunay(outline)
    found = [_merged(outline, ears, True), _merged(outline, ears, False)]
    if delaunay:
        found.insert(0, _merged(outline, delaunay, True))
    pieces = max(found, key=lambda each: min(_thickness(outline[piece]) for piece in each) / len(each))
    return [tidy(outline[piece]) for piece in pieces]


def _delaunay(outline: FloatArray) -> list[list[int]]:
    """Constrained Delaunay triangles of an outline; none if there is no shapely, or if it fails."""
    try:
        from shapely import Polygon, constrained_delaunay_triangles, get_coordinates
        from shapely.errors import ShapelyError
    except ImportError:
        return []
    # Numbers of the usual size
    place = (outline - outline[0]) / np.abs(outline - outline[0]).max()
    number = {(x, y): k for k, (x, y) in enumerate(place.tolist())}
    try:
        parts = constrained_delaunay_triangles(Polygon(place)).geoms
        found = [[number[x, y] for x, y in get_coordinates(part)[:3].tolist()] for part in parts]
    except (ShapelyError, KeyError):
        return []
    found = [piece if _cross(*place[piece]) > 0.0 else piece[::-1] for piece in found]
    return found if len(found) == len(outline) - 2 and min(_cross(*place[each]) for each in found) > ROUNDOFF else []


def _merged(outline: FloatArray, triangles: list[list[int]], by_thickness: bool) -> list[list[int]]:
    """Convex pieces of triangles: the thinnest is merged first, with the neighbour that makes it thickest.

    Without `by_thickness`: the first one, with its first neighbour.

    A diagonal that must stay between two pieces must stay when they have grown, too.
    """
    pieces = dict(enumerate(triangles))
    # Piece of each edge: of those between two pieces only while they may become one
    owner = {edge: number for number, piece in pieces.items() for edge in _edges(piece)}
    thickness = {number: _thickness(outline[piece]) if by_thickness else float(number)
                 for number, piece in pieces.items()}
    waiting = [(thick, number) for number, thick in thickness.items()]
    heapq.heapify(waiting)
    while waiting:
        thick, here = heapq.heappop(waiting)
        if thickness.get(here) != thick:
            continue
        best: tuple[float, int, list[int]] | None = None
        for begin, end in _edges(pieces[here]):
            other = owner.get((end, begin))
            if other is None or (begin, end) not in owner:
                continue
            joined = _joined(pieces[here], pieces[other], begin, end)
            if not _is_convex(outline[joined]):
                del owner[begin, end], owner[end, begin]
                continue
            found = (_thickness(outline[joined]) if by_thickness else -float(other)), other, joined
            best = found if best is None else max(best, found)
        if best is not None:
            thick, other, pieces[here] = best
            thickness[here] = thick if by_thickness else float(here)
            del thickness[other]
            owner.update((edge, here) for edge in _edges(pieces.pop(other)) if edge in owner)
            heapq.heappush(waiting, (thickness[here], here))
    return list(pieces.values())


def _thickness(piece: FloatArray) -> float:
    return float(thicknesses(piece, np.array([0, len(piece)]))[0])


def _joined(one: list[int], other: list[int], begin: int, end: int) -> list[int]:
    """Two pieces as one, without their common edge, which begins and ends at vertices of the first piece."""
    k, m = one.index(end), other.index(begin)
    return [*one[k:], *one[:k], *[*other[m:], *other[:m]][1:-1]]


def _edges(piece: list[int]) -> list[tuple[int, int]]:
    return list(zip(piece, [*piece[1:], piece[0]]))


def _triangles(outline: FloatArray) -> list[list[int]]:
    """Triangles of an outline: the ears with the greatest least angle are cut off first."""
    n, found = len(outline), []
    size = float(np.abs(outline - outline.mean(axis=0)).max())
    left = np.arange(n)
    quality, blocker = np.full(n, -np.inf), np.full(n, -1)
    stale = list(range(n))
    while len(left) > 3:
        for vertex in stale:
            k = int(np.searchsorted(left, vertex))
            corner = [int(left[k - 1]), vertex, int(left[(k + 1) % len(left)])]
            a, b, c = outline[corner]
            quality[vertex], blocker[vertex] = -np.inf, -1
            if _cross(a, b, c) > ROUNDOFF * size**2:
                others = left[~np.isin(left, corner)]
                inside = others[_inside(outline[others], a, b, c)]
                blocker[vertex] = inside[0] if len(inside) else -1
                quality[vertex] = -np.inf if len(inside) else _least_angle(a, b, c)
        # Of equal ears the last one
        vertex = n - 1 - int(np.argmax(quality[::-1]))
        if quality[vertex] == -np.inf:
            raise OutlineError("it cannot be decomposed: its edges touch")
        k = int(np.searchsorted(left, vertex))
        neighbours = [int(left[k - 1]), int(left[(k + 1) % len(left)])]
        found.append([neighbours[0], vertex, neighbours[1]])
        left = np.delete(left, k)
        quality[vertex], blocker[vertex] = -np.inf, -1
        stale = sorted({*neighbours, *np.flatnonzero(blocker == vertex).tolist()})
        left = _without_straight(outline, left, size)
    return [*found, left.tolist()] if len(left) == 3 else found


def _without_straight(outline: FloatArray, left: Any, size: float) -> Any:
    """The rest of an outline, as long as it has an area."""
    area = abs(area_of(outline[left]))
    return left if area > ROUNDOFF * size**2 else left[:0]


def _turn(arriving: FloatArray, leaving: FloatArray) -> float:
    """Cross product of two edges; positive: a turn to the left."""
    return float(arriving[0] * leaving[1] - arriving[1] * leaving[0])


def _cross(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    """Twice the area of a triangle; positive: anticlockwise."""
    return _turn(b - a, c - b)


def _inside(points: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray) -> Any:
    """Whether points, (point, 2), are in a triangle."""
    sides = (_turns((q - p)[None, :], points - q) for p, q in ((a, b), (b, c), (c, a)))
    return np.minimum.reduce(list(sides)) >= 0.0


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
