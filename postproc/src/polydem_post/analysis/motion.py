"""Motion of bodies over time."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.polygons import FloatArray, IntArray
from ..base.result_file import ResultError
from ..read.frames import Frame

#: Differences of intervals that count as equal, relative to the interval
EQUAL = 0.01


@dataclass(frozen=True)
class Displacements:
    """Mean squared displacements over lags.

    Fields:

        lag     [s]   lags, of which the first is 0, (lags)
        square  [m2]  mean squared displacement, (lags)
        count   [1]   number of displacements behind each mean, (lags)
    """

    lag: FloatArray
    square: FloatArray
    count: IntArray


def mean_squared_displacement(frames: Iterable[Frame], chosen: Any = None, *, relative: bool = False) -> Displacements:
    """Mean squared displacement <|r(t + lag) - r(t)|^2> over the free bodies and all times t of the frames.

    `chosen` selects bodies by index or truth value instead. With `relative` the displacement of the mean position of
    these bodies is subtracted. Frames must be equally spaced in time, within one per cent or one time step, since a run
    writes a frame at the step nearest to its time. Source: A. Einstein, Ann. Phys. 322 (1905) 549; averaging over time
    origins as in M.P. Allen & D.J. Tildesley, Computer Simulation of Liquids (2017), Sec. 8.5. All positions are in
    memory: 16 bytes per frame and body.
    """
    times, steps, places, names = [], [], [], []
    for frame in frames:
        times.append(frame.time)
        steps.append(frame.step)
        places.append(frame.position[frame.free if chosen is None else chosen])
        names.append(frame.id[frame.free if chosen is None else chosen])
    if not places or len(places[0]) == 0 or not all(np.array_equal(each, names[0]) for each in names):
        raise ResultError("the frames have no bodies to follow, or not the same ones; if some enter or leave, choose "
                          "frames between which none does, or bodies that are in all of them")
    interval = np.diff(times)
    time_step = (times[-1] - times[0]) / (steps[-1] - steps[0]) if steps[-1] > steps[0] else 0.0
    allowed = max(EQUAL * np.median(interval), 1.01 * time_step) if len(times) > 1 else 0.0
    if len(times) > 1 and np.abs(interval - np.median(interval)).max() > allowed:
        raise ResultError("the frames are not equally spaced in time; choose some, as in run[:-1]")
    position = np.array(places)
    if relative:
        position = position - position.mean(axis=1, keepdims=True)
    square, count = [], []
    for lag in range(len(times)):
        moved = position[lag:] - position[: len(times) - lag]
        square.append(float(np.mean(np.sum(moved**2, axis=2))))
        count.append(moved.shape[0] * moved.shape[1])
    step = float(np.mean(interval)) if len(times) > 1 else 0.0
    return Displacements(np.linspace(0.0, step * (len(times) - 1), len(times)), np.array(square), np.array(count))
