"""Reads, analyses, tabulates and draws results of polydem.

    from polydem_post import Trajectory

    run = Trajectory("results/drum")
    for frame in run[::10]:
        print(frame.time, frame.kinetic_energy.sum())

`help(Trajectory)`, `help(Frame)` and `help(Contacts)` describe all columns with their units.
"""

from .contacts import Contacts, Walls
from .frames import Frame
from .result_file import ResultError
from .settings import Settings
from .trajectory import NoFrame, NoManifest, Trajectory

__all__ = ["Contacts", "Frame", "NoFrame", "NoManifest", "ResultError", "Settings", "Trajectory", "Walls"]
__version__ = "0.1.0"
