"""What pictures, films and the viewer need of a frame, as plain columns: the one place where they meet the reader."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .result_file import ResultError
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
    """The bodies of a frame and, if they were written, contacts."""

    frame: Frame
    #: Nothing if they were not wanted, or the run did not write contacts
    contacts: ContactColumns | None

    @property
    def corners(self) -> np.ndarray:
        """Vertices of all bodies in the world [m], (total, 2)."""
        return self.frame.vertex

    @cached_property
    def boxes(self) -> np.ndarray:
        """Axis-aligned bounding boxes: xmin, ymin, xmax, ymax [m], (n, 4)."""
        return self.frame.bounds

    @property
    def area(self) -> np.ndarray:
        """Areas of the polygons [m2], (n)."""
        return self.frame.area

    @property
    def mass(self) -> np.ndarray:
        """Masses, infinite where none is given [kg/m], (n)."""
        return self.frame.mass

    def known_contacts(self) -> ContactColumns:
        """The contacts; an error if the run wrote none."""
        if self.contacts is None:
            raise ResultError("this needs the contacts, which the result does not hold; run with "
                              "output.contacts = .true.")
        return self.contacts


def read_snapshot(trajectory: Trajectory, number: int, contacts: bool = True) -> Snapshot:
    """Read a frame, with its contacts if they are wanted and there are any."""
    return _snapshot(trajectory, trajectory.frame(number), contacts)


def read_snapshots(trajectory: Trajectory, numbers: list[int], contacts: bool = True) -> Iterator[Snapshot]:
    """Read frames in turn, with their contacts if they are wanted and there are any."""
    for number in numbers:
        if not -len(trajectory) <= number < len(trajectory):
            trajectory.frame(number)  # says so
    for frame in trajectory[list(numbers)]:
        yield _snapshot(trajectory, frame, contacts)


def _snapshot(trajectory: Trajectory, frame: Frame, contacts: bool) -> Snapshot:
    if not contacts or not trajectory.has_contacts:
        return Snapshot(frame, None)
    table = frame.contacts
    return Snapshot(frame, ContactColumns(table.first_index, table.second_index, table.point, table.force))


def has_contacts(trajectory: Trajectory) -> bool:
    """Whether the run wrote its contacts."""
    return trajectory.has_contacts
