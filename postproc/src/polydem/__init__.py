"""Simulations of polydem, stepped from Python: `Simulation` in `simulation.py`."""

from . import namelist
from .errors import FileError, InputError, PolydemError, RunError
from .evaluate import evaluate
from .library import version
from .namelist import write_namelist
from .simulation import Simulation, Snapshot

__all__ = ["FileError", "InputError", "PolydemError", "RunError", "Simulation", "Snapshot", "evaluate",
           "namelist", "version", "write_namelist"]
