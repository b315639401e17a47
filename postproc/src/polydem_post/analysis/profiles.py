"""Profiles: means over slabs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..frames import Frame
from ..polygons import FloatArray
from ..result_file import ResultError
from .windows import area_inside, rectangle

#: What a body weighs in a slab, per area of it that is inside
WEIGHTS = ("area", "mass")


@dataclass(frozen=True)
class Profile:
    """Means over slabs across one axis.

    Fields:

        edges   [m]                     edges of the slabs, (slabs + 1)
        mean    [that of the quantity]  mean in each slab; NaN where there is no body, (slabs) or (slabs, 2)
        weight  [m2 or kg/m]            area or mass of the parts of bodies in each slab, (slabs)
    """

    edges: FloatArray
    mean: FloatArray
    weight: FloatArray

    @property
    def centres(self) -> FloatArray:
        """Middle of each slab [m], (slabs)."""
        return 0.5 * (self.edges[1:] + self.edges[:-1])


def profile(frame: Frame, quantity: Any, edges: Any, *, axis: str = "y", weight: str = "area",
            between: tuple[float, float] | None = None) -> Profile:
    """Mean of a quantity of free bodies in slabs across the axis x or y.

    `quantity` is the name of a column of the frame or one value or vector per body. A body counts in each slab with
    the area, or the mass, of its part inside, exact by clipping: weights add up to those of all bodies. The averaging
    volume is the slab, cut along the other axis to `between` (low, high) [m] if given, as in GDR MiDi, Eur. Phys. J. E
    14 (2004) 341. The solid fraction of a slab is `weight` over its area.
    """
    values = np.asarray(getattr(frame, quantity) if isinstance(quantity, str) else quantity, dtype=float)
    limits = np.asarray(edges, dtype=float)
    if axis not in ("x", "y") or weight not in WEIGHTS or len(values) != len(frame):
        raise ResultError("profile needs the axis x or y, the weight area or mass, and one value per body")
    if limits.ndim != 1 or len(limits) < 2 or np.any(np.diff(limits) <= 0.0):
        raise ResultError("profile needs the edges of slabs in ascending order")
    bounds = frame.bounds
    across = (1, 3) if axis == "x" else (0, 2)
    low, high = between or (float(bounds[:, across[0]].min()) - 1.0, float(bounds[:, across[1]].max()) + 1.0)
    means, weights = [], []
    for below, above in zip(limits, limits[1:]):
        slab = rectangle(below, low, above, high) if axis == "x" else rectangle(low, below, high, above)
        share = np.where(frame.free, area_inside(frame, slab), 0.0)
        if weight == "mass":
            share[frame.free] *= frame.density[frame.free]
        total = float(share.sum())
        means.append(share @ values / total if total > 0.0 else np.full(values.shape[1:], np.nan))
        weights.append(total)
    return Profile(limits, np.array(means), np.array(weights))
