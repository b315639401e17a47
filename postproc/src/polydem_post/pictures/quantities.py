"""Quantities of bodies that pictures can be coloured by, with their units, colour maps and ranges."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Callable

import numpy as np

from ..analysis.stress import body_stress
from ..read.frames import Frame

#: Share of the bodies whose values the range of colours covers, unless it is given: a few fast ones do not darken the
#: rest. What lies outside has the colour of the end, and the scale has an arrow there.
COVERED = 99.5

#: Ranges narrower than this share of the largest value are rounding
NARROWEST = 1e-9

#: What a range spans at least, so that what is at rest looks so: by unit
LEAST = {"m/s": 1e-6, "rad/s": 1e-4, "N/m": 1e-6, "N/m²": 1e-3}


@dataclass(frozen=True)
class Quantity:
    """A value per body."""

    #: What is written at the scale of colours
    label: str
    unit: str
    #: Values of a frame, (n)
    values: Callable[[Frame], np.ndarray]
    #: Colour map of matplotlib: sequential, diverging or cyclic; all can be told apart by the colour-blind
    colours: str = "viridis"
    #: "zero": the range starts at 0; "both": it is symmetric; "data": least to greatest; "turn": 0 to 2 pi; "class":
    #: whole numbers that stand for themselves
    span: str = "zero"
    needs_contacts: bool = False
    #: Whether the value of a body never changes
    constant: bool = False
    #: Whether the value depends on the velocity along x, which copies across a sheared border have not in common
    along_shear: bool = False

    @property
    def title(self) -> str:
        """Label with the unit."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label

    @property
    def count(self) -> int:
        """Number of classes, 0 if the values are continuous."""
        return {"id": 20, "material": 10}.get(self.label.split()[0], 0) if self.span == "class" else 0

    def values_with_copies(self, frame: Frame) -> list[np.ndarray]:
        """Values of a frame, and of the copies in each of `frame.shifts`, (n) each."""
        found = {0.0: self.values(frame)}
        moves = frame.copy_velocities[:, 0] if self.along_shear else np.zeros(len(frame.shifts))
        for speed in np.unique(moves[moves != 0.0]):
            found[speed] = self.values(replace(frame, velocity=frame.velocity + np.array([speed, 0.0])))
        return [found[0.0], *(found[speed] for speed in moves)]


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


def load(frame: Frame) -> np.ndarray:
    """Sum of the magnitudes of the contact forces on each body [N/m], (n)."""
    contacts, n = frame.contacts, len(frame)
    return (np.bincount(contacts.first_index, contacts.force_magnitude, n)
            + np.bincount(contacts.second_index, contacts.force_magnitude, n))


def stress(frame: Frame) -> np.ndarray:
    """Symmetric part of the mean stress of each body [N/m2], (n, 2, 2); compression is positive."""
    tensor = body_stress(frame)
    return 0.5 * (tensor + tensor.transpose(0, 2, 1))


def pressure(frame: Frame) -> np.ndarray:
    """Mean of the principal stresses of each body, compression positive [N/m2], (n)."""
    tensor = body_stress(frame)
    return 0.5 * (tensor[:, 0, 0] + tensor[:, 1, 1])


def shear_stress(frame: Frame) -> np.ndarray:
    """Half the difference of the principal stresses of each body [N/m2], (n)."""
    tensor = stress(frame)
    return np.hypot(0.5 * (tensor[:, 0, 0] - tensor[:, 1, 1]), tensor[:, 0, 1])


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.hypot(vectors[:, 0], vectors[:, 1])


def _given(values: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(values) & (values > 0.0), values, np.nan)


#: What bodies can be coloured by
QUANTITIES = {
    "speed": Quantity("speed", "m/s", lambda f: f.speed, along_shear=True),
    "velocity_x": Quantity("velocity along x", "m/s", lambda f: f.velocity[:, 0], "coolwarm", "both",
                           along_shear=True),
    "velocity_y": Quantity("velocity along y", "m/s", lambda f: f.velocity[:, 1], "coolwarm", "both"),
    "angular_velocity": Quantity("angular velocity", "rad/s", lambda f: f.angular_velocity, "PuOr", "both"),
    "angle": Quantity("angle", "rad", lambda f: np.mod(f.angle, 2.0 * np.pi), "twilight", "turn"),
    "rotation": Quantity("rotation since the start", "rad", lambda f: f.angle, "PuOr", "both"),
    "size": Quantity("equivalent diameter", "m", lambda f: f.equivalent_diameter, "cividis", "data",
                     constant=True),
    "mass": Quantity("mass per depth", "kg/m", lambda f: _given(f.mass), "cividis", "data", constant=True),
    "density": Quantity("density", "kg/m³", lambda f: _given(f.mass) / f.area, "cividis", "data", constant=True),
    "material": Quantity("material", "", lambda f: f.material.astype(float), "materials", "class", constant=True),
    "force": Quantity("resultant of the contact forces", "N/m", lambda f: _length(f.force), "YlOrRd",
                      needs_contacts=True),
    "load": Quantity("sum of the contact forces' magnitudes", "N/m", load, "YlOrRd", needs_contacts=True),
    "coordination": Quantity("number of contacts", "", lambda f: f.coordination.astype(float),
                             needs_contacts=True),
    "pressure": Quantity("pressure", "N/m²", pressure, "YlOrRd", needs_contacts=True),
    "shear_stress": Quantity("shear stress", "N/m²", shear_stress, "YlOrRd", needs_contacts=True),
    "id": Quantity("id modulo 20", "", lambda f: np.mod(f.id, 20).astype(float), "tab20", "class",
                   constant=True),
}
