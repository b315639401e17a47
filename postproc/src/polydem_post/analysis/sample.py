"""Quantities of a whole sample, as the series of a run has them."""

from __future__ import annotations

import numpy as np

from ..base.polygons import FloatArray
from ..read.frames import Frame

#: Least x, least y, greatest x, greatest y [m]
Rectangle = tuple[float, float, float, float]


def unbalanced_force(frame: Frame, gravity: tuple[float, float] = (0.0, -9.81)) -> float:
    """Unbalanced force: the mean total force on a free body over the mean force of a contact.

    The total force is that of the contacts and of gravity; drag, if any, is left out. NaN without contacts.
    """
    contacts = frame.contacts
    free = ~(frame.fixed[contacts.first_index] & frame.fixed[contacts.second_index])
    total = frame.force[frame.free] + frame.mass[frame.free][:, None] * np.asarray(gravity)
    force = np.hypot(*contacts.force[free].T)
    if not force.any() or not len(total):
        return float("nan")
    return float(np.hypot(*total.T).mean() / force.mean())


def sample_stress(frame: Frame, area: Rectangle) -> FloatArray:
    """Stress of the bodies whose centres are in a rectangle, over its area [N/m2], (2, 2); positive in compression.

    sigma_ij = -(1/A) sum over the contacts of these bodies of r_i f_j. A is the area of the rectangle, f the force on
    the body, r the vector from its centre of mass to the point of contact (Love 1927). `stress_tensor` cuts branch
    vectors at the edge of its window instead, and has the kinetic part.
    """
    contacts = frame.contacts
    inside = copies_in(frame, area)
    total = np.zeros((2, 2))
    for index, arm, force in ((contacts.first_index, contacts.first_arm, contacts.force),
                              (contacts.second_index, contacts.second_arm, -contacts.force)):
        total -= np.einsum("c,ci,cj->ij", inside[index], arm, force)
    return total / area_of_rectangle(area)


def sample_fraction(frame: Frame, area: Rectangle) -> float:
    """Area of the free bodies whose centres are in a rectangle, over its area; `solid_fraction` cuts them there."""
    return float((frame.area * copies_in(frame, area)).sum()) / area_of_rectangle(area)


def shear_rate(frame: Frame, area: Rectangle, periodic: str = "none", jump: float | None = None) -> float:
    """Difference of the principal rates of strain of the free bodies in a rectangle [1/s]: the rate of a simple shear.

    The rates are those of the linear field of velocities that fits the bodies best (least squares). Along the axes of
    `periodic` (none, x, y or xy) the field does not change; `jump` is the rate of a sheared cell.
    """
    inside = copies_in(frame, area) > 0
    axes = [axis for axis, name in enumerate("xy") if name not in periodic]
    gradient = np.zeros((2, 2))
    if axes and inside.any():
        place = frame.position[inside][:, axes]
        velocity = frame.velocity[inside]
        gradient[axes] = np.linalg.lstsq(place - place.mean(axis=0), velocity - velocity.mean(axis=0), rcond=1e-9)[0]
    if jump is not None:
        gradient[1, 0] = jump
    return float(np.hypot(gradient[0, 0] - gradient[1, 1], gradient[0, 1] + gradient[1, 0]))


def inertial_number(frame: Frame, area: Rectangle, periodic: str = "none", jump: float | None = None) -> float:
    """Inertial number I = shear rate d sqrt(rho/P) of the free bodies in a rectangle.

    GDR MiDi, Eur. Phys. J. E 14 (2004) 341. d is the diameter of a circle with their mean area, rho their mass over
    their area, P half the trace of `sample_stress`; arguments as of `shear_rate`. NaN without pressure.
    """
    inside = copies_in(frame, area) > 0
    pressure = 0.5 * float(np.trace(sample_stress(frame, area)))
    if not pressure > 0.0:
        return float("nan")
    diameter = np.sqrt(4.0 * frame.area[inside].mean() / np.pi)
    density = frame.mass[inside].sum() / frame.area[inside].sum()
    return float(shear_rate(frame, area, periodic, jump) * diameter * np.sqrt(density / pressure))


def copies_in(frame: Frame, area: Rectangle) -> FloatArray:
    """How many copies of each free body have their centres in a rectangle, its left and lower edges included, (n).

    In the plane 1 or 0, and also in a periodic cell if the rectangle is not longer than the cell.
    """
    first, last = _copies_between(frame.position[:, 1], area[1], area[3], frame.cell_size[1])
    number = np.zeros(len(frame))
    for row in range(int(first.min(initial=0.0)), int(last.max(initial=-1.0)) + 1):
        begin, end = _copies_between(frame.position[:, 0] + row * frame.shift, area[0], area[2], frame.cell_size[0])
        number += np.where((first <= row) & (row <= last), np.maximum(end - begin + 1.0, 0.0), 0.0)
    return number * frame.free


def _copies_between(place: FloatArray, low: float, high: float, period: float) -> tuple[FloatArray, FloatArray]:
    """Numbers of the first and the last copies of places in an interval; one copy each if it is as long as the cell."""
    if not period > 0.0:
        return np.zeros(len(place)), np.where((place >= low) & (place < high), 0.0, -1.0)
    first = np.ceil((low - place) / period)
    if abs(high - low - period) <= 1e-6 * period:
        return first, first
    return first, np.ceil((high - place) / period) - 1.0


def area_of_rectangle(area: Rectangle) -> float:
    """Area of a rectangle [m2]."""
    return (area[2] - area[0]) * (area[3] - area[1])
