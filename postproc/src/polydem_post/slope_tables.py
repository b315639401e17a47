"""How time, and the work that was counted, grow with the number of boxes."""

from __future__ import annotations

import numpy as np

from . import series
from .bench import Bench
from .emit import Table
from .statistics import number

#: Kinds of scenes that come in many sizes, and what is the same at all of them
KINDS = {"drum": "rate of rotation, so the speed grows with the radius", "even": "speed and density"}

#: Sums that tell how much there is to do in a step
WORK = ("tests", "swaps", "leaf_changes", "visits")

#: Greatest number of boxes of the second exponent
MIDDLE = 1.2e5


def slopes(bench: Bench) -> Table:
    """Exponents of power laws through the medians, for each kind of scene and finder, and of the counted work."""
    counted = [f"{name} (counted)" for name in WORK]
    table = Table(
        "slopes",
        "Exponent of the time per step against the number of boxes, one thread",
        ("scenes", "finder", "sizes", "all sizes", f"up to {MIDDLE:.0f}", "structure", *counted),
    )
    here = bench.on()
    for kind in KINDS:
        for finder in here.named("finder"):
            cases = [case for case in series.over_size(here, finder, of_kind=kind) if case.time()]
            law = series.law(cases)
            if law is None:
                continue
            middle, structure = series.law(cases, largest=MIDDLE), series.law(cases, series.structure_time)
            table.add(
                kind,
                finder,
                f"{law.sizes[0]:.0f} to {law.sizes[-1]:.0f}",
                law.exponent.text(),
                middle.exponent.text() if middle else "-",
                structure.exponent.text() if structure else "-",
                *(_counted(cases, name) for name in WORK),
            )
    same = "; ".join(f"{kind}: {what}" for kind, what in KINDS.items())
    table.note = (
        f"What is the same at all sizes: {same}. 1: as many boxes, as much time. Counts are exact: where their "
        "exponents exceed 1 there is more to do for each box."
    )
    return table


def _counted(cases: list, name: str) -> str:
    exponent = series.count_slope(cases, name)
    return number(exponent) if np.isfinite(exponent) else "-"
