"""What pictures, films and the viewer need of a frame, as plain columns: the one place where they meet the reader."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .result_file import ResultError, reading
from .trajectory import Frame, Trajectory


@dataclass(frozen=True)
class ContactColumns:
    """Contacts with rows of bodies in place of identifiers."""

    #: Rows of the two bodies, counted from 0, (m)
    first: np.ndarray
    second: np.ndarray
    #: Centroid of the overlap [m], (m, 2)
    point: np.ndarray
    #: Force on the first body [N/m], (m, 2)
    force: np.ndarray

    @cached_property
    def magnitude(self) -> np.ndarray:
        """Magnitude of the forces [N/m], (m)."""
        return np.hypot(self.force[:, 0], self.force[:, 1])


@dataclass(frozen=True)
class Snapshot:
    """The bodies of a frame, with mass and, if they were written, contacts."""

    frame: Frame
    #: Masses [kg/m], (n); 0 or infinite: not given
    mass: np.ndarray
    #: Nothing if the run did not write contacts
    contacts: ContactColumns | None

    @cached_property
    def outlines(self) -> list[np.ndarray]:
        """Vertices of each body in the world [m]."""
        return self.frame.vertices

    @cached_property
    def corners(self) -> np.ndarray:
        """Vertices of all bodies in the world [m], (total, 2)."""
        return np.concatenate(self.outlines) if self.outlines else np.empty((0, 2))

    @cached_property
    def boxes(self) -> np.ndarray:
        """Axis-aligned bounding boxes: xmin, ymin, xmax, ymax [m], (n, 4)."""
        if not self.outlines:
            return np.empty((0, 4))
        start = self.frame.vertex_start[:-1]
        return np.hstack([np.minimum.reduceat(self.corners, start), np.maximum.reduceat(self.corners, start)])

    @cached_property
    def area(self) -> np.ndarray:
        """Areas of the polygons [m2], (n)."""
        shape, start = self.frame.shape, self.frame.vertex_start
        after = np.arange(1, len(shape) + 1)
        after[start[1:] - 1] = start[:-1]
        cross = shape[:, 0] * shape[after, 1] - shape[:, 1] * shape[after, 0]
        return 0.5 * np.add.reduceat(cross, start[:-1]) if len(start) > 1 else np.empty(0)

    @cached_property
    def largest_radius(self) -> np.ndarray:
        """Greatest distance of a vertex from the centre of mass [m], (n)."""
        size = np.hypot(self.frame.shape[:, 0], self.frame.shape[:, 1])
        return np.maximum.reduceat(size, self.frame.vertex_start[:-1]) if len(size) else np.empty(0)

    def known_contacts(self) -> ContactColumns:
        """The contacts; an error if the run wrote none."""
        if self.contacts is None:
            raise ResultError("this needs the contacts, which the result does not hold; run with "
                              "output.contacts = .true.")
        return self.contacts


def read_snapshot(trajectory: Trajectory, number: int, contacts: bool = True) -> Snapshot:
    """Read a frame, with its contacts if they are wanted and there are any."""
    frame = trajectory.frame(number)
    columns = _read_contacts(trajectory, number, frame) if contacts and has_contacts(trajectory) else None
    return Snapshot(frame, _masses(trajectory, number, frame), columns)


def has_contacts(trajectory: Trajectory) -> bool:
    """Whether the run wrote its contacts."""
    if not len(trajectory):
        return False
    segment, _ = trajectory._locate(0)
    with reading(segment.path) as file:
        return "contacts" in file


def _masses(trajectory: Trajectory, number: int, frame: Frame) -> np.ndarray:
    segment, _ = trajectory._locate(number)
    with reading(segment.path) as file:
        if "mass" not in file["bodies"]:
            return np.full(len(frame.id), np.nan)
        return file["bodies/mass"][:]


def _read_contacts(trajectory: Trajectory, number: int, frame: Frame) -> ContactColumns:
    table = trajectory.contacts(number)
    if not np.isin(np.concatenate([table.first, table.second]), frame.id).all():
        raise ResultError(f"{trajectory.folder}: contacts of step {frame.step} name bodies that are not there")
    first, second = np.searchsorted(frame.id, table.first), np.searchsorted(frame.id, table.second)
    return ContactColumns(first, second, table.point, table.force)
