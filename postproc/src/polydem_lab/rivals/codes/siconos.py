"""Siconos (Acary et al., https://nonsmooth.gricad-pages.univ-grenoble-alpes.fr/siconos): Moreau-Jean time stepping.

Its contacts come from Bullet, which keeps margins of 2 cm around polygons.
"""

from __future__ import annotations

from ..problems import Problem, Threshold
from ..runs import WORKERS, Code, Missing, Places, Series, Worker, told

NAME = "Siconos"
PYTHON, PACKAGES = "/usr/bin/python3", "siconos python3-siconos"

#: Steps [s]
STEPS = (1e-2, 5e-3, 2e-3, 1e-3, 5e-4)

#: Problems of many contacts, in which the solver of one contact after the other takes minutes
SLOW = ("stack", "domino", "hopper", "dense")


def series(problem: Problem) -> list[Series]:
    """More steps."""
    kept = STEPS[: 2 if problem.name == "gas" else len(STEPS)]
    return [Series("Siconos", {level: {"dt": dt} for level, dt in enumerate(kept)})]


def omits(problem: Problem) -> str:
    """Why it does not take part."""
    slow = problem.name in SLOW or isinstance(problem, Threshold)
    return "takes minutes: its solver treats one contact after the other" if slow else ""


def find(places: Places) -> Code:
    """Its worker in the system's Python."""
    try:
        told([PYTHON, "-c", "import siconos.kernel"])
        version = told(["dpkg-query", "--show", "--showformat=${Version}", PACKAGES.split()[-1]])
    except Missing as error:
        raise Missing(f"it needs the Debian packages {PACKAGES}") from error
    return Code(Worker([PYTHON, WORKERS / "siconos_worker.py"], places.scratch, "siconos"), f"siconos {version}")
