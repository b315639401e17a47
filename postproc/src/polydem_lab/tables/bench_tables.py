"""Tables of a bench: what every finder did and took."""

from __future__ import annotations

import numpy as np
from polydem_post.base.emit import Table

from ..bench import series
from ..bench.samples import Bench, Case
from ..bench.statistics import median, number, ratio_of_medians, typical
from ..costs import cache
from .paper_tables import depth_and_nodes, machines

#: Phases in the order of the columns
PHASES = ("structure", "search", "filter", "order", "merge", "waiting")

#: What all tables of times say
CLOCK = (
    "Median over repeats [95 % interval] of the mean over all steps but the first; one thread: processor time, more: "
    "elapsed time. Replay: from the boxes in memory to the complete list; live: the stage `neighbours`."
)


def all_tables(bench: Bench) -> list[Table]:
    """Every table that the samples can give, in the order of a report."""
    here = bench.on()
    tables = [
        machines(bench),
        depth_and_nodes(here),
        times(bench),
        phases(here),
        counters(here),
        first_step(here),
        scenes(here),
        speed_up(here),
        list_cost(here),
        builds(bench),
        cache_misses(bench),
        live_stages(here),
    ]
    return [table for table in tables if table.rows]


def times(bench: Bench) -> Table:
    """Time per box and step of every case."""
    table = Table(
        "times",
        "Time per box and step",
        (
            "scene",
            "boxes",
            "finder",
            "threads",
            "mode",
            "machine",
            "build",
            "median [ns]",
            "interval [ns]",
            "least [ns]",
            "repeats",
            "load",
        ),
    )
    for case in bench.select():
        found = typical(case.time())
        if not found:
            continue
        loads = [float(s.case["load"]) for s in case.samples if "load" in s.case]
        table.add(
            case.scene,
            case.boxes,
            case.finder,
            case.threads,
            case.mode,
            case.machine,
            case.build,
            number(found.value),
            f"{number(found.low)} to {number(found.high)}",
            number(found.least),
            found.repeats,
            number(np.median(loads), 2) if loads else "-",
        )
    table.note = CLOCK
    return table


def phases(bench: Bench) -> Table:
    """The paper's split of the time."""
    table = Table(
        "phases",
        "Where the time goes: ns per box and step, one thread",
        ("scene", "boxes", "finder", *PHASES, "share of the list [%]"),
    )
    for case in bench.select(threads=1, mode="replay"):
        parts = [typical(case.phase(name)) for name in PHASES]
        if not any(parts):
            continue
        share = typical(series.list_share(case))
        table.add(
            case.scene, case.boxes, case.finder, *(number(part.value) for part in parts), number(100.0 * share.value)
        )
    table.note = (
        "structure: tree, cells or ends brought up to date; search: possible pairs; filter: those that overlap; "
        "order and "
        "merge: changes into the list; waiting: idle threads, a part of the others. Share of the list: all but "
        "structure."
    )
    return table


def counters(bench: Bench) -> Table:
    """Exact counts per box and step."""
    cases = [case for case in bench.select(threads=1) if case.counted]
    names = list(dict.fromkeys(name for case in cases for name in case.counted if _occurs(cases, name)))
    table = Table(
        "counters",
        "Exact counts per box and step, one thread",
        ("scene", "boxes", "finder", "pairs", *(f"{name}, in all" if name == "depth" else name for name in names)),
    )
    for case in cases:
        pairs = np.mean(case.samples[0].pairs[1:] if len(case.samples[0].pairs) > 1 else case.samples[0].pairs)
        values = [case.count(name) / (1 if name == "depth" else case.boxes) for name in names]
        table.add(case.scene, case.boxes, case.finder, number(pairs / case.boxes), *(number(value) for value in values))
    table.note = (
        "Means over all steps but the first, of the warm-up run; candidates, nodes, depth and bytes are present values."
    )
    return table


def _occurs(cases: list, name: str) -> bool:
    return any(np.nan_to_num(case.count(name)) > 0.0 for case in cases)


def first_step(bench: Bench) -> Table:
    """The step that builds everything, and how many later steps it is worth."""
    table = Table(
        "first_step",
        "First step: the structure from nothing, one thread",
        ("scene", "boxes", "finder", "median [ns/box]", "interval [ns/box]", "worth later steps", "swaps/box"),
    )
    for case in bench.select(threads=1, mode="replay"):
        first, later = typical(case.first_step()), typical(case.time())
        if first:
            table.add(
                case.scene,
                case.boxes,
                case.finder,
                number(first.value),
                f"{number(first.low)} to {number(first.high)}",
                number(first.value / later.value) if later else "-",
                number(case.count("swaps", first=True) / case.boxes),
            )
    return table


