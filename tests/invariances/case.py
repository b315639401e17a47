"""A transformed scene, and how its answer follows from that of the scene."""

from dataclasses import dataclass, field

import numpy as np

from scene import Map


@dataclass
class Case:
    """A play, and how its answer follows from that of the scene."""

    parts: list
    #: Change of coordinates and units
    change: Map = field(default_factory=Map)
    #: Identifier in the scene -> identifiers in the other one; others are the same
    ids: dict = field(default_factory=dict)
    #: Velocity that all bodies have beside [m/s], in the units of the other scene
    drift: np.ndarray = field(default_factory=lambda: np.zeros(2))
    #: Bodies that are in the other scene only
    extra: set = field(default_factory=set)
    #: Steps of the scene before the last run of the play began
    before: int = 0
    #: Number of copies, by which energies are multiplied
    copies: int = 1
    #: Whether all bits are the same, up to powers of two
    exact: bool = False
    #: Whether only places and velocities relative to a body are the same
    relative: bool = False
    #: Tolerance relative to size and speed that is allowed, where a run goes on without its history
    loose: float = 0.0
    #: Angles by which bodies have turned before a run that starts from a frame
    turned: dict = None
    #: Whether energies are the same, and means over the sample
    energies: bool = True
    #: Number of ranks; 0: the program without MPI
    ranks: int = 0
    #: Compared by restitution, not by poses
    impact: bool = False
