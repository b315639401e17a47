"""The free surface of a granular bed, and its angle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..frames import Frame
from ..polygons import FloatArray, following
from ..result_file import ResultError


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
