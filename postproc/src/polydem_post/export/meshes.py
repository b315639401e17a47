"""Bodies of a frame as polygons, contacts as lines, with their columns: what all formats write."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.polygons import FloatArray, IntArray
from ..read.frames import Frame

Columns = dict[str, npt.NDArray[Any]]


@dataclass(frozen=True)
class Mesh:
    """Cells of one kind: 'Polygons' (bodies) or 'Lines' (contacts)."""

    kind: str
    #: Points in the plane z = 0 [m], (points, 3)
    points: FloatArray
    #: Points of all cells, in turn
    connectivity: IntArray
    #: First entry of each cell in `connectivity`; at the end its length
    offsets: IntArray
    #: One row per cell; vectors have three components
    data: Columns

    def __len__(self) -> int:
        return len(self.offsets) - 1


def in_space(vectors: FloatArray) -> FloatArray:
    """Vectors in the plane z = 0."""
    return np.column_stack([vectors, np.zeros(len(vectors))])


def finite(values: FloatArray) -> FloatArray:
    """The values with 0 for infinite ones, as result files have masses."""
    return np.where(np.isfinite(values), values, 0.0)


def body_data(frame: Frame, with_contacts: bool) -> Columns:
    """Columns of bodies: infinite masses are 0; force and coordination only if contacts are there."""
    data: Columns = {
        "id": frame.id.astype(np.int32), "fixed": frame.fixed.astype(np.int32),
        "velocity": in_space(frame.velocity), "speed": frame.speed, "angle": frame.angle,
        "angular_velocity": frame.angular_velocity, "mass": finite(frame.mass), "inertia": finite(frame.inertia),
        "area": frame.area, "radius": frame.radius}
    if with_contacts:
        data |= {"force": in_space(frame.force), "coordination": frame.coordination.astype(np.int32)}
    return data


def contact_data(frame: Frame) -> Columns:
    """Columns of contacts."""
    contacts = frame.contacts
    return {
        "first": contacts.first.astype(np.int32), "second": contacts.second.astype(np.int32),
        "force": in_space(contacts.force), "normal_force": contacts.normal_force,
        "tangential_force": contacts.tangential_force, "overlap_area": contacts.area,
        "point": in_space(contacts.point), "normal": in_space(contacts.normal), "length": contacts.length,
        "couple": contacts.couple,
        "with_fixed": contacts.with_fixed.astype(np.int32)}


def body_mesh(frame: Frame, with_contacts: bool) -> Mesh:
    """One polygon per body."""
    start = frame.vertex_start.astype(np.int64)
    return Mesh("Polygons", in_space(frame.vertex), np.arange(start[-1]), start, body_data(frame, with_contacts))


def contact_mesh(frame: Frame) -> Mesh:
    """One line per contact, from centre of mass to centre of mass; at a fixed body it ends at the point of contact.

    In a periodic cell a line over the border leaves the cell, towards the nearest copy of the second body, or of the
    first one if that is fixed.
    """
    contacts = frame.contacts
    n = len(contacts)
    ends = np.empty((2 * n, 2))
    for place, index in enumerate((contacts.first_index, contacts.second_index)):
        ends[place::2] = np.where(frame.fixed[index][:, None], contacts.point, frame.position[index])
    if frame.cell_size.any():
        first, second = contacts.first_index, contacts.second_index
        at_first, at_second = (frame.fixed[index][:, None] for index in (first, second))
        ends[0::2] = np.where(at_first, frame.position[second] + contacts.second_arm, ends[0::2])
        ends[1::2] = np.where(at_first | at_second, ends[1::2], frame.position[first] - contacts.branch)
    return Mesh("Lines", in_space(ends), np.arange(2 * n), 2 * np.arange(n + 1), contact_data(frame))


def filled_contact_mesh(frame: Frame) -> Mesh:
    """The contacts; a frame without any has one line without length between bodies -1, with zeros.

    VTK 9.4 and later reads wrong cells in the step that follows an empty one of a VTKHDF file, and readers of XDMF take
    no empty arrays.
    """
    mesh = contact_mesh(frame)
    if len(mesh):
        return mesh
    data: Columns = {name: np.zeros((1, *values.shape[1:]), values.dtype) for name, values in mesh.data.items()}
    data |= {name: np.array([-1], dtype=np.int32) for name in ("first", "second")}
    points = in_space(np.repeat(frame.position[:1], 2, axis=0))
    return Mesh("Lines", points, np.arange(2), np.array([0, 2]), data)
