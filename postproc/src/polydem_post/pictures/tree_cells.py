"""Cells of the minimal quadtree over the boxes of a frame, by the rule of the finder `quadtree` of the program.

A leaf is the largest cell that contains the centre of a single box. A cell with the centres of at least two boxes is
divided into four, down to the finest level; cells without a centre do not exist. The side of the finest cells is 1.2
times the geometric mean of the reaches of the boxes, halved until it is at most the smallest reach, but at most
twelve times. The reach of a box is half the diameter of its body. The first box of the first frame fixes where cell
borders lie: its lower left corner is 0.381966 of a finest cell away from the corner of cell (m, m), m = 357913941 =
0101...01 in base 2.

The program cuts bodies that are much longer than others into pieces with boxes of their own. Here each free body has
one box; fixed bodies that are longer than `LONGEST` median diameters have none, so the cells are those of the rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..read.frames import Frame

#: Side of the cells of one level in units of the geometric mean of the reaches, and most levels below it
TYPICAL_SHARE, MOST_LEVELS = 1.2, 12

#: Index of the cell in which the first box lies, and where in it
MIDDLE, OFF_BORDER = 357913941, 0.381966

#: Bodies longer than this many median diameters are cut by the program
LONGEST = 4.0

#: Highest level of the root
TOP_LEVEL = 30


@dataclass(frozen=True)
class CellGrid:
    """Where the borders of cells lie: the same in all frames of a run."""

    #: Side of a finest cell [m]
    finest: float
    #: Lower left corner of the first box of the first frame [m]
    origin: np.ndarray
    #: Rows of the bodies that have boxes in the tree
    bodies: np.ndarray

    def finest_cells(self, boxes: np.ndarray) -> np.ndarray:
        """Finest cell of the centre of each box, (n, 2)."""
        centre = 0.5 * (boxes[:, :2] + boxes[:, 2:])
        cell = np.floor((centre - self.origin) / self.finest + MIDDLE + OFF_BORDER)
        return np.clip(cell, 0, 2**TOP_LEVEL - 1).astype(np.int64)


@dataclass(frozen=True)
class Cells:
    """Nodes of the tree."""

    #: Lower left corner [m], (cells, 2), and side [m], (cells)
    low: np.ndarray
    side: np.ndarray
    #: Whether each is a leaf, and how many boxes it contains
    leaf: np.ndarray
    count: np.ndarray


def cell_grid(frame: Frame) -> CellGrid | None:
    """The grid of a run from its first frame; nothing if there is no body with a size."""
    reach = 0.5 * frame.diameter
    free = ~frame.fixed
    median = np.median(reach[free]) if free.any() else np.inf
    bodies = np.flatnonzero(reach <= LONGEST * median)
    sizes = reach[bodies]
    if not len(sizes) or not (sizes > 0.0).any():
        return None
    sizes = sizes[sizes > 0.0]
    finest = TYPICAL_SHARE * float(np.exp(np.mean(np.log(sizes))))
    for _ in range(MOST_LEVELS):
        if finest <= sizes.min():
            break
        finest *= 0.5
    return CellGrid(finest, frame.bounds[bodies[0], :2], bodies)


def tree_cells(grid: CellGrid, boxes: np.ndarray) -> Cells:
    """Nodes of the minimal quadtree over the boxes of the bodies of the grid."""
    at = grid.finest_cells(boxes[grid.bodies])
    level = _root_level(at)
    found, waiting = [], at
    while len(waiting):
        cell, inverse, counts = np.unique(waiting >> level, axis=0, return_inverse=True, return_counts=True)
        leaf = (counts == 1) | (level == 0)
        found.append((cell << level, np.full(len(cell), 2**level), leaf, counts))
        waiting = waiting[~leaf[inverse.ravel()]]
        level -= 1
    low, side, leaf, count = (np.concatenate(parts) for parts in zip(*found))
    corner = (low - (MIDDLE + OFF_BORDER)) * grid.finest + grid.origin
    return Cells(corner, side * grid.finest, leaf, count)


def _root_level(at: np.ndarray) -> int:
    """Level of the smallest cell that contains all finest cells."""
    spread = int(np.bitwise_or.reduce((at ^ at[0]).ravel()))
    return spread.bit_length()
