"""Polygons in files of other programs: WKT, GeoJSON, plain text; and geometries of shapely."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from .base.polygons import FloatArray
from .base.result_file import ResultError, cannot_read, insist_on_file

#: Properties of a body that GeoJSON may give, besides its outline
PROPERTIES = ("fixed", "velocity", "angular_velocity", "density", "mass", "inertia", "id", "material")

#: Files that are no polygons, by the end of their name: what they are, and what makes polygons of them
_DRAWING = "a drawing; convert it to WKT or GeoJSON (ogr2ogr, QGIS)"
_PICTURE = "a picture in a page; save it as PNG, which import traces"
_TRACED = "to be traced; give it to the verb import or to import_bodies"
_SOLID = "a body in space; cut it, and write the vertices of the cut as text"
OTHER_FORMATS = {**dict.fromkeys((".dwg", ".shp", ".kml", ".gpkg"), _DRAWING), ".pdf": _PICTURE,
                 **dict.fromkeys((".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".gif", ".dxf", ".svg"), _TRACED),
                 **dict.fromkeys((".stl", ".obj", ".ply", ".step", ".stp", ".iges"), _SOLID)}

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_RING = re.compile(r"\(([^()]*)\)")


@dataclass(frozen=True)
class Outline:
    """An outline as it is in a file: any order of vertices, perhaps closed, perhaps concave."""

    points: FloatArray
    #: Where it is: file and line, or number of the feature
    place: str
    #: Values of PROPERTIES that the file gives
    properties: dict[str, Any] = field(default_factory=dict)
    #: What a message adds if the outline cannot be a body
    hint: str = ""
    #: The y of the file that became 0, if y points down there; None: points are those of the file
    down: float | None = None


def read_outlines(path: Path, form: str = "") -> list[Outline]:
    """All outlines of a file; the format follows from the end of its name unless it is given."""
    form = form or FORMAT_OF_SUFFIX.get(path.suffix.lower(), "")
    if not form and path.suffix.lower() in OTHER_FORMATS:
        raise ResultError(f"{path}: import reads polygons, {', '.join(READERS)}, but this is "
                          f"{OTHER_FORMATS[path.suffix.lower()]}")
    if form not in READERS:
        raise ResultError(f"{path}: its name does not say the format; give --from {', '.join(READERS)}, picture, dxf "
                          "or svg")
    try:
        insist_on_file(path)
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise cannot_read(path, error) from error
    outlines = list(READERS[form](text, str(path)))
    if not outlines:
        raise ResultError(f"{path}: holds no polygons")
    return outlines


def shapely_outlines(geometries: Any) -> list[Outline]:
    """Outlines of polygons and multipolygons of shapely, one geometry or several."""
    several = geometries if isinstance(geometries, Iterable) else [geometries]
    return [outline for k, geometry in enumerate(several, 1) for outline in _of_shapely(geometry, f"geometry {k}")]


def _of_shapely(geometry: Any, place: str) -> Iterator[Outline]:
    if geometry.geom_type in ("MultiPolygon", "GeometryCollection"):
        for part in geometry.geoms:
            yield from _of_shapely(part, place)
    elif geometry.geom_type == "Polygon":
        rings = [np.asarray(ring.coords, dtype=float) for ring in (geometry.exterior, *geometry.interiors)]
        yield _from_rings(rings, place)
    else:
        raise ResultError(f"{place}: is a {geometry.geom_type}, not a polygon")


def _from_rings(rings: list[Any], place: str, properties: dict[str, Any] | None = None, hint: str = "") -> Outline:
    """The outline of a polygon; the last point of a ring repeats the first one."""
    if len(rings) != 1:
        holes = "a hole" if len(rings) == 2 else f"{len(rings) - 1} holes"
        raise ResultError(f"{place}: the polygon has {holes}, but a body has none" if rings
                          else f"{place}: the polygon is empty")
    try:
        points = np.array([point[:2] for point in rings[0]], dtype=float)
        if points.ndim != 2 or points.shape[1] != 2:
            raise ValueError
    except (TypeError, ValueError, IndexError) as error:
        raise ResultError(f"{place}: the vertices are not pairs of numbers") from error
    return Outline(points[:-1] if len(points) > 1 and (points[0] == points[-1]).all() else points, place,
                   properties or {}, hint)


def _read_wkt(text: str, name: str) -> Iterator[Outline]:
    """One geometry per line; empty lines and lines that begin with # are comments."""
    for number, line in enumerate(text.splitlines(), 1):
        place = f"{name}:{number}"
        words = re.sub(r"^SRID=\d+;", "", line.strip(), flags=re.IGNORECASE)
        if not words or words.startswith("#"):
            continue
        if words.count("(") != words.count(")"):
            raise ResultError(f"{place}: the brackets of the geometry do not match; a geometry must stand on one line")
        kind = re.match(r"(MULTIPOLYGON|POLYGON)\s*(?:ZM|Z|M)?\s*(\(.*\)|EMPTY)$", words, re.IGNORECASE)
        if not kind:
            raise ResultError(f"{place}: is not a POLYGON or MULTIPOLYGON of WKT: {words[:60]!r}")
        if kind[2].upper() == "EMPTY":
            raise ResultError(f"{place}: the polygon is empty; remove this line")
        inner = kind[2][1:-1].strip()
        groups = _groups(inner, place) if kind[1].upper() == "MULTIPOLYGON" else [inner]
        for group in groups:
            rings = []
            for ring in _RING.findall(group):
                points = [point.split() for point in ring.split(",")]
                if not all(len(point) >= 2 and all(re.fullmatch(_NUMBER, each) for each in point) for point in points):
                    raise ResultError(f"{place}: a vertex is not a pair of numbers: ({ring[:60]})")
                rings.append([[float(each) for each in point] for point in points])
            if re.sub(r"[\s,]", "", _RING.sub("", group)) or not rings:
                example = "((x y, ...))" if kind[1].upper() == "POLYGON" else "(((x y, ...)))"
                raise ResultError(f"{place}: a bracket pair is {'too many' if rings else 'missing'}: {kind[1].upper()} "
                                  f"{example} was expected")
            yield _from_rings(rings, place)


