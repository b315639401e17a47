"""Which part of the plane pictures and films of some frames show by default: all bodies but those that go far away."""

from __future__ import annotations

import numpy as np

from ..base.polygons import FloatArray
from ..base.result_file import ResultError
from ..read.frames import Frame

#: How far driven walls count beyond all else, as a share of its size: a gate may go far away
BESIDE = 0.1

#: How far free bodies count beyond the scene at the start, in units of its size, if a wall is at rest: grains may fall
#: for ever
AROUND = 1.0

#: Margin around the bodies as a share of the larger side
MARGIN = 0.02


class Span:
    """What the bodies of frames span. Of a periodic cell it is the cell."""

    def __init__(self, start: Frame):
        """Begin with the first frame of the run, in which driven walls have their first places."""
        self._first = _span(start, np.ones(len(start), dtype=bool))
        self._first_driven = _span(start, _driven(start))
        self._free, self._resting, self._driven = np.array(NOTHING), np.array(NOTHING), np.array(NOTHING)

    def add(self, frame: Frame) -> None:
        """Take a frame into account."""
        driven = _driven(frame)
        self._free = _both(self._free, _span(frame, frame.free))
        self._driven = _both(self._driven, _span(frame, driven))
        self._resting = _both(self._resting, _span(frame, frame.fixed & ~driven))

    def limits(self) -> tuple[FloatArray, FloatArray]:
        """Lower left and upper right corner, with a margin, (2), (2) [m]."""
        low, high = self.corners()
        if not np.all(np.isfinite([low, high])):
            raise ResultError("there are no bodies to draw" if np.all(low > high) else
                              "the bodies have no extent that can be drawn")
        margin = MARGIN * max(high - low)
        if not 0.0 < margin < np.inf:
            raise ResultError("the bodies have no extent that can be drawn")
        return low - margin, high + margin

    def everything(self) -> FloatArray:
        """Lower left and upper right corner of all bodies, (2, 2) [m]."""
        return _both(_both(self._free, self._resting), self._driven)

    def corners(self) -> FloatArray:
        """Lower left and upper right corner of the bodies that count, (2, 2) [m]."""
        free = self._free
        if np.all(np.isfinite(self._resting)):
            free = _within(free, _wider(self._first, AROUND))
        others = _both(free, self._resting)
        near = _wider(_both(others, self._first_driven), BESIDE)
        return _both(others, _within(self._driven, near))


#: Corners of nothing
NOTHING = ((np.inf, np.inf), (-np.inf, -np.inf))


def _driven(frame: Frame) -> np.ndarray:
    """Which bodies are driven; none if the stored namelist does not say so."""
    try:
        return frame.driven
    except ResultError:
        return np.zeros(len(frame), dtype=bool)


def _span(frame: Frame, chosen: np.ndarray) -> FloatArray:
    """Corners of the box of some bodies, (2, 2)."""
    if not chosen.any():
        return np.array(NOTHING)
    bounds = frame.bounds[chosen]
    corners = np.array([bounds[:, :2].min(axis=0), bounds[:, 2:].max(axis=0)])
    periodic = frame.cell_size > 0.0
    corners[0, periodic] = frame.cell_low[periodic]
    corners[1, periodic] = (frame.cell_low + frame.cell_size)[periodic]
    return corners


def _both(a: FloatArray, b: FloatArray) -> FloatArray:
    """Corners of the box of two boxes."""
    return np.array([np.minimum(a[0], b[0]), np.maximum(a[1], b[1])])


def _wider(box: FloatArray, share: float) -> FloatArray:
    """A box with a border on all sides: a share of its larger side."""
    if not np.all(np.isfinite(box)):
        return np.array([NOTHING[1], NOTHING[0]])
    border = share * max(box[1] - box[0])
    return np.array([box[0] - border, box[1] + border])


def _within(box: FloatArray, border: FloatArray) -> FloatArray:
    """The part of a box within a border; nothing of nothing."""
    return np.clip(box, border[0], border[1]) if np.all(box[0] <= box[1]) else box
