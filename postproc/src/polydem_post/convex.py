"""Convex polygons: whether an outline is one, and its decomposition into some."""

from __future__ import annotations

import numpy as np

from .polygons import FloatArray, area_of

#: A vertex is dropped if it is closer to its neighbour, or to the line of its neighbours, than this fraction of the
#: size: redundant_share of src/geometry/polygon.f90
REDUNDANT_SHARE = 1e-9

#: Areas of triangles that count as none in a decomposition, relative to the size of the outline squared
ROUNDOFF = 1e-12

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
    n = len(points)
    extent = max((float(np.hypot(*(points[k:] - points[k]).T).max()) for k in range(n)), default=0.0)
    tolerance = REDUNDANT_SHARE * extent + 16.0 * np.finfo(float).eps * greatest
    area = area_of(points)
    kept = list(range(n)) if area > 0.0 else [-k % n for k in range(n)]
    k = in_order = 0
    while in_order < len(kept) and len(kept) > 2:
        arriving = points[kept[k]] - points[kept[k - 1]]
        leaving = points[kept[(k + 1) % len(kept)]] - points[kept[k]]
        if _is_redundant(arriving, leaving, tolerance):
            del kept[k]
            in_order = 0
            k %= len(kept)
        else:
            in_order += 1
            k = (k + 1) % len(kept)
    if len(kept) < 3:
        raise OutlineError(f"it has {len(kept)} different vertices that are not on one line, but needs 3")
    if abs(area) <= tolerance * extent:
        raise OutlineError("it has no area")
    return points[kept] if area > 0.0 else points[[*kept[1:], kept[0]]]


def _is_redundant(arriving: FloatArray, leaving: FloatArray, tolerance: float) -> bool:
    """Whether a vertex repeats the next one or lies between its neighbours; not the tip of a spike."""
    return bool(np.hypot(*leaving) <= tolerance
                or (abs(_turn(arriving, leaving)) <= tolerance * np.hypot(*(arriving + leaving))
                    and arriving @ leaving > 0.0))


def concave_vertices(outline: FloatArray) -> list[int]:
    """Vertices of a tidy outline at which it does not turn left, or from which on it goes round twice."""
    edge = np.roll(outline, -1, axis=0) - outline
    wrong = [k for k in range(len(outline)) if _turn(edge[k - 1], edge[k]) <= 0.0]
    if wrong:
        return wrong
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
    """OutlineError if two edges of an outline cross or touch."""
    n = len(outline)
    for k in range(n):
        for other in range(k + 2, n - (k == 0)):
            if _meet(outline[k], outline[(k + 1) % n], outline[other], outline[(other + 1) % n]):
                raise OutlineError(f"its edges {k + 1} and {other + 1} cross")


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


def _meet(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> bool:
    """Whether two segments have a point in common."""
    one, two, three, four = _cross(a, b, c), _cross(a, b, d), _cross(c, d, a), _cross(c, d, b)
    if (max(one, two) < 0.0 or min(one, two) > 0.0) or (max(three, four) < 0.0 or min(three, four) > 0.0):
        return False
    if one == two == 0.0:
        low, high = np.maximum(np.minimum(a, b), np.minimum(c, d)), np.minimum(np.maximum(a, b), np.maximum(c, d))
        return bool((low <= high).all())
    return True
