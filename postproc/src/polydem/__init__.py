"""Simulations of polydem, stepped from Python: `Simulation` in `simulation.py`."""

from . import namelist, settings
from .errors import FileError, InputError, PolydemError, RunError
from .evaluate import evaluate
from .library import version
from .namelist import write_namelist
from .schema import schema
from .simulation import Simulation, Snapshot

__all__ = ["FileError", "InputError", "PolydemError", "RunError", "Simulation", "Snapshot", "evaluate",
           "namelist", "schema", "settings", "version", "write_namelist"]
