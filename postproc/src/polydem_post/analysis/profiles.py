"""Profiles: means over slabs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Union

import numpy as np

from ..base.polygons import FloatArray, IntArray, area_of, clip, following, join, moments, sums
from ..base.result_file import ResultError
from ..read.frames import Frame
from .blocks import average_in_blocks

#: What a body weighs in a slab, per area of it that is inside
WEIGHTS = ("area", "mass")
#: Unit vectors of an axis, and of the direction in which slabs are cut
AXES = {"x": ((1.0, 0.0), (0.0, 1.0)), "y": ((0.0, 1.0), (1.0, 0.0))}

#: What is averaged: a column by its name, values of the bodies, or what gives them for a frame
Quantity = Union[str, Any, Callable[[Frame], Any]]


@dataclass(frozen=True)
class Profile:
    """Means over slabs across one axis.

    Fields:

        edges        [m]                     edges of the slabs, (slabs + 1)
        mean         [that of the quantity]  mean in each slab; NaN where there is no body, (slabs) or (slabs, 2)
        weight       [m2 or kg/m]            area or mass of the parts of bodies in each slab, mean over frames, (slabs)
        fluctuation  [that of the quantity]  root mean square deviation from the local mean, shape as `mean`
        error        [that of the quantity]  standard error of the mean from blocks of frames, shape as `mean`
        blocks       [1]                     number of blocks of each error, shape as `mean`
    """

    edges: FloatArray
    mean: FloatArray
    weight: FloatArray
    fluctuation: FloatArray
    error: FloatArray
    blocks: IntArray

    @property
    def centres(self) -> FloatArray:
        """Middle of each slab [m], (slabs)."""
        return 0.5 * (self.edges[1:] + self.edges[:-1])


@dataclass(frozen=True)
class _Parts:
    """The parts of bodies in slabs, of one frame: p parts of k bodies."""

    #: Slab of each part, (p)
    slab: IntArray
    #: Row of its body in `values` and `places`, (p)
    body: IntArray
    #: Its area [m2] or mass [kg/m], (p)
    weight: FloatArray
    #: Values of the bodies, (k, components)
    values: FloatArray
    #: Places of their centres of mass on the axis [m], (k)
    places: FloatArray

    def total(self, values: FloatArray, slabs: int) -> FloatArray:
        """Weighted sum over the parts in each slab of one value per part, (slabs)."""
        return np.bincount(self.slab, self.weight * values, slabs).astype(float)


def profile(frames: Frame | Iterable[Frame], quantity: Quantity, edges: Any, *, axis: Any = "y",
            angle: float | None = None, weight: str = "area", between: tuple[float, float] | None = None,
            blocks: int = 0) -> Profile:
    """Mean of a quantity of free bodies in slabs across an axis, in one frame or over several, with its error.

    `quantity` is the name of a column of the frame, a function that gives one value or vector per body of a frame, or,
    for a single frame, these values. A body counts in each slab with the area, or the mass, of its part inside, exact
    by clipping: weights add up to those of all bodies. A mean over frames weighs every part alike. `axis` is x, y, or
    a vector (ax, ay); `angle` [degree, anticlockwise] gives instead the axis (-sin, cos), upwards across a surface
    of this angle to the x axis. Edges [m] are places on the axis, measured from the origin. The averaging volume is
    the slab, cut along the other axis, which is (ay, -ax) for a vector and (cos, sin) for an angle, to `between` (low,
    high) [m] if given, as in GDR MiDi, Eur. Phys. J. E 14 (2004) 341. The solid fraction of a slab is `weight` over
    its area. Components stay those along x and y.

    `fluctuation` is sqrt(sum w (q - Q)^2/sum w) over the parts in a slab and all frames, for each component, with the
    local mean Q at the centre of mass of the body, linear between the middles of slabs: in a linear profile it does not
    depend on the width of slabs, whereas the deviation from the mean of the slab does (B.J. Glasser & I. Goldhirsch,
    Phys. Fluids 13 (2001) 407). For velocities, half the sum of its squares is the granular temperature [m2/s2].

    `error` is that of the mean over frames at equal intervals of time, from blocks of frames as in `block_average`, of
    length chosen for each slab and component; `blocks` chooses their number instead. It is NaN below 4 frames. Where
    `blocks` is 4 the run may be too short. Frames are read once; the parts of all are in memory, about 100 bytes
    per body and frame.
    """
    limits = np.asarray(edges, dtype=float)
    if weight not in WEIGHTS:
        raise ResultError("profile needs the weight area or mass")
    if limits.ndim != 1 or len(limits) < 2 or np.any(np.diff(limits) <= 0.0):
        raise ResultError("profile needs the edges of slabs in ascending order")
    across, along = _axes(axis, angle)
    parts, is_vector = [], False
    for frame in [frames] if isinstance(frames, Frame) else frames:
        values = _values(frame, quantity)
        is_vector = values.ndim > 1
        parts.append(_parts(frame, values.reshape(len(frame), -1), limits, across, along, between, weight))
    if not parts:
        raise ResultError("a profile needs at least one frame")
    found = _means(parts, limits, blocks)
    mean, fluctuation, error, number = (each if is_vector else each[:, 0] for each in found[1:])
    return Profile(limits, mean, found[0], fluctuation, error, number)


def _values(frame: Frame, quantity: Quantity) -> FloatArray:
    """One value or vector of the quantity per body."""
    if isinstance(quantity, str):
        quantity = getattr(frame, quantity)
    values = np.asarray(quantity(frame) if callable(quantity) else quantity, dtype=float)
    if values.ndim not in (1, 2) or len(values) != len(frame):
        raise ResultError("profile needs one value per body")
    return values


def _axes(axis: Any, angle: float | None) -> tuple[FloatArray, FloatArray]:
    """Unit vectors across the slabs and along them."""
    if angle is not None:
        if not np.isfinite(angle) or not (isinstance(axis, str) and axis == "y"):
            raise ResultError("profile needs an axis or an angle, a finite number of degrees, but not both")
        turn = np.radians(angle)
        return np.array([-np.sin(turn), np.cos(turn)]), np.array([np.cos(turn), np.sin(turn)])
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


def _parts(frame: Frame, values: FloatArray, limits: FloatArray, across: FloatArray, along: FloatArray,
           between: tuple[float, float] | None, weight: str) -> _Parts:
    """The parts of the free bodies of a frame in the slabs."""
    outlines, rows = _outlines(frame, along, between)
    areas = np.diff(_areas_below(outlines, across, along, limits), axis=0)
    slab, column = np.nonzero(areas > 0.0)
    body = rows[column]
    size = areas[slab, column] * (frame.density[body] if weight == "mass" else 1.0)
    used, row = np.unique(body, return_inverse=True)
    return _Parts(slab, row.reshape(-1), size, values[used], frame.position[used] @ across)


def _outlines(frame: Frame, along: FloatArray,
              between: tuple[float, float] | None) -> tuple[list[FloatArray], IntArray]:
    """Outlines of the free bodies, as far as they are between two places on the other axis, and rows of the bodies."""
    rows = np.flatnonzero(frame.free)
    outlines = [frame.vertices[k] for k in rows]
    if between is None or not outlines:
        return outlines, rows
    kept, inside = [], []
    low, high = min(between), max(between)
    for row, outline in zip(rows, outlines):
        places = outline @ along
        if places.min() < low:
            outline = clip(outline, low * along, -along)
        if places.max() > high:
            outline = clip(outline, high * along, along)
        if len(outline) > 2 and area_of(outline) != 0.0:
            kept.append(outline)
            inside.append(row)
    return kept, np.array(inside, dtype=np.int64)


def _areas_below(outlines: list[FloatArray], across: FloatArray, along: FloatArray, limits: FloatArray) -> FloatArray:
    """Area of the part of each polygon below each limit on an axis [m2], (limits, polygons); exact.

    Green's theorem over the parts of the edges below the limit; with depths from the limit, the line that cuts the
    polygon adds nothing.
    """
    if not outlines:
        return np.zeros((len(limits), 0))
    vertex, start = join(outlines)
    area, after, count = np.abs(moments(vertex, start)[0]), following(start), np.diff(start)
    origin = vertex[start[:-1]]
    local = vertex - np.repeat(origin, count, axis=0)
    aside, height = local @ along, local @ across
    lowest, highest = (each.reduceat(height, start[:-1]) for each in (np.minimum, np.maximum))
    below = np.zeros((len(limits), len(outlines)))
    for row, level in zip(below, limits[:, None] - origin @ across):
        cut = (lowest < level) & (level < highest)
        row[highest <= level] = area[highest <= level]
        if not cut.any():
            continue
        depth = height - np.repeat(level, count)
        ends = np.array([aside, depth]), np.array([aside[after], depth[after]])
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = np.array([(ends[0][0] * ends[1][1] - ends[1][0] * ends[0][1]) / (ends[1][1] - ends[0][1]),
                                 np.zeros(len(depth))])
            a, b = (np.where(end[1] > 0.0, crossing, end) for end in ends)
            edges = np.where((ends[0][1] > 0.0) & (ends[1][1] > 0.0), 0.0, a[0] * b[1] - b[0] * a[1])
        row[cut] = np.minimum(0.5 * np.abs(sums(edges, start)), area)[cut]
    return below


def _means(parts: list[_Parts], limits: FloatArray, blocks: int) -> tuple[Any, ...]:
    """Weight, mean, fluctuation, error and number of blocks of each slab; all but the first (slabs, components)."""
    slabs, components = len(limits) - 1, parts[0].values.shape[1]
    ones = [np.ones(len(each.slab)) for each in parts]
    weights = np.array([each.total(one, slabs) for each, one in zip(parts, ones)])
    whole = weights.sum(axis=0)
    mean, fluctuation, error = (np.full((slabs, components), np.nan) for _ in range(3))
    number = np.zeros((slabs, components), dtype=np.int64)
    with np.errstate(divide="ignore", invalid="ignore"):
        for c in range(components):
            totals = np.array([each.total(each.values[each.body, c], slabs) for each in parts])
            mean[:, c] = totals.sum(axis=0) / whole
            squares = np.zeros(slabs)
            for each in parts:
                deviation = each.values[:, c] - _local_mean(limits, mean[:, c], each.places)
                squares += each.total(deviation[each.body] ** 2, slabs)
            fluctuation[:, c] = np.sqrt(squares / whole)
            series = np.where(weights > 0.0, totals / weights, 0.0)
            for k in np.flatnonzero(whole > 0.0):
                found = average_in_blocks(series[:, k], weights[:, k], blocks)
                error[k, c], number[k, c] = found.error, found.blocks
    return whole / len(parts), mean, fluctuation, error, number


def _local_mean(limits: FloatArray, mean: FloatArray, places: FloatArray) -> FloatArray:
    """The mean at places on the axis, linear between the middles of slabs with bodies and beyond the outermost."""
    known = np.isfinite(mean)
    x, y = 0.5 * (limits[1:] + limits[:-1])[known], mean[known]
    if len(x) < 2:
        return np.full(len(places), y[0] if len(y) else np.nan)
    k = np.clip(np.searchsorted(x, places) - 1, 0, len(x) - 2)
    value: FloatArray = y[k] + (y[k + 1] - y[k]) * (places - x[k]) / (x[k + 1] - x[k])
    return value
