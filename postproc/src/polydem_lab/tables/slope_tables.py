"""How time, and the work that was counted, grow with the number of boxes."""

from __future__ import annotations

import numpy as np
from polydem_post.base.emit import Table

from ..bench import series
from ..bench.samples import Bench
from ..bench.statistics import curvature, number, slope

#: Kinds of scenes that come in many sizes, and what is the same at all of them
KINDS = {"drum": "rate of rotation, so the speed grows with the radius", "even": "speed and density"}

#: Sums that tell how much there is to do in a step
WORK = ("tests", "swaps", "leaf_changes", "visits")

#: Quantities whose time grows, and what they are called
QUANTITIES = {"list": series.total_time, "structure": series.structure_time}


def slopes(bench: Bench) -> Table:
    """Exponents of power laws through the medians, for each kind of scene and finder, and of the counted work."""
    counted = [f"{name} (counted)" for name in WORK]
    table = Table(
        "slopes",
        "Exponent of the time per step against the number of boxes, one thread",
        ("scenes", "finder", "sizes", "paper's sizes", "larger sizes", "all sizes", "greatest residual [%]",
         "growth of the exponent per decade", "structure, paper's sizes", "structure, all sizes", *counted),
    )
    for kind, finder, cases in _series(bench):
        law = series.law(cases)
        if law is None:
            continue
        others = [series.law_of_paper(cases), series.law_beyond(cases), law,
                  series.law_of_paper(cases, series.structure_time), series.law(cases, series.structure_time)]
        near, beyond, whole, *structure = (each.exponent.text() if each else "-" for each in others)
        table.add(
            kind, finder, f"{law.sizes[0]:.0f} to {law.sizes[-1]:.0f}", near, beyond, whole,
            number(100.0 * float(np.abs(law.residuals).max()), 2), number(curvature(law.sizes, law.medians), 2),
            *structure, *(_counted(cases, name) for name in WORK),
        )
    same = "; ".join(f"{kind}: {what}" for kind, what in KINDS.items())
    table.note = (
        f"What is the same at all sizes: {same}. Intervals know how well the law fits. Residuals and growth: of the "
        "law through all sizes; a power law has a growth of 0. 1: as many boxes, as much time. Counts are exact: where "
        "their exponents exceed 1 there is more to do for each box."
    )
    return table


def local_exponents(bench: Bench) -> Table:
    """Exponents between neighbouring sizes, and how far each size is from the law through all."""
    table = Table(
        "local_exponents", "Exponents between neighbouring sizes, one thread",
        ("scenes", "finder", "time", "boxes", "next boxes", "exponent", "residual of the first [%]",
         "residual of the second [%]"), texts=3,
    )
    for kind, finder, cases in _series(bench):
        for name, quantity in QUANTITIES.items():
            law = series.law(cases, quantity)
            if law is None:
                continue
            residuals = [number(100.0 * float(value), 2) for value in law.residuals]
            points = series.steps_over_size(cases, quantity)
            for k, (one, other) in enumerate(zip(points, points[1:])):
                local = slope([one[0], other[0]], [one[1], other[1]])
                table.add(kind, finder, name, one[0], other[0], local.text(), *residuals[k : k + 2])
    table.note = (
        "Time: of the whole list, or of the structure alone. Residuals: by how much the median lies above the power "
        "law through all sizes (table slopes)."
    )
    return table


def _series(bench: Bench):
    """(kind, finder, cases over size) of all that the main build was measured with."""
    here = bench.on()
    for kind in KINDS:
        for finder in here.named("finder"):
            yield kind, finder, [case for case in series.over_size(here, finder, of_kind=kind) if case.time()]


def _counted(cases: list, name: str) -> str:
    exponent = series.count_slope(cases, name)
    return number(exponent) if np.isfinite(exponent) else "-"
