"""XDMF: an XML file that describes the arrays of an HDF5 file beside it, with time steps.

The topology of bodies is `Mixed`, in which each polygon has the number 3, the number of its points and these points.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
import numpy.typing as npt

from ..base.new_file import NewHdf5
from .meshes import Mesh

#: Number of polygons in a mixed topology
POLYGON = 3

#: Bytes up to which an array is not deflated: the index of its chunks would be larger than what is gained
LEAST_PACKED = 4096


class XdmfFile:
    """An XDMF file and the HDF5 file with its arrays, to which meshes are added step by step."""

    def __init__(self, path: Path, data: Path, data_name: str):
        self._path, self._data_name = path, data_name
        self._file = NewHdf5(data)
        self._grids: list[str] = []
        #: Array -> its last values, and where they are
        self._last: dict[str, tuple[npt.NDArray[Any], str]] = {}

    def add(self, time: float, mesh: Mesh) -> None:
        """Add a time step; what is as in the step before is not written again."""
        number = len(self._grids)
        if mesh.kind == "Polygons":
            head = f'<Topology TopologyType="Mixed" NumberOfElements="{len(mesh)}">'
            topology = _mixed(mesh)
        else:
            head = f'<Topology TopologyType="Polyline" NodesPerElement="2" NumberOfElements="{len(mesh)}">'
            topology = mesh.connectivity.reshape(-1, 2)
        lines = [f'<Grid Name="step {number}" GridType="Uniform">', f'<Time Value="{time!r}"/>',
                 head, self._item("topology", number, topology), "</Topology>",
                 '<Geometry GeometryType="XYZ">', self._item("points", number, mesh.points), "</Geometry>"]
        for name, values in mesh.data.items():
            kind = "Vector" if values.ndim == 2 else "Scalar"
            lines += [f'<Attribute Name="{name}" AttributeType="{kind}" Center="Cell">',
                      self._item(name, number, values), "</Attribute>"]
        self._grids.append("\n".join([*lines, "</Grid>"]))
        self._file.check()

    def _item(self, name: str, number: int, values: npt.NDArray[Any]) -> str:
        if name not in self._last or not np.array_equal(self._last[name][0], values):
            place = f"{name}/{number}"
            packing = {"compression": "gzip", "compression_opts": 1} if values.nbytes > LEAST_PACKED else {}
            self._file.create_dataset(place, data=values, **packing)
            self._last[name] = (values, place)
        place = self._last[name][1]
        kind, size = ("Float", 8) if values.dtype.kind == "f" else ("Int", values.dtype.itemsize)
        shape = " ".join(map(str, values.shape))
        return (f'<DataItem Format="HDF" NumberType="{kind}" Precision="{size}" Dimensions="{shape}">'
                f"{escape(self._data_name)}:/{place}</DataItem>")

    def close(self) -> None:
        """Write the description of the arrays."""
        self._file.close()
        lines = ['<?xml version="1.0"?>', '<Xdmf Version="3.0">', "<Domain>",
                 '<Grid Name="time" GridType="Collection" CollectionType="Temporal">', *self._grids, "</Grid>",
                 "</Domain>", "</Xdmf>", ""]
        self._path.write_text("\n".join(lines), encoding="utf-8")


def _mixed(mesh: Mesh) -> npt.NDArray[Any]:
    """Kind, number of points and points of each polygon in turn."""
    count = np.diff(mesh.offsets)
    head = np.column_stack([np.full(len(mesh), POLYGON), count])
    return np.insert(mesh.connectivity, np.repeat(mesh.offsets[:-1], 2), head.ravel())
