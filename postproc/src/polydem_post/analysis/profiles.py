"""Profiles: means over slabs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..frames import Frame
from ..polygons import FloatArray
from ..result_file import ResultError
from .windows import area_inside

#: What a body weighs in a slab, per area of it that is inside
WEIGHTS = ("area", "mass")
#: Unit vectors of an axis, and of the direction in which slabs are cut
AXES = {"x": ((1.0, 0.0), (0.0, 1.0)), "y": ((0.0, 1.0), (1.0, 0.0))}


@dataclass(frozen=True)
class Profile:
    """Means over slabs across one axis.

    Fields:

        edges   [m]                     edges of the slabs, (slabs + 1)
        mean    [that of the quantity]  mean in each slab; NaN where there is no body, (slabs) or (slabs, 2)
        weight  [m2 or kg/m]            area or mass of the parts of bodies in each slab, mean over frames, (slabs)
    """

    edges: FloatArray
    mean: FloatArray
    weight: FloatArray

    @property
    def centres(self) -> FloatArray:
        """Middle of each slab [m], (slabs)."""
        return 0.5 * (self.edges[1:] + self.edges[:-1])


def profile(frames: Frame | Iterable[Frame], quantity: Any, edges: Any, *, axis: Any = "y", weight: str = "area",
            between: tuple[float, float] | None = None) -> Profile:
    """Mean of a quantity of free bodies in slabs across an axis, in one frame or over several.

    `quantity` is the name of a column of the frame or, for a single frame, one value or vector per body. A body counts
    in each slab with the area, or the mass, of its part inside, exact by clipping: weights add up to those of all
    bodies. A mean over frames weighs every part alike. `axis` is x, y, or a vector (ax, ay), for example across a
    sloped surface; edges [m] are places on it, measured from the origin. The averaging volume is the slab, cut along
    the other axis, which is (ay, -ax) for a vector, to `between` (low, high) [m] if given, as in GDR MiDi, Eur. Phys.
    J. E 14 (2004) 341. The solid fraction of a slab is `weight` over its area. Components stay those along x and y.
    """
    chosen = [frames] if isinstance(frames, Frame) else frames
    limits = np.asarray(edges, dtype=float)
    if weight not in WEIGHTS:
        raise ResultError("profile needs the weight area or mass")
    if limits.ndim != 1 or len(limits) < 2 or np.any(np.diff(limits) <= 0.0):
        raise ResultError("profile needs the edges of slabs in ascending order")
    across, along = _axes(axis)
    total, weights, count = np.zeros(()), np.zeros(len(limits) - 1), 0
    for frame in chosen:
        values = np.asarray(getattr(frame, quantity) if isinstance(quantity, str) else quantity, dtype=float)
        if len(values) != len(frame):
            raise ResultError("profile needs one value per body")
        shares = _shares(frame, limits, across, along, between)
        if weight == "mass":
            shares[:, frame.free] *= frame.density[frame.free]
        total = total + shares[:, frame.free] @ values[frame.free]
        weights += shares.sum(axis=1)
        count += 1
    if count == 0:
        raise ResultError("a profile needs at least one frame")
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = total / weights.reshape(-1, *[1] * (total.ndim - 1))
    return Profile(limits, mean, weights / count)


def _axes(axis: Any) -> tuple[FloatArray, FloatArray]:
    """Unit vectors across the slabs and along them."""
    if isinstance(axis, str):
        if axis not in AXES:
            raise ResultError("profile needs the axis x or y, or a vector")
        across, along = np.array(AXES[axis])
        return across, along
    vector = np.asarray(axis, dtype=float)
    if vector.shape != (2,) or not np.isfinite(vector).all() or not vector.any():
        raise ResultError("profile needs the axis x or y, or a vector of two numbers that are not both 0")
    unit = vector / np.hypot(*vector)
    return unit, np.array([unit[1], -unit[0]])


def _shares(frame: Frame, limits: FloatArray, across: FloatArray, along: FloatArray,
            between: tuple[float, float] | None) -> FloatArray:
    """Area of the part of each free body in each slab [m2], (slabs, n)."""
    places = frame.vertex @ along
    low, high = between or (float(places.min(initial=0.0)) - 1.0, float(places.max(initial=0.0)) + 1.0)
    shares = np.zeros((len(limits) - 1, len(frame)))
    turns = along[0] * across[1] - along[1] * across[0]
    for share, below, above in zip(shares, limits, limits[1:]):
        corners = [(low, below), (high, below), (high, above), (low, above)]
        slab = np.array([a * along + b * across for a, b in corners])
        share[frame.free] = area_inside(frame, slab if turns > 0.0 else slab[::-1])[frame.free]
    return shares
