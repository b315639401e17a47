"""Stress tensors: of a window, and of single bodies. Compression is positive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.polygons import FloatArray, area_of
from ..read.frames import Frame
from .windows import Window, contains, outline_of, share_inside, shifts_into


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

    In a periodic cell copies count as bodies and contacts do: with the whole cell as window each of them counts once.
    """
    outline = outline_of(window)
    area = area_of(outline)
    start, end, force = branches(frame)
    share = np.zeros(len(force))
    inside = np.zeros(len(frame), dtype=np.int64)
    for shift in shifts_into(frame, outline):
        share += share_inside(outline - shift, start, end)
        inside += frame.free & contains(outline - shift, frame.position)
    contact = np.einsum("c,ci,cj->ij", share, force, start - end) / area
    kinetic = np.zeros((2, 2))
    if inside.any():
        counted = inside > 0
        mass, velocity = frame.mass[counted] * inside[counted], frame.velocity[counted]
        relative = velocity - (mass @ velocity) / mass.sum()
        kinetic = np.einsum("b,bi,bj->ij", mass, relative, relative) / area
    return Stress(contact, kinetic, area)


def branches(frame: Frame) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Ends of the branch vectors (first body, second body) [m] and forces on the first body [N/m].

    At a fixed body the end is the point of contact. Contacts between fixed bodies are left out. In a periodic cell a
    vector over the border begins or ends outside.
    """
    contacts = frame.contacts
    kept = ~(frame.fixed[contacts.first_index] & frame.fixed[contacts.second_index])
    if frame.cell_size.any():
        first, second = contacts.first_index[kept], contacts.second_index[kept]
        # The vectors lead from one of the bodies to the nearest copy of the other one.
        start, end = frame.position[first], frame.position[second]
        with_first, with_second = frame.fixed[first][:, None], frame.fixed[second][:, None]
        start = np.where(with_first, end + contacts.second_arm[kept], start)
        end = np.where(with_first, end, start - contacts.branch[kept])
        end = np.where(with_second, start + contacts.first_arm[kept], end)
        return start, end, contacts.force[kept]
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
