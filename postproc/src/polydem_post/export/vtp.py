"""VTP: one XML file of poly data per frame, and a PVD file that lists them with their times.

Numbers are inline, in base64 and not compressed, since some readers take no others.
"""

from __future__ import annotations

import base64
import re
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
import numpy.typing as npt

from .meshes import Mesh

#: Names of numpy types in VTK files
TYPES = {"int32": "Int32", "int64": "Int64", "float64": "Float64"}


#: Names of the files of frames
VTP_NAME = re.compile(r"(bodies|contacts)_\d{5,}\.vtp")


class VtpFiles:
    """A PVD file and a folder of VTP files beside it, to which meshes are added step by step."""

    def __init__(self, path: Path, folder: Path, folder_name: str, name: str):
        self._path, self._folder, self._folder_name, self._name = path, folder, folder_name, name
        self._rows: list[str] = []

    def add(self, time: float, mesh: Mesh) -> None:
        """Write the file of a time step."""
        name = f"{self._name}_{len(self._rows):05d}.vtp"
        (self._folder / name).write_text(vtp_text(mesh), encoding="ascii")
        place = quoteattr(f"{self._folder_name}/{name}")
        self._rows.append(f'    <DataSet timestep="{time!r}" part="0" file={place}/>')

    def close(self) -> None:
        """Write the list of files."""
        lines = ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">',
                 "  <Collection>", *self._rows, "  </Collection>", "</VTKFile>", ""]
        self._path.write_text("\n".join(lines), encoding="utf-8")


def vtp_text(mesh: Mesh) -> str:
    """The file of one mesh."""
    group = {"Polygons": "Polys", "Lines": "Lines"}[mesh.kind]
    counts = " ".join(f'NumberOf{kind}="{len(mesh) if kind == group else 0}"'
                      for kind in ("Verts", "Lines", "Strips", "Polys"))
    cells = {"connectivity": mesh.connectivity, "offsets": mesh.offsets[1:]}
    lines = ['<?xml version="1.0"?>',
             '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">', "<PolyData>",
             f'<Piece NumberOfPoints="{len(mesh.points)}" {counts}>',
             "<Points>", _array("Points", mesh.points), "</Points>",
             f"<{group}>", *(_array(name, values) for name, values in cells.items()), f"</{group}>",
             "<CellData>", *(_array(name, values) for name, values in mesh.data.items()), "</CellData>",
             "</Piece>", "</PolyData>", "</VTKFile>", ""]
    return "\n".join(lines)


def _array(name: str, values: npt.NDArray[Any]) -> str:
    data = np.ascontiguousarray(values).astype(values.dtype.newbyteorder("<"), copy=False).tobytes()
    text = base64.b64encode(len(data).to_bytes(8, "little") + data).decode("ascii")
    components = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
    return (f'<DataArray type="{TYPES[values.dtype.name]}" Name="{name}"{components} format="binary">{text}'
            "</DataArray>")
