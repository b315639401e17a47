"""Outlines with fewer corners, such that neighbours have the same line between them and no common area."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.optional import need
from ..base.polygons import FloatArray, IntArray, area_of, join, moments

#: A grain whose simplified line makes no polygon, or one that meets another, gets half the tolerance, this many times
TRIES = 12
#: The interiors have a common point
COMMON = "T********"


@dataclass
class Chain:
    """Points between two nodes, in one direction, and the grains on its sides."""

    rows: tuple[int, ...]
    #: Grains, and whether the chain has their direction
    owners: list[tuple[int, bool]]


def simplified(numbers: list[IntArray], places: list[FloatArray], tolerance: FloatArray,
               convex: bool = False) -> tuple[list[FloatArray], list[bool]]:
    """Outlines whose distance from the given ones is at most a tolerance of each grain; [tolerance] = [places].

    Lines between nodes, where three lines meet, are simplified once (Douglas & Peucker, Cartographica 10 (1973) 112)
    with the tolerance of the smaller of the grains on their sides; dents of less than the tolerance are filled. With
    `convex` each grain becomes its convex hull, whatever the distance, unless the hull meets another grain; the second
    list tells which did.
    """
    shapely = need("shapely", "pictures", "the import of pictures")
    steps = [1 if area_of(each) > 0.0 else -1 for each in places]
    places = [each[::step] for each, step in zip(places, steps)]
    numbers = [each[::step] for each, step in zip(numbers, steps)]
    chains, parts, point, lone = _chains(numbers, places)
    hulls = [_hull(shapely, place, each) if convex else None for place, each in zip(places, tolerance)]
    outlines = _solved(shapely, places, tolerance, chains, parts, point, lone, hulls)
    return outlines, [each is not None for each in hulls]


def _solved(shapely: Any, places: list[FloatArray], tolerance: FloatArray, chains: list[Chain], parts: list[list[int]],
            point: FloatArray, lone: list[bool], hulls: list[FloatArray | None]) -> list[FloatArray]:
    """The simplified outlines, or hulls; less tolerance where they fail, and None for a hull that does."""
    own = np.array(tolerance, dtype=float)
    lines: list[Any] = [None] * len(chains)
    stale = set(range(len(chains)))
    for attempt in range(TRIES + 1):
        for k in stale:
            least = min(own[grain] for grain, _ in chains[k].owners)
            lines[k] = _line(shapely, chains[k], point, least)
        outlines: list[FloatArray] = []
        for grain, (place, hull) in enumerate(zip(places, hulls)):
            ring = point[np.concatenate([_directed(chains[k], lines[k], grain)[:-1] for k in parts[grain]])]
            outline = with_area(shapely, ring, place, own[grain]) if lone[grain] else ring
            outlines.append(outline if hull is None else hull)
        bad = _failing(shapely, outlines)
        if not bad:
            break
        stale = set()
        for grain in bad:
            if hulls[grain] is not None:
                hulls[grain] = None
                continue
            own[grain] = 0.5 * own[grain] if attempt < TRIES - 1 else 0.0
            stale |= set(parts[grain])
    return outlines


def _hull(shapely: Any, place: FloatArray, tolerance: float) -> FloatArray:
    """The convex hull of a grain, with fewer corners but its area."""
    exact = shapely.get_coordinates(shapely.convex_hull(shapely.Polygon(place)))[:-1]
    exact = exact if area_of(exact) > 0.0 else exact[::-1]
    begin = int(np.argmax(np.hypot(*(exact - exact.mean(axis=0)).T)))
    closed = np.roll(exact, -begin, axis=0)[[*range(len(exact)), 0]]
    line = shapely.get_coordinates(shapely.simplify(shapely.LineString(closed), tolerance, preserve_topology=False))
    return with_area(shapely, line[:-1], exact, tolerance) if len(line) > 3 else exact


def with_area(shapely: Any, outline: FloatArray, exact: FloatArray, tolerance: float) -> FloatArray:
    """The outline of a grain that touches none, scaled to its area, if that is within the tolerance."""
    if len(outline) < 3 or area_of(outline) <= 0.0 or tolerance <= 0.0:
        return outline
    centre = moments(*join([outline]))[1][0]
    scaled: FloatArray = centre + np.sqrt(area_of(exact) / area_of(outline)) * (outline - centre)
    distance = shapely.hausdorff_distance(shapely.LinearRing(scaled), shapely.LinearRing(exact))
    return scaled if distance <= tolerance else outline


def _chains(numbers: list[IntArray],
            places: list[FloatArray]) -> tuple[list[Chain], list[list[int]], FloatArray, list[bool]]:
    """All chains, those of each grain in their order, the places of all points, and which grains touch no other."""
    _, first, inverse = np.unique(np.concatenate(numbers), return_index=True, return_inverse=True)
    point = np.concatenate(places)[first]
    rings = np.split(inverse.ravel(), np.cumsum([len(each) for each in numbers])[:-1])
    edges = np.concatenate([np.sort(np.stack([ring, np.roll(ring, -1)], axis=1), axis=1) for ring in rings])
    degree = np.bincount(np.unique(edges, axis=0).ravel(), minlength=len(point))
    known: dict[tuple[int, ...], int] = {}
    chains: list[Chain] = []
    parts: list[list[int]] = []
    for grain, ring in enumerate(rings):
        nodes = _nodes(ring, degree, point)
        ring = np.roll(ring, -nodes[0])
        ends = [*(nodes - nodes[0]).tolist(), len(ring)]
        closed = np.append(ring, ring[0])
        parts.append([])
        for begin, end in zip(ends, ends[1:]):
            rows = tuple(closed[begin : end + 1].tolist())
            ahead = rows <= rows[::-1]
            key = rows if ahead else rows[::-1]
            if key not in known:
                known[key] = len(chains)
                chains.append(Chain(key, []))
            chains[known[key]].owners.append((grain, ahead))
            parts[-1].append(known[key])
    return chains, parts, point, [bool((degree[ring] == 2).all()) for ring in rings]


def _nodes(ring: IntArray, degree: IntArray, point: FloatArray) -> IntArray:
    """Where the chains of a ring begin: at nodes; with fewer than two of them also at points far apart."""
    nodes = np.flatnonzero(degree[ring] != 2)
    if len(nodes) >= 2:
        return nodes
    here = point[ring]
    start = nodes[0] if len(nodes) else int(np.argmax(np.hypot(*(here - here.mean(axis=0)).T)))
    other = int(np.argmax(np.hypot(*(here - here[start]).T)))
    return np.array(sorted({int(start), other}))


def _line(shapely: Any, chain: Chain, point: FloatArray, tolerance: float) -> list[int]:
    """The points of a chain that stay."""
    rows = list(chain.rows)
    if len(rows) < 3 or tolerance <= 0.0:
        return rows
    place = point[rows]
    kept = shapely.get_coordinates(shapely.simplify(shapely.LineString(place), tolerance, preserve_topology=False))
    # Kept points in their order among all
    stay, here = [], 0
    for each in kept:
        while (place[here] != each).any():
            here += 1
        stay.append(here)
        here += 1
    if len(chain.owners) == 1:
        stay = _without_dents(place, stay, tolerance, 1.0 if chain.owners[0][1] else -1.0)
    return [rows[k] for k in stay]


def _without_dents(place: FloatArray, stay: list[int], tolerance: float, side: float) -> list[int]:
    """Leave out corners of a free line that turn inwards, as long as the line stays within the tolerance."""
    k = 1
    while k < len(stay) - 1:
        before, here, after = (place[each] for each in stay[k - 1 : k + 2])
        one, two = here - before, after - before
        turn = side * (one[0] * two[1] - one[1] * two[0])
        length = float(np.hypot(*two))
        if turn < 0.0 and length > 0.0:
            offset = place[stay[k - 1] : stay[k + 1] + 1] - before
            along = offset @ two / length**2
            across = np.abs(offset[:, 0] * two[1] - offset[:, 1] * two[0]) / length
            if across.max() <= tolerance and along.min() >= 0.0 and along.max() <= 1.0:
                del stay[k]
                k = max(k - 1, 1)
                continue
        k += 1
    return stay


def _directed(chain: Chain, line: list[int], grain: int) -> list[int]:
    """The line of a chain in the direction of one of its grains."""
    ahead = next(direction for owner, direction in chain.owners if owner == grain)
    return line if ahead else line[::-1]


def _failing(shapely: Any, outlines: list[FloatArray]) -> set[int]:
    """Grains whose outline is no simple polygon or has an area in common with another."""
    bad = {k for k, outline in enumerate(outlines) if len(outline) < 3}
    rows = [k for k in range(len(outlines)) if k not in bad]
    polygons = np.array([shapely.Polygon(outlines[k]) for k in rows], dtype=object)
    valid = shapely.is_valid(polygons)
    bad |= {rows[k] for k in np.flatnonzero(~valid)}
    rows = [row for row, fine in zip(rows, valid) if fine]
    polygons = polygons[valid]
    one, two = shapely.STRtree(polygons).query(polygons, predicate="intersects")
    one, two = one[one < two], two[one < two]
    common = shapely.relate_pattern(polygons[one], polygons[two], COMMON)
    return bad | {rows[k] for k in np.concatenate([one[common], two[common]])}
