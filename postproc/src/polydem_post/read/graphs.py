"""Frames as graphs of networkx and systems of freud, which are optional packages.

Frames import this module, so their type is not named here.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..base.optional import need
from .tables import CONTACT_COLUMNS

#: Columns of a node, and of an edge
NODE_COLUMNS = ("position", "angle", "velocity", "angular_velocity", "mass", "fixed")
EDGE_COLUMNS = tuple(name for name in CONTACT_COLUMNS if name not in ("first", "second", "first_index", "second_index"))


def contact_graph(frame: Any) -> Any:
    """The bodies as nodes, named by their identifiers, and the contacts as edges of a `networkx.MultiGraph`."""
    graph = need("networkx", "graphs", "to_networkx()").MultiGraph(time=frame.time, step=frame.step)
    columns = {name: getattr(frame, name) for name in NODE_COLUMNS}
    for k, body in enumerate(frame.id):
        graph.add_node(int(body), **{name: values[k] for name, values in columns.items()})
    contacts = frame.contacts
    columns = {name: getattr(contacts, name) for name in EDGE_COLUMNS}
    for k, (first, second) in enumerate(zip(contacts.first, contacts.second)):
        graph.add_edge(int(first), int(second), **{name: values[k] for name, values in columns.items()})
    return graph


def freud_system(frame: Any) -> Any:
    """Box and points of the free bodies, as each method of freud takes them, and their contacts as a neighbour list.

    The box is the periodic cell, tilted by its shear. In the plane, and along an axis without period, it is three times
    as long as the bodies reach, so that no copies are near.
    """
    freud = need("freud", "freud", "to_freud()", "freud-analysis")
    free = np.flatnonzero(frame.free)
    points = frame.position[free]
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.where(frame.cell_size > 0.0, frame.cell_size, 3.0 * np.maximum(high - low, 1e-3))
    centre = np.where(frame.cell_size > 0.0, frame.cell_low + 0.5 * frame.cell_size, 0.5 * (low + high))
    tilt = frame.shift / size[1] if frame.cell_size[1] > 0.0 else 0.0
    box = freud.box.Box(Lx=size[0], Ly=size[1], xy=tilt, is2D=True)
    points = box.wrap(np.column_stack([points - centre, np.zeros(len(points))]))
    contacts = frame.contacts
    inner = ~contacts.with_fixed
    place = np.full(len(frame.id), -1)
    place[free] = np.arange(len(free))
    first, second = place[contacts.first_index[inner]], place[contacts.second_index[inner]]
    branch = np.column_stack([contacts.branch[inner], np.zeros(inner.sum())])
    # Each contact once from either side, in the order that freud wants
    query, point = np.concatenate([first, second]), np.concatenate([second, first])
    vectors = np.concatenate([-branch, branch])
    order = np.lexsort((point, query))
    n = len(free)
    neighbours = freud.locality.NeighborList.from_arrays(n, n, query[order], point[order], vectors[order])
    return (box, points), neighbours
