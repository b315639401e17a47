"""The free surface of a granular bed, and its angle."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..base.polygons import FloatArray, following
from ..base.result_file import ResultError
from ..read.frames import Frame
from ..read.trajectory import Trajectory
from .blocks import block_average


@dataclass(frozen=True)
class Surface:
    """Points of a free surface, and the straight line through them.

    Fields:

        points     [m]       points of the surface, (columns, 2)
        angle      [degree]  angle of the line to the x axis, anticlockwise
        deviation  [m]       root mean square distance of the points from the line
    """

    points: FloatArray
    angle: float
    deviation: float


def free_surface(frame: Frame, low: float, high: float, columns: int = 50) -> Surface:
    """The free surface between two places on the x axis, and its angle to the x axis.

    At each of `columns` equally spaced places x the surface is the highest point of all free bodies on the vertical
    there, exact for polygons. The angle is that of the line of least squares of the vertical distances through these
    points: the angle of repose or, in a drum, the dynamic one (GDR MiDi, Eur. Phys. J. E 14 (2004) 341). Choose the
    places away from walls and from the curved ends. Places without a body are left out. Gravity points down.
    """
    if not low < high or columns < 2:
        raise ResultError("free_surface needs low < high, and at least two columns")
    free = np.repeat(frame.free, frame.corners)
    start, end = frame.vertex[free], frame.vertex[following(frame.vertex_start)][free]
    points = []
    for x in low + (high - low) * (np.arange(columns) + 0.5) / columns:
        crosses = (start[:, 0] <= x) != (end[:, 0] <= x)
        if crosses.any():
            a, b = start[crosses], end[crosses]
            points.append((x, float(np.max(a[:, 1] + (b[:, 1] - a[:, 1]) * (x - a[:, 0]) / (b[:, 0] - a[:, 0])))))
    if len(points) < 2:
        raise ResultError(f"there are no free bodies between x = {low:g} and {high:g} m at step {frame.step}")
    surface = np.array(points)
    slope, height = np.polyfit(surface[:, 0], surface[:, 1], 1)
    distance = (surface[:, 1] - slope * surface[:, 0] - height) / np.hypot(1.0, slope)
    return Surface(surface, float(np.degrees(np.arctan(slope))), float(np.sqrt(np.mean(distance**2))))


@dataclass(frozen=True)
class SurfaceAngle:
    """Mean angle of a free surface over time, and its standard error.

    Fields:

        times             [s]       times of the frames, (frames)
        angles            [degree]  angle in each frame, (frames)
        mean              [degree]  mean over the frames
        error             [degree]  standard error of the mean, from blocks of frames
        blocks            [1]       number of blocks; the error has one degree of freedom less
        correlation_time  [s]       integrated autocorrelation time of the angles
    """

    times: FloatArray
    angles: FloatArray
    mean: float
    error: float
    blocks: int
    correlation_time: float


def surface_angle(frames: Iterable[Frame], *, after: float = 0.0, between: tuple[float, float] | None = None,
                  columns: int = 50, blocks: int = 0) -> SurfaceAngle:
    """Mean angle of the free surface over the frames from the time `after` [s] on, with its standard error.

    The angle of each frame is that of `free_surface` between two places (low, high) [m] on the x axis, by default the
    middle half of the extent of the free bodies in the first of these frames. The error is that of `block_average`,
    which says how blocks are chosen and warns of a run that is too short; frames must be at equal intervals of time.
    Choose `after` so that the flow is steady: what drifts has no mean. As in GDR MiDi, Eur. Phys. J. E 14 (2004) 341.
    """
    chosen = frames[frames.times >= after] if isinstance(frames, Trajectory) else frames
    times, angles = [], []
    for frame in chosen:
        if frame.time < after:
            continue
        if between is None:
            bounds = frame.bounds[frame.free]
            if len(bounds) == 0:
                raise ResultError(f"there are no free bodies at step {frame.step}")
            low, high = float(bounds[:, 0].min()), float(bounds[:, 2].max())
            between = 0.75 * low + 0.25 * high, 0.25 * low + 0.75 * high
        times.append(frame.time)
        angles.append(free_surface(frame, *between, columns).angle)
    if not times:
        raise ResultError(f"there are no frames from {after:g} s on")
    found = block_average(angles, blocks=blocks)
    interval = (times[-1] - times[0]) / max(len(times) - 1, 1)
    return SurfaceAngle(np.array(times), np.array(angles), found.mean, found.error, found.blocks,
                        interval * found.correlation_time)
