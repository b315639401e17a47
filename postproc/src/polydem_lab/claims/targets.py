"""What the project wants to reach, and whether these samples reach it."""

from __future__ import annotations

from polydem_post.base.emit import Table

from ..bench import series
from ..bench.samples import Bench
from ..bench.series import SWEEP, TREE
from ..bench.statistics import typical
from .verdicts import word

#: Most time per box and step on the drum of 12651 boxes, one thread [ns]
GREATEST = {TREE: 60.0, SWEEP: 90.0}

#: The exponent of the tree up to so many boxes, and how far from 1 it may be
LARGEST, TOLERANCE = 1.2e5, 0.05


def targets(bench: Bench) -> Table:
    """Times on the drum of 12651 boxes beside those of the Verlet list, and the exponent of the tree."""
    table = Table(
        "targets",
        "Targets: one thread, without the first step",
        ("what", "scene", "build", "target", "ours", "reached", "over verlet, same run"),
    )
    for case in bench.select(threads=1, mode="replay"):
        if case.finder not in GREATEST or series.kind(case) != "drum" or case.boxes != 12651:
            continue
        found = typical(case.time())
        if not found:
            continue
        verlet = bench.select(
            machine=case.machine, build=case.build, scene=case.scene, mode="replay", finder="verlet", threads=1
        )
        limit = GREATEST[case.finder]
        table.add(
            f"{case.finder} [ns per box and step]",
            case.scene,
            case.build,
            f"below {limit:g}",
            found.text(),
            word(found.below(limit)),
            series.ratio(case, verlet[0]).text() if verlet else "-",
        )
    law = series.law(series.over_size(bench, TREE), largest=LARGEST)
    if law:
        table.add(
            f"exponent of {TREE}",
            f"drums to {law.sizes[-1]:.0f}",
            bench.cases[0].build,
            f"1.00 +- {TOLERANCE:g}",
            law.exponent.text(),
            word(law.exponent.within(1.0 - TOLERANCE, 1.0 + TOLERANCE)),
            "-",
        )
    table.note = (
        "Reached: yes if the whole interval is within the target, no if it is outside altogether, else undecided."
    )
    return table
