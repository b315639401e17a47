"""Numbers of the paper's figures beside ours: all that its text, legends and captions state of them.

Krengel, Watanabe, Kandori, Chen, Matuttis, "Tree codes and sort-and-sweep algorithms for neighborhood computation: A
cache-conscious comparison" (2026). published_points.csv says where each number is stated. The points of the curves
themselves are not stated; their axes are in the units of other machines and another program.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass, fields
from pathlib import Path

from polydem_post.base.emit import Table

from ..bench import series
from ..bench.samples import Bench
from ..bench.series import SWEEP, TREE

#: The numbers
POINTS = Path(__file__).parent / "published_points.csv"


@dataclass(frozen=True)
class Point:
    """One number that the paper states of a figure."""

    source: str
    figure: str
    quantity: str
    finder: str
    boxes: str
    value: str
    stated_in: str


def read_points() -> list[Point]:
    """All numbers in the order of the figures."""
    with POINTS.open(newline="", encoding="utf-8") as file:
        return [Point(**{each.name: row[each.name] for each in fields(Point)}) for row in csv.DictReader(file)]


def published_table(bench: Bench) -> Table:
    """The paper's numbers beside ours over the paper's sizes, one thread."""
    table = Table("published_points", "Numbers of the paper's figures beside ours",
                  ("figure", "quantity", "finder", "boxes", "paper", "ours", "stated in"), texts=3)
    here = bench.on()
    for point in read_points():
        table.add(point.figure, point.quantity, point.finder, point.boxes, point.value, _ours(here, point),
                  point.stated_in)
    table.note = (
        f"{point.source}; '-': not measured, or not measurable here. The paper gives its curves without numbers. "
        "Fig. 9: whole steps with the making of the boxes, or the replay if these were measured at fewer than three "
        "sizes."
    )
    return table


def _ours(bench: Bench, point: Point) -> str:
    """The same quantity of these samples."""
    structure = "update" in point.quantity
    quantity = series.structure_time if structure else series.total_time
    cases_of = series.as_published if point.figure == "Fig. 9" else series.over_size
    if point.quantity.startswith("exponent"):
        law = series.law_of_paper(cases_of(bench, point.finder), quantity)
        return law.exponent.text() if law else "-"
    if point.finder == f"{TREE} / {SWEEP}":
        both = series.pairs_of(series.of_paper(cases_of(bench, TREE)), cases_of(bench, SWEEP))
        return series.pooled_ratio(both, quantity).text() if both else "-"
    return "-"
