"""Quantities of bodies that pictures can be coloured by, with their units, colour maps and ranges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable

import numpy as np

from .snapshot import Snapshot

#: Share of the bodies whose values the range of colours covers, unless it is given: a few fast ones do not darken the
#: rest. What lies outside has the colour of the end, and the scale has an arrow there.
COVERED = 99.5

#: Ranges narrower than this share of the largest value are rounding
NARROWEST = 1e-9

#: What a range spans at least, so that what is at rest looks so: by unit
LEAST = {"m/s": 1e-6, "rad/s": 1e-4, "N/m": 1e-6, "N/m2": 1e-3}


@dataclass(frozen=True)
class Quantity:
    """A value per body."""

    #: What is written at the scale of colours
    label: str
    unit: str
    #: Values of a snapshot, (n)
    values: Callable[[Snapshot], np.ndarray]
    #: Colour map of matplotlib: sequential, diverging or cyclic; all can be told apart by the colour-blind
    colours: str = "viridis"
    #: "zero": the range starts at 0; "both": it is symmetric; "data": least to greatest; "turn": 0 to 2 pi; "class":
    #: whole numbers that stand for themselves
    span: str = "zero"
    needs_contacts: bool = False
    #: Whether the value of a body never changes
    constant: bool = False

    @property
    def title(self) -> str:
        """Label with the unit."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label

    @property
    def count(self) -> int:
        """Number of classes, 0 if the values are continuous."""
        return {"id": 20, "material": 10}.get(self.label.split()[0], 0) if self.span == "class" else 0


def range_of(quantity: Quantity, values: np.ndarray) -> tuple[float, float]:
    """Range of colours for values of all bodies and frames that are shown."""
    if quantity.span == "turn":
        return 0.0, 2.0 * np.pi
    if quantity.span == "class":
        return -0.5, quantity.count - 0.5
    values = values[np.isfinite(values)]
    least = LEAST.get(quantity.unit, 0.0)
    if not len(values):
        return 0.0, max(least, 1.0)
    if quantity.span == "both":
        bound = max(float(np.percentile(np.abs(values), COVERED)), least) or 1.0
        return -bound, bound
    high = float(np.percentile(values, COVERED))
    if quantity.span == "zero":
        return 0.0, max(high, least) or 1.0
    low = float(values.min())
    if high - low <= NARROWEST * max(abs(low), abs(high)):
        widen = 0.05 * max(abs(low), abs(high)) or 1.0
        return low - widen, high + widen
    return low, high


def coordination(snapshot: Snapshot) -> np.ndarray:
    """Number of contacts of each body."""
    contacts, n = snapshot.known_contacts(), len(snapshot.frame.id)
    return np.bincount(contacts.first, minlength=n) + np.bincount(contacts.second, minlength=n)


def resultant(snapshot: Snapshot) -> np.ndarray:
    """Sum of the contact forces on each body [N/m], (n, 2)."""
    contacts = snapshot.known_contacts()
    force = np.zeros((len(snapshot.frame.id), 2))
    np.add.at(force, contacts.first, contacts.force)
    np.add.at(force, contacts.second, -contacts.force)
    return force


def load(snapshot: Snapshot) -> np.ndarray:
    """Sum of the magnitudes of the contact forces on each body [N/m], (n)."""
    contacts, n = snapshot.known_contacts(), len(snapshot.frame.id)
    return (np.bincount(contacts.first, contacts.magnitude, n) + np.bincount(contacts.second, contacts.magnitude, n))


def stress(snapshot: Snapshot) -> np.ndarray:
    """Mean stress of each body [N/m2], (n, 2, 2): sum over its contacts of force times arm, over its area.

    The arm goes from the centre of mass to the contact point. Tension is positive. The symmetric part is given.
    """
    contacts, centre = snapshot.known_contacts(), snapshot.frame.position
    tensor = np.zeros((len(centre), 2, 2))
    for body, sign in ((contacts.first, 1.0), (contacts.second, -1.0)):
        arm = contacts.point - centre[body]
        np.add.at(tensor, body, sign * arm[:, :, None] * contacts.force[:, None, :])
    tensor = 0.5 * (tensor + tensor.transpose(0, 2, 1))
    return tensor / snapshot.area[:, None, None]


def pressure(snapshot: Snapshot) -> np.ndarray:
    """Mean of the principal stresses of each body, compression positive [N/m2], (n)."""
    tensor = stress(snapshot)
    return -0.5 * (tensor[:, 0, 0] + tensor[:, 1, 1])


def shear_stress(snapshot: Snapshot) -> np.ndarray:
    """Half the difference of the principal stresses of each body [N/m2], (n)."""
    tensor = stress(snapshot)
    return np.hypot(0.5 * (tensor[:, 0, 0] - tensor[:, 1, 1]), tensor[:, 0, 1])


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.hypot(vectors[:, 0], vectors[:, 1])


def _given(values: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(values) & (values > 0.0), values, np.nan)


#: What bodies can be coloured by
QUANTITIES = {
    "speed": Quantity("speed", "m/s", lambda s: _length(s.frame.velocity)),
    "velocity_x": Quantity("velocity along x", "m/s", lambda s: s.frame.velocity[:, 0], "coolwarm", "both"),
    "velocity_y": Quantity("velocity along y", "m/s", lambda s: s.frame.velocity[:, 1], "coolwarm", "both"),
    "angular_velocity": Quantity("angular velocity", "rad/s", lambda s: s.frame.angular_velocity, "PuOr", "both"),
    "angle": Quantity("angle", "rad", lambda s: np.mod(s.frame.angle, 2.0 * np.pi), "twilight", "turn"),
    "rotation": Quantity("rotation since the start", "rad", lambda s: s.frame.angle, "PuOr", "both"),
    "size": Quantity("diameter of equal area", "m", lambda s: np.sqrt(4.0 * s.area / np.pi), "cividis", "data",
                     constant=True),
    "mass": Quantity("mass per depth", "kg/m", lambda s: _given(s.mass), "cividis", "data", constant=True),
    "density": Quantity("density", "kg/m3", lambda s: _given(s.mass) / s.area, "cividis", "data", constant=True),
    "material": Quantity("material", "", lambda s: s.frame.material.astype(float), "tab10", "class", constant=True),
    "force": Quantity("resultant of the contact forces", "N/m", lambda s: _length(resultant(s)), "YlOrRd",
                      needs_contacts=True),
    "load": Quantity("sum of the contact forces' magnitudes", "N/m", load, "YlOrRd", needs_contacts=True),
    "coordination": Quantity("number of contacts", "", lambda s: coordination(s).astype(float),
                             needs_contacts=True),
    "pressure": Quantity("pressure", "N/m2", pressure, "YlOrRd", needs_contacts=True),
    "shear_stress": Quantity("shear stress", "N/m2", shear_stress, "YlOrRd", needs_contacts=True),
    "id": Quantity("id modulo 20", "", lambda s: np.mod(s.frame.id, 20).astype(float), "tab20", "class",
                   constant=True),
}
