"""Chooses from a bench what belongs together: scenes of one kind, one finder over size, two finders side by side.

What a scene is follows from the settings that its samples record (`scene_kinds.py`), not from its name.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from . import paper, statistics
from .samples import Bench, Case
from .scene_kinds import family_of, kind_of, number_in

#: Finders that begin anew at every step, or nearly so: what the incremental ones are measured against
OTHERS = ("linked_cells", "verlet", "hierarchical_grid", "all_pairs")

#: The paper's two
TREE, SWEEP = "quadtree", "sort_and_sweep"

#: Levels of the caches that a size can outgrow
CACHE_WORD = re.compile(r"L(\d)([di]?)\s+(\d+)\s*([KMG])", re.IGNORECASE)


def kind(case: Case) -> str:
    """Kind of the scene of a case by what is recorded of it."""
    return kind_of(case.settings)


def parameter(case: Case, entry: str) -> float:
    """A number of the settings of the scene of a case: its ratio, its density; NaN if it is not recorded."""
    return number_in(case.settings, entry, np.nan)


def cases_of(bench: Bench, of_kind: str, **wanted) -> list:
    """Cases on scenes of a kind, in order of their size."""
    return [case for case in bench.select(**wanted) if kind(case) == of_kind]


def records_of(bench: Bench, records: list, of_kind: str) -> list:
    """Of records that name a scene and its boxes, those on scenes that the samples show to be of a kind."""
    known = {(case.scene, case.boxes) for case in cases_of(bench, of_kind)}
    return [record for record in records if (record.scene, record.boxes) in known]


def over_size(bench: Bench, finder: str, threads: int = 1, mode: str = "replay", of_kind: str = "drum") -> list:
    """One finder on scenes of a kind that differ in their size alone; one case per number of boxes.

    Of several such families it is the one of most sizes, in this bench as a whole, so all finders have the same;
    of two scenes of one size, that of the folder which most sizes come from.
    """
    families: dict[tuple, set] = {}
    for case in cases_of(bench, of_kind, mode=mode):
        families.setdefault(family_of(case.settings), set()).add(case.boxes)
    family = max(families, key=lambda each: len(families[each]), default=None)
    cases = [
        case
        for case in cases_of(bench, of_kind, finder=finder, threads=threads, mode=mode)
        if family_of(case.settings) == family
    ]
    folders = [case.samples[0].path.parent for case in cases]
    found: dict[int, Case] = {}
    for case in sorted(cases, key=lambda each: -folders.count(each.samples[0].path.parent)):
        found.setdefault(case.boxes, case)
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


def whole_steps(bench: Bench, finder: str) -> list:
    """Drums of the paper's sizes within whole time steps on one thread: their times hold the making of the boxes.

    Empty if there are fewer than three sizes: what has no slope does not replace the replay.
    """
    cases = [case for case in of_paper(over_size(bench, finder, mode="live")) if total_time(case)]
    return cases if len(cases) >= 3 else []


def as_published(bench: Bench, finder: str) -> list:
    """Drums of the paper's sizes whose times hold what those of its Fig. 9 hold, or of the replay if there are few."""
    return whole_steps(bench, finder) or of_paper(over_size(bench, finder))


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
    both = [(case, found[case.scene, case.mode]) for case in upper if (case.scene, case.mode) in found]
    return [pair for pair in both if same_boxes(*pair)]


def same_boxes(one: Case, other: Case) -> bool:
    """Whether nothing recorded says that two cases are of different boxes."""
    if one.boxes != other.boxes or one.making != other.making:
        return False
    if one.facts.get("steps") != other.facts.get("steps"):
        return True
    return one.facts.get("identity") == other.facts.get("identity")


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

    @property
    def residuals(self) -> np.ndarray:
        """By how much the medians lie above the law, as a part of it."""
        return self.medians / self.at(self.sizes) - 1.0

    def at(self, sizes) -> np.ndarray:
        """The law at some sizes."""
        return self.factor * np.asarray(sizes, dtype=float) ** self.exponent.value


def steps_over_size(cases: list, quantity=total_time, least: float = 0.0, largest: float = np.inf) -> list:
    """[(boxes, times per step of the repeats [ms])] between two sizes, these included."""
    measured = [
        (case.boxes, [1e-6 * case.boxes * value for value in statistics.of_one_bench(quantity(case))])
        for case in cases
        if least <= case.boxes <= largest
    ]
    return [(boxes, values) for boxes, values in measured if values and min(values) > 0.0]


def of_paper(cases: list) -> list:
    """The cases of the paper's own sizes."""
    return [case for case in cases if 0.9 * paper.SIZES[0] <= case.boxes <= 1.1 * paper.SIZES[1]]


def law_of_paper(cases: list, quantity=total_time) -> Law | None:
    """The law through the paper's own sizes alone."""
    return law(cases, quantity, 0.9 * paper.SIZES[0], 1.1 * paper.SIZES[1])


def law_beyond(cases: list, quantity=total_time) -> Law | None:
    """The law through the sizes from the largest one of the paper on."""
    return law(cases, quantity, 0.9 * paper.SIZES[1])


def law(cases: list, quantity=total_time, least: float = 0.0, largest: float = np.inf) -> Law | None:
    """Time per step [ms] against the number of boxes; nothing if there are fewer than three sizes."""
    measured = steps_over_size(cases, quantity, least, largest)
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
