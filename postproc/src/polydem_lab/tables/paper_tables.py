"""The paper's Tables 1 and 2 with ours beside them."""

from __future__ import annotations

import re

import numpy as np
from polydem_post.base.emit import Table

from ..bench import paper, series
from ..bench.samples import Bench
from ..bench.statistics import number

#: Facts of a machine: column and where its provenance says so, the first that is there
FACTS = (
    ("cores", ("processors", "cores")),
    ("caches", ("caches",)),
    ("memory", ("memory",)),
    ("governor", ("governor",)),
    ("binding", ("binding",)),
    ("waiting", ("wait_policy",)),
    ("compiler", ("compiler",)),
    ("revision", ("revision",)),
)


def machines(bench: Bench) -> Table:
    """Table 1: the paper's machines and ours."""
    table = Table(
        "table_1",
        "Table 1: machines of the paper and of these samples",
        ("machine", "clock [GHz]", *(name for name, _ in FACTS), "load"),
        texts=3 + len(FACTS),
    )
    for name, clock, cores, memory, caches in paper.MACHINES:
        known = {"cores": cores, "caches": caches, "memory": memory}
        table.add(f"{name}, paper", clock, *(known.get(fact, "-") for fact, _ in FACTS), "-")
    for machine in bench.named("machine"):
        facts = bench.provenance(machine)
        loads = [
            float(s.case["load"]) for case in bench.select(machine=machine) for s in case.samples if "load" in s.case
        ]
        everything = [sample.provenance for case in bench.select(machine=machine) for sample in case.samples]
        told = [_stated(everything, keys) for _, keys in FACTS]
        load = f"{number(np.median(loads), 2)}, at most {number(max(loads), 2)}" if loads else "-"
        table.add(machine, clock_of(facts), *told, load)
    table.note = (
        "Load: average over one minute before each sample. The caches of the paper's servers are those of all cores "
        "together; the clock of a virtual machine is what it states, or unknown (-)."
    )
    return table


def _stated(provenances: list, keys: tuple) -> str:
    """All that samples of a machine say of a fact."""
    values = (next((str(each[key]) for key in keys if each.get(key) not in (None, "")), "-") for each in provenances)
    return ", ".join(dict.fromkeys(values))


def clock_of(provenance: dict) -> str:
    """Clock in GHz, as the samples state it or the name of the processor does; - if neither."""
    for key in ("clock", "clock_ghz", "frequency"):
        if provenance.get(key) not in (None, "", "unknown"):
            told = str(provenance[key]).replace("GHz", "").strip()
            return told.rstrip("0").rstrip(".") if "." in told else told
    named = re.search(r"@\s*([\d.]+)\s*GHz", str(provenance.get("processor", "")))
    return f"{float(named.group(1)):g}" if named else "-"


def depth_and_nodes(bench: Bench) -> Table:
    """Table 2: the paper's reserved nodes, and the nodes and bytes that our trees use."""
    table = Table(
        "table_2",
        "Table 2: depth of the tree and nodes",
        (
            "boxes",
            "finder",
            "depth, paper",
            "nodes, paper",
            "depth",
            "nodes used",
            "nodes per box",
            "full tree of our depth",
            "bytes held per box",
        ),
    )
    for finder in ("quadtree", "pruned_quadtree"):
        for case in series.over_size(bench, finder):
            depth, nodes = case.count("depth"), case.count("nodes")
            if not np.isfinite(nodes):
                continue
            near = [
                paper.DEPTH_AND_NODES[size] for size in paper.DEPTH_AND_NODES if abs(size - case.boxes) <= 0.02 * size
            ]
            published = near[0] if near and finder == "quadtree" else ("-", "-")
            table.add(
                case.boxes,
                finder,
                *published,
                number(depth),
                number(nodes, 6),
                number(nodes / case.boxes),
                _full(depth),
                number(case.count("bytes") / case.boxes),
            )
    table.note = (
        "The paper reserves all (4^depth - 1)/3 nodes of a full tree; ours holds the nodes in use, means over "
        "the steps. "
        "Bytes: all that the finder holds, the candidates too, without the boxes themselves (32 bytes each). "
        "Levels are counted from 1, the root."
    )
    return table


def _full(depth: float) -> str:
    return number(float(paper.full_tree(round(depth))), 6) if np.isfinite(depth) else "-"
