"""Lines of a drawing: closed ones, and open ones that join end to end."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Optional

import numpy as np

from ..base.polygons import FloatArray, IntArray, area_of

#: The points of a line for a greatest distance of the chords from its curves; None: a rough line
Line = Callable[[Optional[float]], FloatArray]
#: Ends that are closer than this share of the size of their line, or of all open lines, are one point
CLOSED = 1e-6


class Lines:
    """The lines of a drawing."""

    def __init__(self) -> None:
        self.closed: list[Line] = []
        #: Where each closed line is, for messages
        self.places: list[str] = []
        #: Number of lines of each kind that are left out
        self.left: dict[str, int] = {}
        self._open: list[tuple[Line, str, str]] = []

    def leave(self, kind: str) -> None:
        """Leave out a line, or what is none."""
        self.left[kind] = self.left.get(kind, 0) + 1

    def add(self, line: Line, kind: str, place: str) -> None:
        """Take a line, closed or open."""
        points = line(None)
        if _is_closed(points):
            self.closed.append(line)
            self.places.append(place)
        elif len(points) > 1 and (points[0] != points[-1]).any():
            self._open.append((line, kind, place))
        else:
            self.leave(kind)

    def join(self) -> tuple[int, dict[str, int]]:
        """Join open lines to closed ones where just two end at each point; tell how many, and of what."""
        used: dict[str, int] = {}
        before = len(self.closed)
        rest = set(range(len(self._open)))
        for loop in _loops(np.array([line(None)[[0, -1]] for line, _, _ in self._open])) if self._open else []:
            line = partial(_chain, [(self._open[k][0], ahead) for k, ahead in loop])
            if not _is_closed(line(None)):
                continue
            self.closed.append(line)
            self.places.append(f"{self._open[loop[0][0]][2]} and what joins it")
            for k, _ in loop:
                used[self._open[k][1]] = used.get(self._open[k][1], 0) + 1
                rest.remove(k)
        for k in sorted(rest):
            self.leave(self._open[k][1])
        self._open = []
        return len(self.closed) - before, used


def _loops(ends: FloatArray) -> list[list[tuple[int, bool]]]:
    """Loops of lines, each with whether it is passed from its begin to its end; `ends` is (n, 2, 2)."""
    point = _points(ends.reshape(-1, 2)).reshape(-1, 2)
    at: dict[int, list[int]] = {}
    for k, both in enumerate(point.tolist()):
        for each in both:
            at.setdefault(each, []).append(k)
    loops: list[list[tuple[int, bool]]] = []
    seen: set[int] = set()
    for first, (begin, _) in enumerate(point.tolist()):
        loop: list[tuple[int, bool]] = []
        k, here = first, begin
        while k not in seen and len(at[here]) == 2:
            seen.add(k)
            ahead = int(point[k, 0]) == here
            loop.append((k, ahead))
            here = int(point[k, 1 if ahead else 0])
            k = at[here][-1] if at[here][0] == k else at[here][0]
        if loop and k == first and here == begin:
            loops.append(loop)
    return loops


def _points(ends: FloatArray) -> IntArray:
    """Numbers of points; ends that lie together have one."""
    from scipy import sparse, spatial

    near = CLOSED * float(np.ptp(ends, axis=0).max())
    one, two = spatial.cKDTree(ends).query_pairs(near, output_type="ndarray").T
    graph = sparse.coo_matrix((np.ones(len(one)), (one, two)), shape=(len(ends), len(ends)))
    return np.asarray(sparse.csgraph.connected_components(graph, directed=False)[1], dtype=np.int64)


def _chain(parts: list[tuple[Line, bool]], distance: float | None) -> FloatArray:
    """The points of lines that join, one after the other, closed."""
    points = [line(distance)[:: 1 if ahead else -1][:-1] for line, ahead in parts]
    return np.concatenate([*points, points[0][:1]])


def _is_closed(points: FloatArray) -> bool:
    """Whether a line ends where it begins, and encloses an area."""
    if len(points) < 4:
        return False
    size = float(np.ptp(points, axis=0).max())
    return float(np.hypot(*(points[0] - points[-1]))) <= CLOSED * size and abs(area_of(points)) > 1e-12 * size**2
