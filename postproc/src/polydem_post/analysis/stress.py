"""Stress tensors: of a window, and of single bodies. Compression is positive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.polygons import FloatArray, area_of
from ..read.frames import Frame
from .windows import Window, contains, outline_of, share_inside


@dataclass(frozen=True)
class Stress:
    """A mean stress tensor; compression is positive.

    Fields:

        contact  [N/m2]  part of the contact forces, (2, 2)
        kinetic  [N/m2]  part of the velocity fluctuations, (2, 2)
        area     [m2]    area of the window
    """

    contact: FloatArray
    kinetic: FloatArray
    area: float

    @property
    def total(self) -> FloatArray:
        """Sum of both parts [N/m2], (2, 2)."""
        return self.contact + self.kinetic

    @property
    def pressure(self) -> float:
        """Half of the trace [N/m2]."""
        return 0.5 * float(np.trace(self.total))

    @property
    def deviator(self) -> float:
        """Half of the difference of the principal stresses [N/m2]."""
        low, high = np.linalg.eigvalsh(0.5 * (self.total + self.total.T))
        return 0.5 * float(high - low)

    @property
    def angle(self) -> float:
        """Direction of the greatest principal stress from the x axis, in (-pi/2, pi/2] [rad]."""
        total = 0.5 * (self.total + self.total.T)
        return 0.5 * float(np.arctan2(2.0 * total[0, 1], total[0, 0] - total[1, 1]))


def stress_tensor(frame: Frame, window: Window) -> Stress:
    """Mean stress in a window, which is the averaging volume (area A, unit depth).

    Contact part: sigma_ij = (1/A) sum over contacts of w f_i b_j. f is the force on one body, b the branch vector to
    its centre of mass from that of the other, w the share of the branch vector inside the window (A.E.H. Love, A
    Treatise on the Mathematical Theory of Elasticity (1927); J. Christoffersen, M.M. Mehrabadi & S. Nemat-Nasser, J.
    Appl. Mech. 48 (1981) 339; w as in the coarse graining of Goldhirsch with a window as kernel). The branch vector
    to a fixed body ends at the point of contact (T. Weinhart et al., Granular Matter 14 (2012) 289).

    Kinetic part: sigma_ij = (1/A) sum over free bodies with their centres inside of m u_i u_j, u the velocity
    relative to the mean velocity of their mass. Without contacts in the result the contact part is an error, not
    zero.
    """
    outline = outline_of(window)
    area = area_of(outline)
    start, end, force = branches(frame)
    share = share_inside(outline, start, end)
    contact = np.einsum("c,ci,cj->ij", share, force, start - end) / area
    inside = frame.free & contains(outline, frame.position)
    kinetic = np.zeros((2, 2))
    if inside.any():
        mass, velocity = frame.mass[inside], frame.velocity[inside]
        relative = velocity - (mass @ velocity) / mass.sum()
        kinetic = np.einsum("b,bi,bj->ij", mass, relative, relative) / area
    return Stress(contact, kinetic, area)


def branches(frame: Frame) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Ends of the branch vectors (first body, second body) [m] and forces on the first body [N/m].

    At a fixed body the end is the point of contact. Contacts between fixed bodies are left out.
    """
    contacts = frame.contacts
    kept = ~(frame.fixed[contacts.first_index] & frame.fixed[contacts.second_index])
    ends = [np.where(frame.fixed[index][:, None], contacts.point, frame.position[index])[kept]
            for index in (contacts.first_index, contacts.second_index)]
    return ends[0], ends[1], contacts.force[kept]


def body_stress(frame: Frame) -> FloatArray:
    """Mean stress inside each body [N/m2], (n, 2, 2): sigma_ij = -(1/A) sum over its contacts of f_i r_j.

    A is the area of the body, the averaging volume; f the force on it and r the vector from its centre of mass to the
    point of contact (Love 1927; for bodies with accelerations this is the static part). Compression is positive.
    """
    contacts = frame.contacts
    total = np.zeros((len(frame), 2, 2))
    for index, arm, sign in ((contacts.first_index, contacts.first_arm, -1.0),
                             (contacts.second_index, contacts.second_arm, 1.0)):
        np.add.at(total, index, sign * np.einsum("ci,cj->cij", contacts.force, arm))
    return total / frame.area[:, None, None]
