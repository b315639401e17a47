"""Reads, analyses, tabulates and draws results of polydem.

    from polydem_post import Trajectory

    run = Trajectory("results/drum")
    for frame in run[::10]:
        print(frame.time, frame.kinetic_energy.sum())

`help(Trajectory)`, `help(Frame)` and `help(Contacts)` describe all columns with their units.

Each subpackage or module imports only itself and those before it in `LAYERS`. The laboratory is a package of its own,
`polydem_lab`; only the command line knows that it is there.
"""

from .base import interrupts  # noqa: F401  the first, before what takes long to load
from .base.result_file import ResultError
from .read.contacts import Contacts, Walls
from .read.frames import Frame
from .read.result_folder import NoManifest
from .read.settings import Settings
from .read.trajectory import NoFrame, Trajectory

__all__ = ["Contacts", "Frame", "NoFrame", "NoManifest", "ResultError", "Settings", "Trajectory", "Walls"]
__version__ = "0.1.0"

#: The subpackages and modules, lowest first
LAYERS = ("base", "outlines", "tracing", "bodies_file", "read", "analysis", "pictures", "export", "sweep", "accuracy",
          "command_line", "manual")


def _draw(frame: Frame) -> bytes:
    """A frame as a notebook draws it."""
    from .pictures.plot import picture

    return picture(frame)


Frame._repr_png_ = _draw
