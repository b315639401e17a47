"""CSV: one table of bodies, one of contacts, one of vertices and one of the energy balance."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..read.tables import body_columns, contact_columns
from ..read.trajectory import Trajectory

#: Columns of the table of bodies
COLUMNS = ("fixed", "position", "angle", "velocity", "angular_velocity", "mass", "inertia", "area", "radius")


def write_bodies_csv(run: Trajectory, path: Path) -> None:
    """All bodies of all frames, one row each; infinite masses are `inf`."""
    _write(path, ({"time": frame.time, "step": frame.step, "id": frame.id, **body_columns(frame, COLUMNS)}
                  for frame in run))


def write_contacts_csv(run: Trajectory, path: Path) -> None:
    """All contacts of all frames, one row each."""
    _write(path, ({"time": frame.time, "step": frame.step, **contact_columns(frame.contacts)} for frame in run))


def write_vertices_csv(run: Trajectory, path: Path) -> None:
    """The polygons: vertices relative to the centres of mass at angle 0, one row each."""
    frame = run[0]
    _write(path, [{"id": np.repeat(frame.id, frame.corners), "x": frame.shape[:, 0], "y": frame.shape[:, 1]}])


def write_balance_csv(run: Trajectory, path: Path) -> None:
    """The energy balance, one row per frame."""
    _write(path, [{"time": run.times, "step": run.steps, **run.energy_balance}])


def _write(path: Path, tables: Iterable[dict[str, Any]]) -> None:
    """Tables of equal columns under one heading; numbers read back to the same bits."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        heading = True
        for table in tables:
            if heading:
                writer.writerow(table)
                heading = False
            rows = max(len(values) for values in table.values() if np.ndim(values))
            columns = [_plain(values, rows) for values in table.values()]
            writer.writerows(zip(*columns))


def _plain(values: Any, rows: int) -> list[Any]:
    """A column as numbers of Python; truth values are 0 and 1."""
    array: npt.NDArray[Any] = np.broadcast_to(values, (rows,))
    numbers: list[Any] = (array.astype(np.int8) if array.dtype.kind == "b" else array).tolist()
    return numbers
