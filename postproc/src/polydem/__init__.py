"""Simulations of polydem, stepped from Python.

    import polydem

    with polydem.Simulation("inputs/first.nml", {"forces.friction_coefficient": 0.4}) as sim:
        @sim.every(seconds=0.01)
        def watch(sim):
            print(sim.time, sim.energy["kinetic"], len(sim.contacts))
        sim.run(until=0.1)
"""

from .errors import FileError, InputError, PolydemError, RunError
from .library import version
from .namelist import write_namelist
from .simulation import Simulation, Snapshot

__all__ = ["FileError", "InputError", "PolydemError", "RunError", "Simulation", "Snapshot", "version",
           "write_namelist"]
