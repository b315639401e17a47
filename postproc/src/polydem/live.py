"""The present state of a simulation as a frame of `polydem_post`."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .library import Handle

#: Columns of a frame that every simulation has
COLUMNS = ("id", "position", "angle", "velocity", "angular_velocity", "vertex_start", "mass", "inertia")


def _kept(handle: Handle) -> npt.NDArray[np.bool_]:
    """Which bodies are present: those of walls that have vanished are not."""
    present = handle.array("bodies/present")
    return np.ones(handle.integer("bodies"), dtype=bool) if present is None else present.astype(bool)


class LiveSource:
    """What gives the contacts and walls of a frame as long as the simulation is at its step."""

    def __init__(self, handle: Handle):
        self._handle = handle

    def _check(self, frame: Any) -> None:
        from polydem_post import ResultError

        if self._handle.integer("step") != frame.step:
            raise ResultError(f"the simulation has gone on since step {frame.step}: ask a frame for its contacts and "
                              "walls before")

    def contacts_of(self, frame: Any) -> Any:
        """The contacts of a frame."""
        from polydem_post.read.frames import CONTACT_FIELDS, find_contacts

        self._check(frame)
        return find_contacts(frame, {name: self._handle.array(f"contacts/{name}") for name in CONTACT_FIELDS})

    def walls_of(self, frame: Any) -> Any:
        """The forces and torques on the fixed bodies of a frame."""
        from polydem_post import Walls

        self._check(frame)
        fixed = _column(self._handle, "fixed").astype(bool) & _kept(self._handle)
        return Walls(*(_column(self._handle, name)[fixed] for name in ("id", "force", "torque")))

    def driven_of(self, frame: Any) -> Any:
        """Which fixed bodies move or may move: all of them."""
        return frame.fixed

    def origin_for(self, frame: Any) -> tuple[float, float]:
        """Nothing was subtracted from coordinates."""
        return 0.0, 0.0


def _column(handle: Handle, name: str) -> npt.NDArray[Any]:
    found = handle.array(f"bodies/{name}")
    if found is None:
        raise KeyError(name)
    return found


def live_frame(handle: Handle, settings: Any, source: LiveSource) -> Any:
    """A frame of all bodies that are present."""
    from polydem_post.base.polygons import join_pieces
    from polydem_post.read.frames import Frame
    from polydem_post.read.trajectory import chosen_bodies

    cell: dict[str, Any] = {}
    columns: dict[str, Any] = {name: _column(handle, name) for name in COLUMNS}
    columns["fixed"] = _column(handle, "fixed").astype(bool)
    columns["shape"] = _column(handle, "vertex")
    piece = handle.array("bodies/piece")
    if piece is not None:
        columns["shape"], columns["vertex_start"] = join_pieces(columns["shape"], columns["vertex_start"], piece)
    for name in ("mass", "inertia"):
        columns[name] = np.where(columns[name] == 0.0, np.inf, columns[name])
    works = ("damping_work", "friction_work") if settings.output.get("body_works", False) else ()
    for name in ("material", "image", "shear_offset", *works):
        found = handle.array(f"bodies/{name}")
        if found is not None:
            columns[name] = found
    for name in ("low", "size", "shift", "jump"):
        found = handle.array(f"cell/{name}")
        if found is not None:
            cell[f"cell_{name}" if len(found) == 2 else name] = found if len(found) == 2 else float(found[0])
    names = tuple(settings.get("material", {})) if "material" in columns else ()
    kept = chosen_bodies(_kept(handle), columns)
    return Frame(step=handle.integer("step"), time=handle.real("time"), material_names=names, _source=source,
                 **kept, **cell)
