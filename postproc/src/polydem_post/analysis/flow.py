"""Flow through a line."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.polygons import FloatArray, area_of, clip
from ..base.result_file import ResultError
from ..read.frames import Frame


@dataclass(frozen=True)
class FlowRate:
    """Mass that passes a line between frames.

    Fields:

        times   [s]     times of the frames, (frames)
        mass    [kg/m]  mass that passed in each interval, from the left of the line to its right, (frames - 1)
        bodies  [1]     number of bodies that passed in each interval, those to the left subtracted, (frames - 1)
    """

    times: FloatArray
    mass: FloatArray
    bodies: Any

    @property
    def rate(self) -> FloatArray:
        """Mass per time in each interval [kg/(m s)], (frames - 1)."""
        return self.mass / np.diff(self.times)

    @property
    def mean(self) -> float:
        """Mass per time over all intervals [kg/(m s)]."""
        return float(self.mass.sum() / (self.times[-1] - self.times[0]))


def flow_rate(frames: Iterable[Frame], start: Any, end: Any) -> FlowRate:
    """Flow of free bodies through the line from `start` to `end` [m].

    A body passes when the straight path of its centre of mass from frame to frame crosses the line; from left to right,
    looking from start to end, is positive. For a hopper take the line along the opening from right to left, then
    what falls is negative, or from left to right, then it is positive. The rate of discharge was first described so by
    W.A. Beverloo, H.A. Leniger & J. van de Velde, Chem. Eng. Sci. 15 (1961) 260. Frames must follow closely enough that
    a path does not bend around the ends of the line. All frames need the same bodies: with sources and sinks,
    `run.departures` has each body that left, `run.time_series['NAME.mass']` what left through a sink so far.
    """
    a, b = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    along = b - a
    right = np.array([along[1], -along[0]])
    times, masses, counts = [], [], []
    before: Frame | None = None
    for frame in frames:
        times.append(frame.time)
        if before is not None:
            if not np.array_equal(before.id, frame.id):
                raise ResultError(
                    "the bodies are not the same in all frames, since some enter, leave or vanish; use run.departures, "
                    "which has each body that left, run.time_series['NAME.mass'] of a sink, or mass_beyond of each "
                    "frame; or choose frames between which none does, as in run[10:20]")
            depth, later = (before.position - a) @ right, (frame.position - a) @ right
            crosses = ((depth <= 0.0) != (later <= 0.0)) & frame.free
            with np.errstate(divide="ignore", invalid="ignore"):
                share = depth / (depth - later)
                place = ((before.position + share[:, None] * (frame.position - before.position) - a) @ along
                         / (along @ along))
            passes = crosses & (place >= 0.0) & (place <= 1.0)
            sign = np.where(later > 0.0, 1.0, -1.0)
            masses.append(float((sign * frame.mass)[passes].sum()))
            counts.append(int(sign[passes].sum()))
        before = frame
    if len(times) < 2:
        raise ResultError("a flow needs at least two frames")
    return FlowRate(np.array(times), np.array(masses), np.array(counts))


def mass_beyond(frame: Frame, point: Any, direction: Any) -> float:
    """Mass of free bodies beyond a line through a point, in the given direction across it [kg/m]; exact by clipping.

    The change of this mass over time is the flow through the whole line.
    """
    place, across = np.asarray(point, dtype=float), np.asarray(direction, dtype=float)
    if len(frame) == 0:
        return 0.0
    beyond = (frame.vertex - place) @ across >= 0.0
    whole, touched = (every.reduceat(beyond, frame.vertex_start[:-1]) for every in (np.logical_and, np.logical_or))
    mass = float(frame.mass[frame.free & whole].sum())
    for k in np.flatnonzero(frame.free & touched & ~whole):
        mass += float(frame.density[k]) * area_of(clip(frame.vertices[k], place, -across))
    return mass
