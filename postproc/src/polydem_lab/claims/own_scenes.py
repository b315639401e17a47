"""Scenes of a bench that the paper does not have, and what could not be made of the samples, with the reason."""

from __future__ import annotations

from dataclasses import dataclass

from polydem_post.base.emit import Table

from ..bench import series
from ..bench.samples import Bench, Case
from ..bench.scene_kinds import family_of, number_in
from .verdicts import NOT_MEASURED

#: Figure -> what the samples must have for it
NEEDED = {
    "figure_01_idle_swaps": "rotating drums with sort_and_sweep, one thread",
    "figure_08_13_machines": "rotating drums with quadtree, one thread",
    "figure_09_total": "rotating drums with quadtree or sort_and_sweep, one thread",
    "figure_10_update": "rotating drums with quadtree or sort_and_sweep, one thread",
    "figure_11_inlining": "rotating drums with quadtree and quadtree_called, one thread",
    "figure_12_interpreted": "rotating drums up to 25000 boxes with quadtree, one thread",
    "finders_over_size": "rotating drums, one thread",
    "local_exponents": "rotating drums of at least three sizes with quadtree or sort_and_sweep, one thread",
    "speed_up": "a finder on several threads and on one",
    "cache_misses": "counts of ./polydem cache",
    "work_over_size": "counts of rotating drums, one thread",
    "fine_grained": "sort_and_sweep on one thread and a fine-grained sweep on several, on one scene",
    "fine_grained_limits": "a scene on which partitioned_sweep loses to quadtree, measured or by the model",
    "own_over_size": "scenes that are no rotating drums, or samples that are not of a replay on one thread",
    "all_scenes": "samples of two steps or more",
}


@dataclass(frozen=True)
class Way:
    """How scenes were measured: by replay or in whole time steps, with how many threads."""

    mode: str
    threads: int

    @property
    def text(self) -> str:
        """For captions."""
        how = "replay of recorded boxes" if self.mode == "replay" else "stage `neighbours` of whole time steps"
        return f"{how}, {'one thread' if self.threads == 1 else f'{self.threads} threads'}"


#: Scenes of one size have numbers of boxes within this factor
ONE_SIZE = 1.02

#: What most figures show
USUAL = Way("replay", 1)


def way_of(bench: Bench) -> Way:
    """How the figures of all scenes are measured: the usual way if there are such samples, else the next to it."""
    ways = {Way(case.mode, case.threads) for case in bench.select() if case.time()}
    return min(ways, key=lambda way: (way.mode != USUAL.mode, way.threads), default=USUAL)


def families(bench: Bench) -> list[list[Case]]:
    """Cases by what their scenes have in common but for their size, most first; no drums that other figures show."""
    found: dict[tuple, list] = {}
    way = way_of(bench)
    for case in bench.select(threads=way.threads, mode=way.mode):
        if case.time() and (way != USUAL or series.kind(case) != "drum"):
            found.setdefault(family_of(case.settings), []).append(case)
    return sorted(map(_of_one_start, found.values()), key=lambda cases: -len({case.boxes for case in cases}))


def _of_one_start(cases: list[Case]) -> list[Case]:
    """Cases of a family; if several scenes have one size, only those recorded when most scenes were."""
    starts: dict[float, set] = {}
    for case in cases:
        starts.setdefault(number_in(case.settings, "output.trace_start"), set()).add(case.scene)
    sizes = sorted({case.scene: case.boxes for case in cases}.values())
    if all(larger > ONE_SIZE * size for size, larger in zip(sizes, sizes[1:])):
        return cases
    most = max(starts, key=lambda start: len(starts[start]))
    return [case for case in cases if number_in(case.settings, "output.trace_start") == most]


def family_name(cases: list[Case]) -> str:
    """What the names of the scenes of a family begin with."""
    names = sorted({case.scene for case in cases})
    if len(names) == 1:
        return names[0]
    first, last = names[0], names[-1]
    shared = next((first[:k] for k in range(len(first), 0, -1) if last.startswith(first[:k])), "")
    whole_words = shared[: 1 + max(shared.rfind("_"), shared.rfind("-"))]
    return whole_words.rstrip("_-") or ", ".join(names[:3])


def skipped(bench: Bench, judged: list, drawn: list) -> Table:
    """What is not in this report, and why."""
    table = Table("skipped", "What these samples do not give", ("what", "kind", "it needs"), texts=3)
    there = {drawing.name for drawing in drawn}
    for name, needed in NEEDED.items():
        if name not in there:
            table.add(name, "figure", needed)
    for each, finding in judged:
        if finding.verdict.startswith(NOT_MEASURED):
            table.add(each.id, "claim", finding.reason.removeprefix("It needs ").rstrip("."))
    here = bench.on()
    cases = {(case.scene, case.finder) for case in here.select()}
    for scene in here.named("scene"):
        absent = [finder for finder in here.named("finder") if (scene, finder) not in cases]
        if absent:
            table.add(scene, "scene", f"samples of {', '.join(absent)}")
    return table