def _groups(text: str, place: str) -> list[str]:
    """What stands in the outer brackets of a text."""
    found, depth, begin = [], 0, 0
    for k, sign in enumerate(text):
        if sign == "(":
            begin = k + 1 if depth == 0 else begin
            depth += 1
        elif sign == ")":
            depth -= 1
            if depth == 0:
                found.append(text[begin:k])
    if depth != 0:
        raise ResultError(f"{place}: the brackets of the geometry do not match")
    return found


def _read_geojson(text: str, name: str) -> Iterator[Outline]:
    """Polygons and multipolygons; of the properties of a feature those of PROPERTIES. Coordinates are metres."""
    try:
        # Python refuses integers of thousands of digits, and cannot convert those of hundreds.
        content = json.loads(text, parse_int=lambda digits: int(digits) if len(digits) < 300 else float(digits))
    except json.JSONDecodeError as error:
        raise ResultError(f"{name}:{error.lineno}: is not JSON ({error.msg})") from error
    except RecursionError as error:
        raise ResultError(f"{name}: its lists are nested too deeply for GeoJSON") from error
    features = content.get("features", []) if isinstance(content, dict) and "features" in content else [content]
    if not isinstance(features, list):
        raise ResultError(f"{name}: its features are no list")
    for number, feature in enumerate(features, 1):
        place = f"{name}: feature {number}" if len(features) > 1 else name
        if not isinstance(feature, dict):
            raise ResultError(f"{place}: is not an object of GeoJSON")
        is_feature = feature.get("type") == "Feature"
        properties = (feature.get("properties") or {}) if is_feature else {}
        if not isinstance(properties, dict):
            raise ResultError(f"{place}: its properties are no object of GeoJSON")
        chosen = {key: properties[key] for key in PROPERTIES if properties.get(key) is not None}
        yield from _of_geojson(feature.get("geometry") if is_feature else feature, place, chosen)


def _of_geojson(geometry: Any, place: str, properties: dict[str, Any]) -> Iterator[Outline]:
    kind = geometry.get("type") if isinstance(geometry, dict) else None
    if kind == "GeometryCollection":
        for part in geometry.get("geometries") or []:
            yield from _of_geojson(part, place, properties)
    elif kind in ("Polygon", "MultiPolygon"):
        coordinates = geometry.get("coordinates")
        polygons = [coordinates] if kind == "Polygon" else coordinates
        if not isinstance(polygons, list) or not all(isinstance(rings, list) for rings in polygons):
            raise ResultError(f"{place}: the polygon has no lists of coordinates")
        found, wanted = _levels(coordinates), 3 if kind == "Polygon" else 4
        if found not in (0, wanted):
            raise ResultError(f"{place}: the coordinates have {found} list levels, but those of a {kind} have "
                              f"{wanted}: {'[' * wanted}x, y], ...{']' * (wanted - 1)}")
        for rings in polygons:
            yield _from_rings(rings, place, properties)
    else:
        raise ResultError(f"{place}: {f'is a {kind}' if kind else 'has no geometry'}, not a Polygon or MultiPolygon")


def _levels(coordinates: Any) -> int:
    """How many lists are around the first number; 0 if there is none."""
    levels = 0
    while isinstance(coordinates, list) and coordinates:
        coordinates = coordinates[0]
        levels += 1
    return levels if isinstance(coordinates, (int, float)) else 0


def _read_text(text: str, name: str) -> Iterator[Outline]:
    """One vertex per line, x and y; an empty line ends an outline; a line `fixed` makes its body fixed."""
    points: list[list[float]] = []
    properties: dict[str, Any] = {}
    first, hint = 0, ""
    for number, line in enumerate([*text.splitlines(), ""], 1):
        words = line.partition("#")[0].replace(",", " ").replace(";", " ").split()
        if not words and (points or properties) and not line.strip():
            yield _from_rings([points] if points else [], f"{name}:{first}", properties, hint)
            points, properties, hint = [], {}, ""
        elif not words and points and not hint:
            hint = f". The comment in line {number} does not end an outline; an empty line between outlines does"
        elif words:
            first = first if points or properties else number
            if words == ["fixed"]:
                properties["fixed"] = True
            elif len(words) == 2 and all(re.fullmatch(_NUMBER, word) for word in words):
                points.append([float(word) for word in words])
            else:
                raise ResultError(f"{name}:{number}: is neither a vertex such as '0.1 0.2' nor the word fixed: "
                                  f"{line[:60]!r}")


#: Format -> its reader
READERS: dict[str, Callable[[str, str], Iterator[Outline]]] = {
    "wkt": _read_wkt, "geojson": _read_geojson, "text": _read_text}

#: End of a file name -> format
FORMAT_OF_SUFFIX = {".wkt": "wkt", ".geojson": "geojson", ".json": "geojson", ".txt": "text", ".dat": "text",
                    ".xy": "text"}
