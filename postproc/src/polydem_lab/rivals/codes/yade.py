"""Yade (Smilauer et al., https://yade-dem.org): polyhedra of unit depth that move in the plane, force from the overlap.

Its law for polyhedra has no restitution, so that only elastic impacts, and sliding, can be compared.
"""

from __future__ import annotations

import math
import re

from ..problems import Problem
from ..runs import WORKERS, Code, Missing, Places, Series, Worker, told

NAME = "Yade"
PROGRAM, PACKAGES = "yade", "yade"

#: Problems that its law can do, and that end within minutes
TAKES = ("slide", "headon_elastic", "corner_elastic")

#: Step at a stiffness of 1e8 [s]; exponents of the stiffnesses [N/m3]
STEP, LEVELS = 4e-4, (8, 9)


def series(_: Problem) -> list[Series]:
    """Stiffer polyhedra with shorter steps."""
    return [Series("Yade", {level: {"dt": STEP * math.sqrt(10.0 ** (8 - level)), "stiffness": 10.0**level}
                            for level in LEVELS}, growth=math.sqrt(10.0))]


def omits(problem: Problem) -> str:
    """Why it does not take part."""
    return "" if problem.name in TAKES else "its polyhedra have no restitution, or it takes minutes"


def find(places: Places) -> Code:
    """Its worker, which Yade runs."""
    try:
        said = told([PROGRAM, "--version"])
    except Missing as error:
        raise Missing(f"it needs the Debian package {PACKAGES}") from error
    found = re.search(r"\d{4}\.\d+\w*", said)
    # Yade does not tell a script where it is.
    command = ["env", f"PYTHONPATH={WORKERS}", PROGRAM, "-j1", "-n", "-x", WORKERS / "yade_worker.py"]
    return Code(Worker(command, places.scratch, "yade"), f"yade {found.group() if found else said[:20]}")
