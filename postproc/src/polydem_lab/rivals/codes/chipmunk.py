"""Chipmunk 7 (Lembcke, https://chipmunk-physics.net), by the package pymunk of PyPI: impulses in double precision."""

from __future__ import annotations

from ..environment import insist_on_package
from ..problems import Problem
from ..runs import WORKERS, Code, Places, Series, Worker, refined

NAME = "Chipmunk"
PACKAGE, MODULE = "pymunk==7.3.1", "pymunk"


def series(problem: Problem) -> list[Series]:
    """More steps, with a depth left in contacts [m] that suits the eye, or with nearly none."""
    return [
        refined("Chipmunk", problem.refinement, lambda factor: {"iterations": 10, "slop": 1e-3}),
        refined("Chipmunk, slop 1e-6", problem.refinement, lambda factor: {"iterations": 30, "slop": 1e-6}),
    ]


def omits(_: Problem) -> str:
    """It takes part everywhere."""
    return ""


def find(places: Places) -> Code:
    """Its worker in the Python of the environment."""
    version = insist_on_package(places.python, PACKAGE, MODULE)
    return Code(Worker([places.python, WORKERS / "chipmunk_worker.py"], places.scratch, "chipmunk"), version)
