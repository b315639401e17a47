"""Convex polygons: whether an outline is one, and its decomposition into some."""

from __future__ import annotations

import numpy as np

from .polygons import FloatArray, area_of

#: Deviations of an outline that count as none, relative to its size
ROUNDOFF = 1e-12

#: Greatest coordinate [m]: areas and moments of inertia of greater polygons overflow
GREATEST = 1e50


class OutlineError(Exception):
    """What is wrong with an outline, without its name."""


def tidy(points: FloatArray) -> FloatArray:
    """The outline anticlockwise, without repeated and without redundant vertices; OutlineError if it has no area."""
    if points.ndim != 2 or points.shape[1] != 2:
        raise OutlineError("its vertices are not pairs of x and y")
    if not np.isfinite(points).all():
        raise OutlineError("a coordinate is not a finite number")
    if np.abs(points).max(initial=0.0) > GREATEST:
        raise OutlineError(f"a coordinate is beyond {GREATEST:g} m")
    outline = points - points.mean(axis=0) if len(points) else points
    size = float(np.abs(outline).max()) if len(points) else 0.0
    kept = list(range(len(outline)))
    found = True
    while found and len(kept) >= 3:
        found = False
        for k in range(len(kept)):
            before, here, after = (outline[kept[(k + step) % len(kept)]] for step in (-1, 0, 1))
            repeated = np.abs(here - after).max() <= ROUNDOFF * size
            if repeated or (abs(_cross(before, here, after)) <= ROUNDOFF * size**2
                            and float((here - before) @ (after - here)) >= 0.0):
                del kept[k]
                found = True
                break
    if len(kept) < 3:
        raise OutlineError(f"it has {len(kept)} different vertices that are not on one line, but needs 3")
    outline = points[kept]
    if abs(area_of(outline)) <= ROUNDOFF * size**2:
        raise OutlineError("it has no area")
    return outline if area_of(outline) > 0.0 else outline[::-1]


def concave_vertices(outline: FloatArray) -> list[int]:
    """Vertices of an anticlockwise outline at which it turns right, or from which on it goes round twice."""
    n = len(outline)
    size = float(np.abs(outline - outline.mean(axis=0)).max())
    wrong = [k for k in range(n)
             if _cross(outline[k - 1], outline[k], outline[(k + 1) % n]) < -ROUNDOFF * size**2]
    if wrong:
        return wrong
    edge = np.roll(outline, -1, axis=0) - outline
    direction = np.arctan2(edge[:, 1], edge[:, 0])
    turned = np.cumsum(np.mod(np.diff(np.append(direction, direction[0])), 2.0 * np.pi))
    return [int(np.argmax(turned > 2.0 * np.pi + 1e-6))] if turned[-1] > 3.0 * np.pi else []


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
                turns = [_cross(*outline[[whole[j - 1], whole[j], whole[(j + 1) % len(whole)]]])
                         for j in range(len(whole))]
                size = float(np.abs(outline - outline.mean(axis=0)).max())
                return whole if min(turns) >= -ROUNDOFF * size**2 else None
    return None


def _cross(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    """Twice the area of a triangle; positive: anticlockwise."""
    return float((b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]))


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
