"""VTKHDF: poly data with time steps in one HDF5 file.

Layout: docs.vtk.org, "VTKHDF file format", version 2.0. Every step says where its rows begin in each array, so what
does not change from step to step, as the topology of bodies, is in the file once.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from ..base.new_file import NewHdf5
from .meshes import Mesh

#: Kinds of cells of poly data, in the order of the columns of offsets
KINDS = ("Vertices", "Lines", "Polygons", "Strips")

#: Bytes of a chunk of a growing data set
CHUNK = 2**16


class _Rows:
    """A growing data set. Rows wait until they fill a chunk, which is deflated once."""

    def __init__(self, group: h5py.Group, name: str, first: npt.NDArray[Any]):
        rows = max(1, CHUNK // max(1, first.dtype.itemsize * int(np.prod(first.shape[1:]))))
        self._entry = group.create_dataset(name, (0, *first.shape[1:]), first.dtype, maxshape=(None, *first.shape[1:]),
                                           chunks=(rows, *first.shape[1:]), compression="gzip", compression_opts=1)
        self._waiting: list[npt.NDArray[Any]] = []
        self._bytes = 0
        self.count = 0

    def append(self, values: npt.NDArray[Any]) -> None:
        """Add rows."""
        self._waiting.append(values)
        self._bytes += values.nbytes
        self.count += len(values)
        if self._bytes >= CHUNK:
            self.write()

    def write(self) -> None:
        """Write the rows that wait."""
        written = len(self._entry)
        self._entry.resize(self.count, axis=0)
        if self.count > written:
            self._entry[written:] = np.concatenate(self._waiting)
        self._waiting.clear()
        self._bytes = 0


class VtkhdfFile:
    """A VTKHDF file to which meshes are added step by step."""

    def __init__(self, path: Path):
        self._file = NewHdf5(path)
        self._root = self._file.create_group("VTKHDF")
        self._root.attrs["Version"] = np.array([2, 0], dtype=np.int64)
        self._root.attrs.create("Type", b"PolyData", dtype=h5py.string_dtype("ascii", 8))
        #: Array -> its last rows and where they begin
        self._last: dict[str, tuple[npt.NDArray[Any], int]] = {}
        self._rows: dict[str, _Rows] = {}
        self._steps = 0
        self._parts = 0
        self._part: tuple[int, dict[str, int]] = (0, {})

    def add(self, time: float, mesh: Mesh) -> None:
        """Add a time step."""
        part, cells = self._add_topology(mesh)
        self._append("Steps/Values", np.array([time]))
        self._append("Steps/PartOffsets", np.array([part]))
        self._append("Steps/NumberOfParts", np.array([1]))
        self._append("Steps/PointOffsets", np.array([self._reuse("Points", mesh.points)]))
        row = [[cells["cell" if kind == mesh.kind else "none"] for kind in KINDS]]
        self._append("Steps/CellOffsets", np.array(row))
        row = [[cells["connectivity" if kind == mesh.kind else "none"] for kind in KINDS]]
        self._append("Steps/ConnectivityIdOffsets", np.array(row))
        for name, values in mesh.data.items():
            self._append(f"Steps/CellDataOffsets/{name}", np.array([self._reuse(f"CellData/{name}", values)]))
        self._steps += 1
        self._file.check()

    def _add_topology(self, mesh: Mesh) -> tuple[int, dict[str, int]]:
        """Number of the part that has the topology of a mesh, and where its cells begin; a new part if none has."""
        same = [name in self._last and np.array_equal(self._last[name][0], values) for name, values in
                (("topology/points", np.array([len(mesh.points)])), ("topology/offsets", mesh.offsets),
                 ("topology/connectivity", mesh.connectivity))]
        if all(same):
            return self._part
        self._last["topology/points"] = np.array([len(mesh.points)]), 0
        self._last["topology/offsets"], self._last["topology/connectivity"] = (mesh.offsets, 0), (mesh.connectivity, 0)
        begin = {"none": 0, "cell": self._size(f"{mesh.kind}/Offsets") - self._parts,
                 "connectivity": self._size(f"{mesh.kind}/Connectivity")}
        self._append("NumberOfPoints", np.array([len(mesh.points)]))
        for kind in KINDS:
            own = kind == mesh.kind
            self._append(f"{kind}/NumberOfCells", np.array([len(mesh) if own else 0]))
            self._append(f"{kind}/NumberOfConnectivityIds", np.array([len(mesh.connectivity) if own else 0]))
            self._append(f"{kind}/Offsets", mesh.offsets if own else np.array([0]))
            self._append(f"{kind}/Connectivity", mesh.connectivity if own else np.empty(0, dtype=np.int64))
        self._part = (self._parts, begin)
        self._parts += 1
        return self._part

    def _reuse(self, name: str, values: npt.NDArray[Any]) -> int:
        """Where the rows of an array begin; they are appended unless they are those of the step before."""
        if name in self._last and np.array_equal(self._last[name][0], values):
            return self._last[name][1]
        begin = self._size(name)
        self._append(name, values)
        self._last[name] = (values, begin)
        return begin

    def _size(self, name: str) -> int:
        return self._rows[name].count if name in self._rows else 0

    def _append(self, name: str, values: npt.NDArray[Any]) -> None:
        if name not in self._rows:
            self._rows[name] = _Rows(self._root, name, values)
        self._rows[name].append(values)

    def close(self) -> None:
        """End the file."""
        for rows in self._rows.values():
            rows.write()
        if "Steps" in self._root:
            self._root["Steps"].attrs["NSteps"] = np.int64(self._steps)
        self._file.close()
