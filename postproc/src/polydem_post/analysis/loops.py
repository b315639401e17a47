"""Loops of contacts: the cells into which the contact network divides the plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..read.frames import Frame


@dataclass(frozen=True)
class ContactLoops:
    """The smallest closed chains of bodies that touch each other, k of them: SI units.

        sides      [1]   number of bodies of each, (k)
        area       [m2]  area of the polygon through their centres of mass, (k)
        start      [1]   place of the first body of each in `index`, (k + 1)
        index      [1]   indices of the bodies of all loops, anticlockwise

    `index` refers to the bodies of the frame.
    """

    sides: npt.NDArray[np.int64]
    area: npt.NDArray[np.float64]
    start: npt.NDArray[np.int64]
    index: npt.NDArray[np.int64]


def contact_loops(frame: Frame) -> ContactLoops:
    """The loops of contacts between free bodies (N.P. Kruyt & L. Rothenburg, J. Stat. Mech. (2014) P07021).

    Dead ends and bodies without contacts are left out in turn, as are contacts with fixed bodies. The loops are the
    faces of the graph whose edges are the branch vectors, in their order around each body; where branch vectors cross,
    which large overlaps or very unequal bodies can cause, faces are not cells. The outside is no loop; a periodic cell
    has none.
    """
    first, second, branch = _chains(frame)
    m = len(first)
    tail, head = np.concatenate([second, first]), np.concatenate([first, second])
    vector = np.concatenate([branch, -branch])
    # Half-edges in the order of their tails, anticlockwise around each one
    order = np.lexsort((np.arctan2(vector[:, 1], vector[:, 0]), tail))
    place = np.empty(2 * m, dtype=np.int64)
    place[order] = np.arange(2 * m)
    start = np.searchsorted(tail[order], np.arange(len(frame.id) + 1))
    opposite = np.concatenate([np.arange(m, 2 * m), np.arange(m)])
    # From the head of a half-edge the next one is that before the way back, clockwise: this keeps the face on the left.
    back = place[opposite]
    low, high = start[head], start[head + 1]
    following = order[np.where(back == low, high - 1, back - 1)]
    sides, areas, bodies = [], [], []
    seen = np.zeros(2 * m, dtype=bool)
    for edge in range(2 * m):
        if seen[edge]:
            continue
        face = []
        while not seen[edge]:
            seen[edge] = True
            face.append(edge)
            edge = following[edge]
        corner = np.cumsum(vector[face], axis=0)
        area = 0.5 * float(np.sum(corner[:-1, 0] * corner[1:, 1] - corner[:-1, 1] * corner[1:, 0]))
        if area > 0.0:
            sides.append(len(face))
            areas.append(area)
            bodies.append(tail[face])
    return ContactLoops(np.array(sides, dtype=np.int64), np.array(areas, dtype=float),
                        np.concatenate([[0], np.cumsum(sides)]).astype(np.int64),
                        np.concatenate(bodies) if bodies else np.empty(0, dtype=np.int64))


def _chains(frame: Frame) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """Indices and branch vectors of the pairs of free bodies that touch, without dead ends; each pair once."""
    contacts = frame.contacts
    pairs = np.column_stack([contacts.first_index, contacts.second_index])
    _, kept = np.unique(pairs, axis=0, return_index=True)
    kept = kept[~contacts.with_fixed[kept]]
    first, second, branch = pairs[kept, 0], pairs[kept, 1], contacts.branch[kept]
    while True:
        degree = np.bincount(np.concatenate([first, second]), minlength=len(frame.id))
        good = (degree[first] > 1) & (degree[second] > 1)
        if good.all():
            return first, second, branch
        first, second, branch = first[good], second[good], branch[good]