def scenes(bench: Bench) -> Table:
    """Every scene with every finder: which one suits what."""
    found = bench.select(threads=1, mode="replay")
    finders = list(dict.fromkeys(case.finder for case in found))
    table = Table(
        "scenes",
        "All scenes: ns per box and step, one thread; the least of a scene is marked *",
        ("scene", "boxes", *finders),
    )
    for scene in dict.fromkeys(case.scene for case in found):
        row = {case.finder: typical(case.time()).value for case in found if case.scene == scene}
        finite = [value for value in row.values() if np.isfinite(value)]
        if finite:
            boxes = next(case.boxes for case in found if case.scene == scene)
            table.add(scene, boxes, *(_marked(row.get(finder, np.nan), min(finite)) for finder in finders))
    table.note = CLOCK
    return table


def _marked(value: float, least: float) -> str:
    return number(value) + ("*" if value == least else "")


def speed_up(bench: Bench) -> Table:
    """More threads against one."""
    table = Table(
        "speed_up",
        "Speed-up by threads (elapsed time)",
        ("scene", "boxes", "finder", "threads", "mode", "speed-up", "waiting [%]"),
    )
    for case in bench.select():
        if case.threads == 1:
            continue
        one = bench.select(scene=case.scene, mode=case.mode, finder=case.finder, threads=1)
        if one:
            whole = case.phase("structure", "search", "filter", "order", "merge")
            waiting = case.phase("waiting")
            idle = median([waiting[key] / whole[key] for key in waiting if whole.get(key, 0.0) > 0.0])
            gain = series.ratio(one[0], case, series.elapsed_time)
            table.add(
                case.scene, case.boxes, case.finder, case.threads, case.mode, gain.text(), number(100.0 * idle.value)
            )
    table.note = "Ratio of elapsed times to those of one thread, repeat by repeat."
    return table


def list_cost(bench: Bench) -> Table:
    """Vemuri's equal leaves against the minimal tree: what a search costs as the system grows (claim C15)."""
    table = Table(
        "list_cost",
        "Cost of the pair list: equal leaves against the minimal tree",
        ("boxes", "finder", "search [ns/box]", "searches/box", "visits/search", "first step: visits/search"),
    )
    for finder in ("quadtree", "pruned_quadtree"):
        for case in series.over_size(bench, finder):
            searching = typical(case.phase("search"))
            visits = [visits_per_search(case, first) for first in (False, True)]
            if searching or np.isfinite(visits[1]):
                table.add(
                    case.boxes,
                    finder,
                    searching.text(),
                    number(case.count("searches") / case.boxes),
                    *map(number, visits),
                )
    table.note = "The paper: N log N operations with equal leaves, N with the minimal tree."
    return table


def visits_per_search(case: Case, first: bool = False) -> float:
    """Nodes looked at when the neighbours of one box are searched."""
    searches = case.count("searches", first)
    return case.count("visits", first) / searches if searches > 0.0 else np.nan


def builds(bench: Bench) -> Table:
    """Every build against the one of the same machine that has most samples."""
    table = Table(
        "builds",
        "Builds: ratio of times, one thread",
        ("scene", "boxes", "finder", "machine", "build", "against", "ratio"),
    )
    for machine in bench.named("machine"):
        main = bench.on(machine).named("build")[0]
        for case in bench.select(machine=machine, threads=1):
            same = bench.select(
                machine=machine, build=main, scene=case.scene, mode=case.mode, finder=case.finder, threads=1
            )
            if case.build != main and same:
                found = ratio_of_medians(list(case.time().values()), list(same[0].time().values()))
                table.add(case.scene, case.boxes, case.finder, machine, case.build, main, found.text())
    table.note = "Ratios of medians: the builds were measured one after the other, not interleaved."
    return table


def cache_misses(bench: Bench) -> Table:
    """What ./polydem cache counted."""
    records = cache.read_records(bench.folders)
    table = Table(
        "cache",
        "Cache misses per box and step, one thread",
        ("scene", "boxes", "finder", "instructions", "data accesses", "D1 misses", "LL misses", "model"),
    )
    for record in records:
        table.add(
            record.scene,
            record.boxes,
            record.finder,
            number(record.instructions),
            number(record.accesses),
            number(record.first_level),
            number(record.last_level),
            record.model,
        )
    hardware = sorted({record.hardware for record in records})
    table.note = (
        "Simulated by cachegrind: two levels, no prefetching, least recently used lines leave first. "
        f"Counters of the hardware: {'; '.join(hardware)}."
        if records
        else ""
    )
    return table


def live_stages(bench: Bench) -> Table:
    """Whole time steps."""
    cases = bench.select(mode="live")
    names = list(dict.fromkeys(name for case in cases for name in case.samples[0].stages))
    table = Table(
        "live",
        "Whole time steps: elapsed ns per box and step",
        ("scene", "boxes", "finder", "threads", *names, "share of boxes and neighbours [%]"),
    )
    for case in cases:
        parts = [typical(case.stage(name)).value for name in names]
        neighbourhood = typical(case.stage("boxes", "neighbours")).value
        table.add(
            case.scene,
            case.boxes,
            case.finder,
            case.threads,
            *map(number, parts),
            number(100.0 * neighbourhood / np.nansum(parts)),
        )
    return table
