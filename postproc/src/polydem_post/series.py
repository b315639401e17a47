"""Chooses from a bench what belongs together: scenes of one kind, one finder over size, two finders side by side."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from . import statistics
from .bench import Bench, Case

#: Kind of scene -> how the names of such scenes begin: drum_2522, gas_0.3, sizes_100, worst_order_5000
KINDS = {
    "drum": r"drums?|patch|tile[sd]?",
    "bed": r"(static_?)?bed",
    "gas": r"gas",
    "hopper": r"hopper",
    "sizes": r"sizes?|ratio",
    "rods": r"rods?",
    "soft": r"soft|overlap",
    "range": r"range|long",
    "worst": r"worst|order",
    "column": r"column|tall",
    "rest": r"rest|one",
    "line": r"channel|line",
    "even": r"even",
}

#: Finders that begin anew at every step, or nearly so: what the incremental ones are measured against
OTHERS = ("linked_cells", "verlet", "hierarchical_grid", "all_pairs")

#: The paper's two
TREE, SWEEP = "quadtree", "sort_and_sweep"

#: Levels of the caches that a size can outgrow
CACHE_WORD = re.compile(r"L(\d)([di]?)\s+(\d+)\s*([KMG])", re.IGNORECASE)


def kind(scene: str) -> str:
    """Kind of a scene by the beginning of its name, or that beginning itself."""
    for name, pattern in KINDS.items():
        if re.match(rf"(?:{pattern})(?:[_.-]|\d|$)", scene):
            return name
    return re.split(r"[_.-]|\d", scene)[0]


def parameter(scene: str) -> float:
    """The last number in the name of a scene: its size, ratio or density; NaN if it has none."""
    numbers = re.findall(r"\d+(?:\.\d+)?", scene)
    return float(numbers[-1]) if numbers else np.nan


def cases_of(bench: Bench, of_kind: str, **wanted) -> list:
    """Cases on scenes of a kind, in order of their size."""
    return [case for case in bench.select(**wanted) if kind(case.scene) == of_kind]


def over_size(bench: Bench, finder: str, threads: int = 1, mode: str = "replay", of_kind: str = "drum") -> list:
    """One finder on the scenes of a kind, of all sizes; one case per number of boxes."""
    found = {case.boxes: case for case in cases_of(bench, of_kind, finder=finder, threads=threads, mode=mode)}
    return [found[boxes] for boxes in sorted(found)]


def total_time(case: Case) -> dict:
    """Repeat -> time of the neighbourhood per box and step [ns]: live samples with the making of the boxes."""
    return case.stage("boxes", "neighbours") if case.mode == "live" else case.time()


def elapsed_time(case: Case) -> dict:
    """Repeat -> elapsed time per box and step [ns], also for one thread."""
    if case.mode == "live":
        return case.time()
    return case.values(
        lambda sample: 1e9 * float(np.mean(sample.elapsed[1:])) / case.boxes if len(sample.elapsed) > 1 else np.nan
    )


def structure_time(case: Case) -> dict:
    """Repeat -> time per box and step to update the structure [ns]."""
    return case.phase("structure")


def list_share(case: Case) -> dict:
    """Repeat -> share of the time of a finder that is not the update of its structure."""
    structure = case.phase("structure")
    whole = case.phase("structure", "search", "filter", "order", "merge")
    return {key: 1.0 - structure[key] / whole[key] for key in structure if whole.get(key, 0.0) > 0.0}


def ratio(upper: Case, lower: Case, quantity=total_time) -> statistics.Estimate:
    """Ratio of two cases: repeat by repeat if they were measured side by side, else that of their medians."""
    above, below = quantity(upper), quantity(lower)
    if set(above) & set(below):
        return statistics.median_of_ratios(above, below)
    return statistics.ratio_of_medians(list(above.values()), list(below.values()))


def pairs_of(upper: list, lower: list) -> list:
    """Cases of two finders on the same scene and mode: [(upper, lower)]."""
    found = {(case.scene, case.mode): case for case in lower}
    return [(case, found[case.scene, case.mode]) for case in upper if (case.scene, case.mode) in found]


def pooled_ratio(pairs: list, quantity=total_time) -> statistics.Estimate:
    """Geometric mean over scenes of the ratios of two finders, repeat by repeat."""
    ratios = []
    for upper, lower in pairs:
        above, below = quantity(upper), quantity(lower)
        ratios.append({key[1]: above[key] / below[key] for key in set(above) & set(below) if below[key] > 0.0})
    return statistics.pooled(ratios)


@dataclass(frozen=True)
class Law:
    """A power law through the medians of a series."""

    sizes: np.ndarray
    medians: np.ndarray
    exponent: statistics.Estimate
    factor: float

    def at(self, sizes) -> np.ndarray:
        """The law at some sizes."""
        return self.factor * np.asarray(sizes, dtype=float) ** self.exponent.value


def law(cases: list, quantity=total_time, largest: float = np.inf) -> Law | None:
    """Time per step [ms] against the number of boxes; nothing if there are fewer than three sizes."""
    measured = [
        (case.boxes, [1e-6 * case.boxes * value for value in statistics.of_one_bench(quantity(case))])
        for case in cases
        if case.boxes <= largest
    ]
    measured = [(boxes, values) for boxes, values in measured if values and min(values) > 0.0]
    if len(measured) < 3:
        return None
    sizes = np.array([boxes for boxes, _ in measured], dtype=float)
    medians = np.array([np.median(values) for _, values in measured])
    exponent = statistics.slope(sizes, [values for _, values in measured])
    return Law(sizes, medians, exponent, statistics.intercept(sizes, medians, exponent.value))


def count_slope(cases: list, *names: str) -> float:
    """Exponent of the sum of some counts per step against the number of boxes; NaN if it cannot be had."""
    points = [(case.boxes, sum(case.count(name) for name in names)) for case in cases]
    points = [(boxes, value) for boxes, value in points if np.isfinite(value) and value > 0.0]
    if len(points) < 3:
        return np.nan
    sizes, values = np.log(np.array(points, dtype=float)).T
    return float(np.polyfit(sizes, values, 1)[0])


def cache_levels(provenance: dict) -> list:
    """[(name, bytes)] of the caches for data, from the smallest, as the machine of a sample states them."""
    factor = {"K": 2**10, "M": 2**20, "G": 2**30}
    levels = [
        (f"L{level}", int(size) * factor[unit.upper()])
        for level, role, size, unit in CACHE_WORD.findall(str(provenance.get("caches", "")))
        if role.lower() != "i"
    ]
    return sorted(dict(levels).items(), key=lambda item: item[1])


def held_bytes(case: Case) -> float:
    """Bytes that a finder works on: what it holds itself, and four numbers for each box."""
    return case.count("bytes") + 32.0 * case.boxes
