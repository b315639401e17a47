"""The contacts of a frame, and the loads of walls."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.polygons import FloatArray, IntArray
from .tables import contact_table


@dataclass(frozen=True, eq=False, repr=False)
class Contacts:
    """The overlapping pairs of bodies at one time: m contacts; SI units with unit depth.

    The first body of a contact is the one with the lower identifier. A contact acts on its first body; its second body
    feels the opposite force and couple.

    Read from the file:

        first         [1]    identifier of the first body, (m)
        second        [1]    identifier of the second body, (m)
        area          [m2]   area of the overlap; with forces.law = 'conservative' its effective area, (m)
        point         [m]    point within both bodies where the force acts, (m, 2)
        normal        [1]    unit vector across the contact, from the first body into the second, (m, 2)
        length        [m]    length of the contact; 0 without direction, as of one body inside the other, (m)
        force         [N/m]  force on the first body, (m, 2)
        couple        [N]    torque on the first body besides that of the force at the point, mostly 0, (m)

    Found from the bodies of the frame:

        first_index   [1]    index of the first body in the columns of the frame, from 0, (m)
        second_index  [1]    index of the second body in the columns of the frame, from 0, (m)
        branch        [m]    vector from the centre of mass of the second body to that of the first, (m, 2)
        first_arm     [m]    vector from the centre of mass of the first body to the point, (m, 2)
        second_arm    [m]    vector from the centre of mass of the second body to the point, (m, 2)
        with_fixed    [1]    whether one of the two bodies is fixed, (m)

    Of the file, too, if it has columns of other names:

        others        [SI]   these by name, as in contacts.others["slip"]; the file has their units, (m) or (m, 2)
    """

    first: npt.NDArray[np.integer[Any]]
    second: npt.NDArray[np.integer[Any]]
    area: FloatArray
    point: FloatArray
    normal: FloatArray
    length: FloatArray
    force: FloatArray
    couple: FloatArray
    first_index: IntArray
    second_index: IntArray
    branch: FloatArray
    first_arm: FloatArray
    second_arm: FloatArray
    with_fixed: npt.NDArray[np.bool_]
    others: dict[str, FloatArray] = field(default_factory=dict)

    def __len__(self) -> int:
        """Number of contacts."""
        return len(self.first)

    def __repr__(self) -> str:
        """Number of contacts and the greatest force."""
        greatest = f", greatest force {self.force_magnitude.max():.4g} N/m" if len(self) else ""
        return f"<Contacts: {len(self)} pairs{greatest}>"

    @cached_property
    def is_first(self) -> npt.NDArray[np.bool_]:
        """Whether no contact before has the same two bodies [1], (m): bodies of several pieces may have several."""
        low, high = np.sort([self.first, self.second], axis=0).astype(np.int64)
        _, rows = np.unique((low << 32) + high, return_index=True)
        first = np.zeros(len(self), dtype=bool)
        first[rows] = True
        return first

    @cached_property
    def depth(self) -> FloatArray:
        """Mean depth of each overlap [m], (m): area over length; infinite for an overlap without length."""
        endless = np.where(self.area > 0.0, np.inf, 0.0)
        return np.divide(self.area, self.length, out=endless, where=self.length > 0.0)

    @property
    def area_gradient(self) -> FloatArray:
        """Length times normal: the integral of the outward normal over the outline of first inside second [m], (m, 2).

        It is the gradient of the area when the first body moves.
        """
        return self.length[:, None] * self.normal

    @cached_property
    def tangent(self) -> FloatArray:
        """Unit vector of each tangent: the normal turned by a right angle anticlockwise [1], (m, 2)."""
        return np.column_stack([-self.normal[:, 1], self.normal[:, 0]])

    @cached_property
    def normal_force(self) -> FloatArray:
        """Normal part of each force; positive: the bodies repel each other [N/m], (m)."""
        return -np.einsum("ij,ij->i", self.force, self.normal)

    @cached_property
    def tangential_force(self) -> FloatArray:
        """Tangential part of each force on the first body along `tangent` [N/m], (m)."""
        return np.einsum("ij,ij->i", self.force, self.tangent)

    @cached_property
    def normal_vector(self) -> FloatArray:
        """Normal part of each force on the first body as a vector [N/m], (m, 2)."""
        return -self.normal_force[:, None] * self.normal

    @cached_property
    def tangential_vector(self) -> FloatArray:
        """Tangential part of each force on the first body as a vector [N/m], (m, 2)."""
        return self.tangential_force[:, None] * self.tangent

    @cached_property
    def force_magnitude(self) -> FloatArray:
        """Magnitude of each force [N/m], (m)."""
        return np.hypot(self.force[:, 0], self.force[:, 1])

    def to_pandas(self) -> Any:
        """The contacts as a pandas table, one row per contact; vectors become two columns (point_x, point_y)."""
        return contact_table(self)


@dataclass(frozen=True, eq=False, repr=False)
class Walls:
    """What acts on the fixed bodies at one time: w fixed bodies; SI units with unit depth.

    Read from the file:

        id      [1]    identifiers of the fixed bodies, (w)
        force   [N/m]  forces of the other bodies on them, (w, 2)
        torque  [N]    torques about their centres of mass, (w)
    """

    id: npt.NDArray[np.integer[Any]]
    force: FloatArray
    torque: FloatArray

    def __len__(self) -> int:
        """Number of fixed bodies."""
        return len(self.id)

    def __repr__(self) -> str:
        """Number of fixed bodies and the greatest force."""
        greatest = f", greatest force {np.hypot(*self.force.T).max():.4g} N/m" if len(self) else ""
        return f"<Walls: {len(self)} fixed bodies{greatest}>"
