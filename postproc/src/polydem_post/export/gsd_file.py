"""GSD with the schema of HOOMD-blue: bodies as particles of one type each, with polygons as shapes; contacts as bonds.

Needs the package gsd. Numbers have single precision, as the schema says. The box is centred at the origin, and holds
all bodies of all frames that are written.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..base.optional import need
from ..read.frames import Frame
from ..read.trajectory import Trajectory
from .meshes import contact_data, finite, in_space


def write_gsd(run: Trajectory, path: Path, with_contacts: bool) -> None:
    """Write all frames of a trajectory."""
    hoomd = _hoomd()
    half = np.zeros(2)
    for frame in run:
        half = np.maximum(half, np.abs(frame.bounds).reshape(-1, 2).max(axis=0))
    with hoomd.open(name=str(path), mode="w") as file:
        for frame in run:
            file.append(_converted(hoomd, frame, half, with_contacts))


def _hoomd() -> Any:
    need("gsd", "gsd", "export to gsd")
    import gsd.hoomd

    return gsd.hoomd


def _converted(hoomd: Any, frame: Frame, half: Any, with_contacts: bool) -> Any:
    """A frame of HOOMD-blue."""
    converted = hoomd.Frame()
    converted.configuration.step = frame.step
    converted.configuration.dimensions = 2
    converted.configuration.box = [2.0 * half[0], 2.0 * half[1], 0, 0, 0, 0]
    bodies = converted.particles
    bodies.N = len(frame)
    bodies.types = [f"body_{identifier}" for identifier in frame.id]
    bodies.typeid = np.arange(len(frame))
    # Shapes at angle 0: the orientation turns them.
    shapes = np.split(frame.shape, frame.vertex_start[1:-1])
    bodies.type_shapes = [{"type": "Polygon", "rounding_radius": 0, "vertices": shape.tolist()} for shape in shapes]
    bodies.position = in_space(frame.position)
    nothing = np.zeros(len(frame))
    bodies.orientation = np.column_stack([np.cos(0.5 * frame.angle), nothing, nothing, np.sin(0.5 * frame.angle)])
    bodies.velocity = in_space(frame.velocity)
    bodies.mass = finite(frame.mass)
    bodies.moment_inertia = np.column_stack([nothing, nothing, finite(frame.inertia)])
    converted.log = {"time": np.array([frame.time]), "particles/id": frame.id.astype(np.int32),
                     "particles/fixed": frame.fixed.astype(np.uint8),
                     "particles/angular_velocity": frame.angular_velocity}
    if with_contacts:
        data = contact_data(frame)
        contacts = frame.contacts
        converted.bonds.N = len(contacts)
        converted.bonds.types = ["contact"]
        converted.bonds.typeid = np.zeros(len(contacts), dtype=np.uint32)
        converted.bonds.group = np.column_stack([contacts.first_index, contacts.second_index])
        for name in ("force", "normal_force", "tangential_force", "point"):
            converted.log[f"bonds/{name}"] = data[name]
    return converted
