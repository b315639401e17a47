"""What a trajectory holds at one time: bodies, contacts, and the loads of walls."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from .result_file import ResultError, insist


@dataclass(frozen=True)
class Frame:
    """The bodies at one time. Arrays are in the order of the identifiers; SI units."""

    #: Number of the time step
    step: int
    #: Simulated time [s]
    time: float
    #: Identifiers, (n)
    id: np.ndarray
    #: Whether each body is fixed: moved by prescription or not at all, (n)
    fixed: np.ndarray
    #: Centres of mass [m], (n, 2)
    position: np.ndarray
    #: Angles since the start [rad], (n)
    angle: np.ndarray
    #: Velocities [m/s], (n, 2)
    velocity: np.ndarray
    #: Angular velocities [rad/s], (n)
    angular_velocity: np.ndarray
    #: Vertices relative to the centres of mass at angle 0 [m], (total, 2), and where each body's begin, (n + 1)
    shape: np.ndarray
    vertex_start: np.ndarray

    @cached_property
    def vertices(self) -> list[np.ndarray]:
        """Outline of each body in the world [m]: a list of (m, 2) arrays, anticlockwise."""
        count = np.diff(self.vertex_start)
        cosine = np.repeat(np.cos(self.angle), count)
        sine = np.repeat(np.sin(self.angle), count)
        x, y = self.shape[:, 0], self.shape[:, 1]
        turned = np.column_stack([cosine * x - sine * y, sine * x + cosine * y])
        world = turned + np.repeat(self.position, count, axis=0)
        return np.split(world, self.vertex_start[1:-1])


@dataclass(frozen=True)
class Contacts:
    """The overlapping pairs of bodies at one time."""

    #: Identifier of the first body, the lower one, (n)
    first: np.ndarray
    #: Identifier of the second body, (n)
    second: np.ndarray
    #: Area of the overlap [m2], (n)
    area: np.ndarray
    #: Centroid of the overlap [m], (n, 2)
    point: np.ndarray
    #: Integral of the outward normal over the outline of the first body inside the second [m], (n, 2)
    normal: np.ndarray
    #: Force on the first body [N/m], (n, 2); the second feels the opposite
    force: np.ndarray

    def __len__(self) -> int:
        return len(self.first)


@dataclass(frozen=True)
class Walls:
    """What acts on the fixed bodies at one time."""

    #: Identifiers of the fixed bodies, (w)
    id: np.ndarray
    #: Forces of the other bodies on them [N/m], (w, 2)
    force: np.ndarray
    #: Torques about their centres of mass [N], (w)
    torque: np.ndarray


def sound_frame(path: Path, frame: Frame) -> Frame:
    """The frame, if its arrays fit together."""
    n, vertices = len(np.atleast_1d(frame.id)), len(np.atleast_1d(frame.shape))
    names = ("id", "fixed", "position", "angle", "velocity", "angular_velocity", "shape", "vertex_start")
    arrays = {name: getattr(frame, name) for name in names}
    shapes = {"position": (n, 2), "velocity": (n, 2), "shape": (vertices, 2), "vertex_start": (n + 1,)}
    insist(path, "frame", arrays, {name: shapes.get(name, (n,)) for name in arrays})
    start = frame.vertex_start
    if start[0] != 0 or start[-1] != vertices or np.any(np.diff(start) < 3):
        raise ResultError(f"{path}: bodies/vertex_start does not fit the vertices")
    return frame
