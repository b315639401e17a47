"""Box2D v3 (Catto, https://box2d.org), by the package pyb2d3 of PyPI: soft steps in single precision.

It becomes more exact only if the frequency of its contact springs rises with the steps: 30 Hz otherwise.
"""

from __future__ import annotations

from ..environment import insist_on_package
from ..problems import Problem
from ..runs import FRAME, WORKERS, Code, Places, Series, Worker, refined

NAME = "Box2D v3"
PACKAGE, MODULE = "pyb2d3==0.11.1", "pyb2d3"

#: Substeps of a step, which is the default of Box2D
SUBSTEPS = 4


def series(problem: Problem) -> list[Series]:
    """More substeps at 60 steps per second; more steps with stiffer contacts."""
    return [
        Series("Box2D v3, substeps", {level: {"dt": FRAME, "substeps": SUBSTEPS * 2**level}
                                      for level in range(problem.refinement + 1)}),
        refined("Box2D v3, stiff", problem.refinement,
                lambda factor: {"substeps": SUBSTEPS, "frequency": factor / FRAME}),
    ]


def omits(_: Problem) -> str:
    """It takes part everywhere."""
    return ""


def find(places: Places) -> Code:
    """Its worker in the Python of the environment."""
    version = insist_on_package(places.python, PACKAGE, MODULE)
    return Code(Worker([places.python, WORKERS / "box2d_worker.py"], places.scratch, "box2d"), version)
