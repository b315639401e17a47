"""Rapier (Dimforge, https://rapier.rs), by the crate rapier2d-f64: soft steps in double precision.

It becomes more exact only if the frequency of its contacts rises with the steps and contacts are not reused.
"""

from __future__ import annotations

from ..environment import insist_on_crate
from ..problems import Problem
from ..runs import FRAME, Code, Places, Series, Worker, refined

NAME = "Rapier"


def series(problem: Problem) -> list[Series]:
    """More steps; more steps with stiffer contacts."""
    return [
        refined("Rapier", problem.refinement, lambda factor: {"recycling": True}),
        refined("Rapier, stiff", problem.refinement,
                lambda factor: {"recycling": False, "frequency": 0.5 * factor / FRAME}),
    ]


def omits(_: Problem) -> str:
    """It takes part everywhere."""
    return ""


def find(places: Places) -> Code:
    """Its worker, a program in Rust."""
    program, version = insist_on_crate(places.environment, "rapier_worker", "rapier2d-f64")
    return Code(Worker([program], places.scratch, "rapier"), version)
