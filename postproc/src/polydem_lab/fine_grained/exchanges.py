"""Exchanges of ends in the parts of a divided sweep, counted from a recorded trace.

The ends of all boxes along an axis are in the order of the previous step. An end moves down past all ends before it
whose new value is larger: so many exchanges it costs, in the part in which it stood. The list of each axis is cut into
as many equal parts as there are threads, and a thread sorts one part of both lists. The few exchanges across a border,
which a later pass makes, count for the part above it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from polydem_post.base.result_file import UNREADABLE, open_hdf5

from ..bench.samples import Case

#: Steps of a trace that are counted, spread over its length
STEPS = 20

#: The exchanges counted here and those that the program counted may differ by this part (ends of equal value)
TOLERANCE = 0.01


@dataclass(frozen=True)
class Exchanges:
    """Exchanges of a step, means over steps: of all parts, and of the part with most for each number of parts."""

    total: float
    most: dict[int, float]

    def unevenness(self, parts: int) -> float:
        """Exchanges of the part with most over the mean of the parts."""
        return self.most[parts] * parts / self.total if self.total > 0.0 else 1.0


def exchanges_down(values: np.ndarray) -> np.ndarray:
    """How many larger values stand before each value: so many exchanges bring it to its place."""
    count = np.zeros(len(values), dtype=np.int64)
    places = np.arange(len(values))
    # No value before the first one that the greatest so far exceeds is larger
    reach = places - np.searchsorted(np.maximum.accumulate(values), values, side="right")
    moving = places[reach > 0]
    distance = 1
    while len(moving):
        count[moving] += values[moving - distance] > values[moving]
        distance += 1
        moving = moving[reach[moving] >= distance]
    return count


def exchanges_up_to(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Exchanges of both axes in the first k places of the lists, k = 0..2 boxes; bounds are (box, 4)."""
    summed = np.zeros(2 * len(before) + 1, dtype=np.int64)
    for axis in (0, 1):
        old, new = (np.concatenate([bounds[:, axis], bounds[:, axis + 2]]) for bounds in (before, after))
        summed[1:] += np.cumsum(exchanges_down(new[np.argsort(old, kind="stable")]))
    return summed


@cache
def count_exchanges(trace: Path, steps: tuple[int, ...], most_parts: int) -> Exchanges:
    """Count the exchanges of some steps of a trace, each from the step before it, for 1 to so many parts."""
    totals: list[int] = []
    most: dict[int, list] = {parts: [] for parts in range(1, most_parts + 1)}
    with open_hdf5(trace) as file:
        for step in steps:
            summed = exchanges_up_to(file["aabb"][step - 1], file["aabb"][step])
            totals.append(int(summed[-1]))
            for parts, found in most.items():
                borders = np.arange(parts + 1) * (len(summed) - 1) // parts
                found.append(int(np.diff(summed[borders]).max()))
    return Exchanges(float(np.mean(totals)), {parts: float(np.mean(found)) for parts, found in most.items()})


def exchanges_of(case: Case, most_parts: int) -> Exchanges | None:
    """Exchanges in the parts of the scene of a case; nothing without its trace, or if the trace is of other boxes."""
    swaps = next((sample.counts["swaps"] for sample in case.samples if "swaps" in sample.counts), np.empty(0))
    if len(swaps) < 2:
        return None
    steps = np.unique(np.linspace(1, len(swaps) - 1, min(STEPS, len(swaps) - 1)).round().astype(int))
    for trace in traces_of(case):
        try:
            found = count_exchanges(trace.resolve(), tuple(steps.tolist()), most_parts)
        except UNREADABLE:
            continue
        counted = float(np.mean(swaps[steps]))
        if abs(found.total - counted) <= TOLERANCE * max(counted, 1.0):
            return found
    return None


def way_of(case: Case) -> float:
    """How far free boxes move in a step, as a part of their side, in the mean; NaN without the trace of the scene."""
    for trace in traces_of(case):
        try:
            return way_in(trace.resolve())
        except UNREADABLE:
            continue
    return float("nan")


@cache
def way_in(trace: Path) -> float:
    """Mean displacement of the centres of free boxes from step to step over the mean side of these boxes."""
    with open_hdf5(trace) as file:
        steps = len(file["aabb"])
        free = np.ones(file["aabb"].shape[1], dtype=bool)
        if "is_wall" in file:
            free = np.asarray(file["is_wall"]) == 0
        ways, sides = [], []
        for step in np.unique(np.linspace(1, steps - 1, min(STEPS, steps - 1)).round().astype(int)):
            before, after = (np.asarray(file["aabb"][k])[free] for k in (step - 1, step))
            moved = 0.5 * (after[:, :2] + after[:, 2:] - before[:, :2] - before[:, 2:])
            ways.append(np.hypot(*moved.T).mean())
            sides.append((after[:, 2:] - after[:, :2]).mean())
    return float(np.mean(ways) / np.mean(sides))


def traces_of(case: Case) -> list[Path]:
    """Where the trace of a case may lie: in its bench, in a bench beside it, where its sample says."""
    bench, recorded = case.samples[0].path.parent.parent, Path(str(case.facts.get("trace", "")))
    places = [bench / "traces" / case.scene / "trace.h5"]
    if recorded.suffix == ".h5":
        places += [bench.parent.joinpath(*recorded.parts[-4:]), recorded]
    return [place for place in places if place.is_file()]
