"""Continuum fields by coarse graining: density, velocity and stress on a grid."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..base.polygons import FloatArray, IntArray
from ..base.result_file import ResultError
from ..read.frames import Frame
from .stress import branches
from .windows import rectangle, shifts_into

#: Points of a branch vector on which its stress is spread, per distance of grid points, and the least number
LINE_POINTS, LEAST_LINE_POINTS = 2.0, 8

#: Weights that are held in memory at once
AT_ONCE = 2**20


@dataclass(frozen=True)
class Kernel:
    """A coarse-graining function of the distance, which vanishes beyond its range.

    Fields:

        name   [text]  what it is called
        range  [m]     distance beyond which it is zero
        value  [1/m2]  function of an array of distances [m]; the integral over the plane is 1
    """

    name: str
    range: float
    value: Callable[[FloatArray], FloatArray]


def lucy(width: float) -> Kernel:
    """Kernel of L.B. Lucy, Astron. J. 82 (1977) 1013: 5/(pi c^2) (1 + 3 r/c) (1 - r/c)^3 for r < c = `width` [m]."""

    def value(distance: FloatArray) -> FloatArray:
        share = np.minimum(distance / width, 1.0)
        return 5.0 / (np.pi * width**2) * (1.0 + 3.0 * share) * (1.0 - share) ** 3

    return Kernel("Lucy", width, value)


def gaussian(width: float) -> Kernel:
    """Gaussian with the standard deviation `width` [m], cut off at three of them and normalised to the integral 1."""
    norm = 2.0 * np.pi * width**2 * (1.0 - np.exp(-4.5))

    def value(distance: FloatArray) -> FloatArray:
        return np.where(distance < 3.0 * width, np.exp(-0.5 * (distance / width) ** 2) / norm, 0.0)

    return Kernel("Gaussian", 3.0 * width, value)


@dataclass(frozen=True)
class Fields:
    """Fields on a grid; arrays have one row per y and one column per x.

    Fields:

        x               [m]          places of the columns, (columns)
        y               [m]          places of the rows, (rows)
        density         [kg/m3]      mass per area with unit depth, (rows, columns)
        momentum        [kg/(m2 s)]  momentum per area, (rows, columns, 2)
        contact_stress  [N/m2]       compression is positive; NaN if contacts are left out, (rows, columns, 2, 2)
        kinetic_stress  [N/m2]       compression is positive, (rows, columns, 2, 2)
    """

    x: FloatArray
    y: FloatArray
    density: FloatArray
    momentum: FloatArray
    contact_stress: FloatArray
    kinetic_stress: FloatArray

    @property
    def velocity(self) -> FloatArray:
        """Momentum over density [m/s], (rows, columns, 2); NaN where there is no mass."""
        with np.errstate(divide="ignore", invalid="ignore"):
            velocity: FloatArray = self.momentum / self.density[..., None]
        return velocity

    @property
    def stress(self) -> FloatArray:
        """Sum of contact and kinetic stress [N/m2], (rows, columns, 2, 2)."""
        return self.contact_stress + self.kinetic_stress

    @property
    def cell(self) -> float:
        """Area of a cell of the grid [m2]."""
        return float((self.x[1] - self.x[0]) * (self.y[1] - self.y[0]))


def coarse_grain(frame: Frame, kernel: Kernel, spacing: float, *,
                 window: tuple[float, float, float, float] | None = None, contacts: bool = True) -> Fields:
    """Fields of the free bodies on a square grid (I. Goldhirsch, Granular Matter 12 (2010) 239).

    density(r) = sum m phi(r - r_b), momentum likewise with m v; kinetic stress = sum m u u phi with u = v - V(r), V the
    velocity field; contact stress = sum f b times the integral of phi(r - s) along the branch vector b, which ends at
    the point of contact at a fixed body (T. Weinhart et al., Granular Matter 14 (2012) 289).

    The weights phi of each body on the grid are divided by their sum, so mass, momentum and the integral of the
    contact stress are conserved to rounding: the sum over the grid of density times the area of a cell is the mass of
    the bodies. The grid covers all bodies and the range of the kernel unless a window (least x, least y, greatest x,
    greatest y) [m] is given; then what lies outside is lost, and nothing else. `contacts=False` leaves the contact
    stress out, for results without contacts.

    In a periodic cell copies count as bodies do, and the grid covers the cell; in a sheared one it keeps the range of
    the kernel away from the upper and lower border, behind which copies have other velocities.
    """
    if not spacing > 0.0 or kernel.range < spacing:
        raise ResultError("the spacing must be above 0, and at most the range of the kernel")
    grid = _Grid(frame, kernel, spacing, window)
    free = frame.free
    mass, velocity, place = frame.mass[free], frame.velocity[free], frame.position[free]
    second = velocity[:, :, None] * velocity[:, None, :]
    carried = np.concatenate([np.ones((len(mass), 1)), velocity, second.reshape(-1, 4)], axis=1) * mass[:, None]
    spread = grid.spread_copies(frame, place, carried)
    density, momentum = spread[..., 0], spread[..., 1:3]
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = momentum[..., :, None] * momentum[..., None, :] / density[..., None, None]
    kinetic = spread[..., 3:].reshape(*density.shape, 2, 2) - np.where(density[..., None, None] > 0.0, mean, 0.0)
    stress = _contact_stress(frame, grid) if contacts else np.full((*density.shape, 2, 2), np.nan)
    return Fields(grid.x, grid.y, density, momentum, stress, kinetic)


def _contact_stress(frame: Frame, grid: _Grid) -> FloatArray:
    """Each branch vector as equal pieces, each in its middle."""
    start, end, force = branches(frame)
    branch = start - end
    carried = np.einsum("ci,cj->cij", force, branch).reshape(-1, 4)
    length = float(np.hypot(branch[:, 0], branch[:, 1]).max()) if len(branch) else 0.0
    pieces = max(LEAST_LINE_POINTS, int(np.ceil(LINE_POINTS * length / grid.spacing)))
    total = np.zeros((len(grid.y), len(grid.x), 4))
    for share in (np.arange(pieces) + 0.5) / pieces:
        total += grid.spread_copies(frame, end + share * branch, carried / pieces)
    return total.reshape(*total.shape[:2], 2, 2)


class _Grid:
    """A grid, and how quantities at points are spread over it."""

    def __init__(self, frame: Frame, kernel: Kernel, spacing: float,
                 window: tuple[float, float, float, float] | None):
        self.kernel, self.spacing = kernel, spacing
        # Copies above and below a sheared cell have other velocities.
        inset = np.array([0.0, kernel.range if frame.shear_offset is not None else 0.0])
        inner_low, inner_high = frame.cell_low + inset, frame.cell_low + frame.cell_size - inset
        if window is None:
            bounds = frame.bounds[frame.free]
            if len(bounds) == 0:
                raise ResultError("there are no free bodies")
            margin = kernel.range + spacing
            low, high = bounds[:, :2].min(axis=0) - margin, bounds[:, 2:].max(axis=0) + margin
            low = np.where(frame.cell_size > 0.0, inner_low, low)
            high = np.where(frame.cell_size > 0.0, inner_high, high)
        else:
            low, high = np.array(window[:2], dtype=float), np.array(window[2:], dtype=float)
            if frame.shear_offset is not None and (low[1] < inner_low[1] or high[1] > inner_high[1]):
                raise ResultError("the window must keep the range of the kernel away from the upper and lower border "
                                  f"of the sheared cell: {inner_low[1]:g} to {inner_high[1]:g} m")
        if np.any(high - low < 2.0 * spacing):
            raise ResultError("the window must be at least two spacings wide and high")
        self.x = np.arange(low[0] + 0.5 * spacing, high[0], spacing)
        self.y = np.arange(low[1] + 0.5 * spacing, high[1], spacing)
        self._reach = int(np.ceil(kernel.range / spacing))
        self._steps: IntArray = np.arange(-self._reach, self._reach + 1)

    def spread_copies(self, frame: Frame, points: FloatArray, carried: FloatArray) -> FloatArray:
        """The same with the copies of a periodic cell."""
        corners = rectangle(self.x[0], self.y[0], self.x[-1], self.y[-1])
        parts = [self.spread(points + shift, carried) for shift in shifts_into(frame, corners)]
        total: FloatArray = np.sum(parts, axis=0)
        return total

    def spread(self, points: FloatArray, carried: FloatArray) -> FloatArray:
        """Sum over points of what they carry times their weights per area, (rows, columns, carried)."""
        total = np.zeros((len(self.y) * len(self.x), carried.shape[1]))
        many = max(1, AT_ONCE // len(self._steps) ** 2)
        for first in range(0, len(points), many):
            self._add(points[first : first + many], carried[first : first + many], total)
        return total.reshape(len(self.y), len(self.x), -1)

    def _add(self, points: FloatArray, carried: FloatArray, total: FloatArray) -> None:
        origin = np.array([self.x[0], self.y[0]])
        nearest = np.rint((points - origin) / self.spacing).astype(np.int64)
        column, row = (nearest[:, axis, None] + self._steps for axis in (0, 1))
        away = [index * self.spacing + origin[axis] - points[:, axis, None] for axis, index in enumerate((column, row))]
        weight = self.kernel.value(np.hypot(away[0][:, None, :], away[1][:, :, None]))
        weight /= weight.sum(axis=(1, 2), keepdims=True) * self.spacing**2
        inside = (((column >= 0) & (column < len(self.x)))[:, None, :] & ((row >= 0) & (row < len(self.y)))[:, :, None])
        place = (row[:, :, None] * len(self.x) + column[:, None, :])[inside]
        body = np.broadcast_to(np.arange(len(points))[:, None, None], inside.shape)[inside]
        for k in range(carried.shape[1]):
            total[:, k] += np.bincount(place, weights=weight[inside] * carried[body, k], minlength=len(total))
