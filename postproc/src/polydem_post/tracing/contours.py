"""Outlines of the grains of a picture."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..base.polygons import FloatArray, IntArray
from .labels import Labels, skimage

#: Least distance of a point from the centre of a pixel [pixels]
NEAREST = 0.02


def contours(labels: Labels) -> tuple[list[IntArray], list[FloatArray]]:
    """The points of each grain, as numbers, and where they are [pixels], y up, from the lower left of the picture.

    A point lies between the centres of two pixels of different grains, in the middle, but at the threshold of a grey
    picture between a grain and no grain. Neighbours share points, and so the areas of grains have no common part.
    """
    measure = skimage("measure")
    label = labels.label
    numbers, places = [], []
    for region in measure.regionprops(label):
        top, first, bottom, last = region.bbox
        window = label[top - 1 : bottom + 1, first - 1 : last + 1] == region.label
        line = max(measure.find_contours(window.astype(float), 0.5, fully_connected="low"), key=len)
        twice = np.round(2.0 * line[:-1]).astype(np.int64) + 2 * np.array([top - 1, first - 1])
        numbers.append(twice[:, 0] * 2 * label.shape[1] + twice[:, 1])
        row, column = _places(twice, labels).T
        # The border is one pixel wide, and the centre of a pixel half a pixel from its corner.
        places.append(np.stack([column - 0.5, label.shape[0] - 1.5 - row], axis=1))
    return numbers, places


def _places(twice: IntArray, labels: Labels) -> FloatArray:
    """Row and column of points, given as twice those of the middle between two pixels."""
    if labels.level is None:
        return np.asarray(0.5 * twice, dtype=np.float64)
    one, two = tuple((twice // 2).T), tuple(((twice + 1) // 2).T)
    a, b = labels.level[one], labels.level[two]
    free = (labels.label[one] == 0) != (labels.label[two] == 0)
    moves = free & ((a > 0.0) != (b > 0.0)) & ~_at_saddle(twice, labels.label)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(moves, np.clip(a / (a - b), NEAREST, 1.0 - NEAREST), 0.5)
    return np.asarray(twice // 2 + share[:, None] * ((twice + 1) // 2 - twice // 2), dtype=np.float64)


def _at_saddle(twice: IntArray, label: IntArray) -> npt.NDArray[np.bool_]:
    """Whether a point is at a square of pixels of which two opposite ones are of grains: there lines could cross."""
    inside = label > 0
    a, b, c, d = inside[:-1, :-1], inside[:-1, 1:], inside[1:, :-1], inside[1:, 1:]
    saddle = (a == d) & (b == c) & (a != b)
    row, column = (twice // 2).T
    across = twice[:, 0] % 2 == 1  # between two rows
    return saddle[row, column] | np.where(across, saddle[row, column - 1], saddle[row - 1, column])
