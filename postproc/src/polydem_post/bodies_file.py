"""The bodies file of a scene: polygons of other programs as the bodies of a run."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any, Optional, Union

import numpy as np

from .base.convex import OutlineError, concave_vertices, decompose, insist_on_simple, tidy
from .base.new_file import NewHdf5, new_file
from .base.polygons import FloatArray, IntArray, join, thicknesses
from .base.result_file import ResultError, reading_any
from .outlines import PROPERTIES, Outline, read_outlines, shapely_outlines
from .tracing import FORMAT_OF_SUFFIX, Traced, Tracing, trace

#: What becomes the origin of a bodies file: a point (x, y) [m], the centre of the polygons, or nothing
Origin = Optional[Union[str, tuple[float, float]]]
#: Columns with several numbers per body
WIDE = {"velocity": 2}
#: Which numbers a column may have, beside being finite, and how messages say it
RANGES: dict[str, Callable[[Any], Any]] = {
    "fixed": lambda x: x in (0.0, 1.0), "id": lambda x: 0.0 <= x < 2.0**31 and x.is_integer(),
    "density": lambda x: x > 0.0, "mass": lambda x: x >= 0.0, "inertia": lambda x: x >= 0.0}
MEANINGS = {"fixed": "true or false", "id": "a whole number from 0 to 2147483647", "density": "a number above 0",
            "mass": "a number not below 0", "inertia": "a number not below 0"}
#: What stands in the file for an infinite value of a fixed body. Its mass is infinite unless it is given, whatever its
#: density.
INFINITE = {"mass": 0.0, "inertia": 0.0, "density": 2500.0}

#: How names of bodies files end
SUFFIXES = (".h5", ".hdf5")
#: Sizes of bodies that are imported [m]
SMALLEST, GREATEST = 1e-9, 1e6
#: Pieces of most grains above which a picture is rough
MANY_PIECES = 10


def import_bodies(path: str | os.PathLike[str], output: str | os.PathLike[str], *, form: str = "",
                  scale: float | None = None, fixed: Iterable[int] = (), decomposed: bool = False,
                  overwrite: bool = False, origin: Origin = None, tracing: Tracing | None = None,
                  say: Callable[[str], None] | None = None) -> int:
    """Make a bodies file of the polygons of a file (WKT, GeoJSON, plain text); return the number of bodies.

    Pictures and drawings (DXF, SVG) are traced with the choices of `tracing`, and `say` gets sentences on what
    was found and what errors the simplification made. Grains of pictures are decomposed in any case.

    Coordinates are multiplied by `scale` to give metres (default: 1), then `origin` is subtracted as in
    `write_bodies`. `fixed` are numbers of outlines in the file, from 1. A concave outline is an error, or with
    `decomposed` becomes a body of several convex pieces. `form` is wkt, geojson, text, picture, dxf or svg, if the name
    of the file does not say it.
    """
    source = Path(path)
    if Path(output).exists() and Path(output).samefile(source):
        raise ResultError(f"{output}: is the file that is imported; choose another name")
    _insist_on_place(Path(output))
    form = form or FORMAT_OF_SUFFIX.get(source.suffix.lower(), "")
    options: dict[str, Any] = {"fixed": fixed, "overwrite": overwrite, "origin": origin}
    if form in FORMAT_OF_SUFFIX.values():
        found = trace(source, tracing or Tracing(), scale, form)
        return _write_traced(found, output, scale, say, decomposed=decomposed or form == "picture", **options)
    outlines = read_outlines(source, form)
    (tracing or Tracing()).insist_on(path, (), "polygons")
    _insist_on_size(outlines, scale)
    return write_bodies(outlines, output, scale=1.0 if scale is None else scale, decomposed=decomposed, **options)


def import_array(values: Any, output: str | os.PathLike[str], *, scale: float | None = None,
                 tracing: Tracing | None = None, say: Callable[[str], None] | None = None, **options: Any) -> int:
    """Make a bodies file of a labelled picture, an array of integers (rows, columns), as `import_bodies` of a file.

    0 is no grain. With a threshold among the choices of `tracing` the array has grey values. The last row is the
    lower edge, y = 0. The other options are `fixed`, `overwrite` and `origin`.
    """
    _insist_on_place(Path(output))
    found = trace(np.asarray(values), tracing or Tracing(), scale)
    return _write_traced(found, output, scale, say, decomposed=True, **options)


def _write_traced(found: Traced, output: str | os.PathLike[str], scale: float | None,
                  say: Callable[[str], None] | None, **options: Any) -> int:
    """Write what was traced, and say how."""
    _insist_on_size(found.outlines, scale)
    count = write_bodies(found.outlines, output, scale=1.0 if scale is None else scale, **options)
    body, thickness = _thicknesses(output)
    pieces = np.bincount(body)
    names = [outline.place.rpartition(": ")[2] for outline in found.outlines]
    for sentence in found.said if say else []:
        say(sentence)  # type: ignore[misc]
    if say:
        most = f", at most {pieces.max()} of a body ({names[int(np.argmax(pieces))]})" if pieces.max() > 1 else ""
        say(f"pieces: {len(body)}{most}; thickness of the thinnest: {thickness.min():.3g} m "
            f"({names[body[np.argmin(thickness)]]}), which the time step follows; of the 10 % thinnest at most "
            f"{np.quantile(thickness, 0.1):.3g} m")
    if np.median(pieces) > MANY_PIECES:
        warnings.warn(f"{len(body)} pieces for {count} bodies, so outlines are rough: smooth a grey picture more "
                      "(--smooth), or take a greater --tolerance, or --convex", stacklevel=3)
    return count


def _insist_on_place(path: Path) -> None:
    """Refuse a name for a bodies file that cannot be written, before the work."""
    if path.suffix.lower() not in SUFFIXES:
        raise ResultError(f"{path}: cannot be written: the name must end with {' or '.join(SUFFIXES)}")
    if not path.parent.is_dir():
        raise ResultError(f"{path}: cannot be written (there is no folder {path.parent})")


def _insist_on_size(outlines: list[Outline], scale: float | None) -> None:
    """Refuse bodies of sizes that no scale in metres gives."""
    factor = 1.0 if scale is None else scale
    for outline in outlines if np.isfinite(factor) and factor > 0.0 else []:
        if not (outline.points.ndim == 2 and np.isfinite(outline.points).all()):
            continue
        size = factor * float(np.ptp(outline.points, axis=0).max())
        if size > 0.0 and not SMALLEST <= size <= GREATEST:
            raise ResultError(f"{outline.place}: would be {size:.3g} m across with --scale {factor:g}; bodies have "
                              f"{SMALLEST:g} to {GREATEST:g} m")


def import_shapely(geometries: Any, output: str | os.PathLike[str], **options: Any) -> int:
    """Make a bodies file of polygons of shapely, one or several; options as for `import_bodies`."""
    return write_bodies(shapely_outlines(geometries), output, **options)


def write_bodies(outlines: Iterable[Outline | Any], output: str | os.PathLike[str], *, scale: float = 1.0,
                 fixed: Iterable[int] | Iterable[bool] = (), decomposed: bool = False, overwrite: bool = False,
                 origin: Origin = None, **columns: Any) -> int:
    """Write outlines, or arrays (k, 2) of vertices [1/scale m], as a bodies file; return the number of bodies.

    `fixed` has the numbers of the outlines, from 1, that become fixed bodies, or one truth value per outline. `origin`
    is a point (x, y) [m] that becomes the origin of the bodies, or 'centre', the middle of the bounding box of all
    outlines, rounded to whole metres. The file stores it, and an export of a run adds it to the coordinates.

    The other `columns` have one value per outline, or one for all:

        velocity          [m/s]    of the centre of mass, (n, 2) or (2); 0 for fixed bodies
        angular_velocity  [rad/s]  anticlockwise; 0 for fixed bodies
        density           [kg/m3]  default: that of the namelist
        mass              [kg/m]   default, and meaning of 0: from polygon and density; infinite for fixed bodies
        inertia           [kg m]   about the centre of mass; default, and meaning of 0: from mass and polygon, likewise
        id                [1]      identifiers, all different; default: 1 to n
        material          [1]      names of groups &material of the namelist; default: that of &scene

    The mass, inertia and density of a fixed body may be infinite, as in the columns of a `Frame`.
    """
    given = [each if isinstance(each, Outline) else Outline(np.asarray(each, dtype=float), f"outline {number}")
             for number, each in enumerate(outlines, 1)]
    held = _numbers(list(fixed), len(given))
    if held - set(range(1, len(given) + 1)):
        raise ResultError(f"there is no outline {min(held - set(range(1, len(given) + 1)))}, only {len(given)}")
    if not (np.isfinite(scale) and scale > 0.0):
        raise ResultError(f"the scale is {scale}, but must be a number above 0")
    given = [replace(each, properties={**each.properties, "fixed": True}) if number in held else each
             for number, each in enumerate(given, 1)]
    given = _with_columns(given, columns)
    shift = _shift(given, scale, origin)
    path = Path(output)
    return _save(path, given, scale, shift, decomposed, None if origin is None else shift, overwrite)


def write_frame(frame: Any, output: str | os.PathLike[str], origin: tuple[float, float], overwrite: bool) -> int:
    """Write the bodies of a `Frame`; `origin` is what the coordinates lack, and is stored with them [m]."""
    given = [Outline(outline, f"body {number}") for number, outline in zip(frame.id, frame.vertices)]
    given = _with_columns(given, {
        "fixed": frame.fixed, "mass": frame.mass, "inertia": frame.inertia, "id": frame.id,
        **({"material": np.array(["", *frame.material_names])[frame.material]} if frame.material_names else {}),
        "velocity": np.where(frame.fixed[:, None], 0.0, frame.velocity),
        "angular_velocity": np.where(frame.fixed, 0.0, frame.angular_velocity)})
    return _save(Path(output), given, 1.0, np.zeros(2), False, np.array(origin) if any(origin) else None, overwrite)


def _with_columns(outlines: list[Outline], columns: dict[str, Any]) -> list[Outline]:
    """The outlines with a value of each column."""
    chosen: list[dict[str, Any]] = [dict(outline.properties) for outline in outlines]
    for name, values in columns.items():
        if name not in PROPERTIES:
            raise ResultError(f"a bodies file has no column {name}; its columns are {', '.join(PROPERTIES)}")
        shape = (len(outlines), WIDE[name]) if name in WIDE else (len(outlines),)
        array = np.asarray(values)
        if array.shape not in (shape, shape[1:]):
            raise ResultError(f"{name} has the shape {array.shape}, but must have {shape}, one value for each of "
                              f"{len(outlines)} outlines, or {shape[1:]}, one for all")
        for properties, value in zip(chosen, np.broadcast_to(array, shape).tolist()):
            properties[name] = value
    for properties in chosen:
        if properties.get("fixed"):
            properties.update({name: finite for name, finite in INFINITE.items() if properties.get(name) == np.inf})
    return [replace(outline, properties=properties) for outline, properties in zip(outlines, chosen)]


def _save(path: Path, outlines: list[Outline], scale: float, shift: FloatArray, decomposed: bool,
          origin: FloatArray | None, overwrite: bool) -> int:
    """Write outlines, or their convex pieces, with their properties; return the number of bodies."""
    polygons: list[FloatArray] = []
    numbers: list[IntArray] = []
    rows: list[dict[str, Any]] = []
    places: list[str] = []
    for outline in outlines:
        parts = _pieces(outline, scale, shift, decomposed)
        polygons.append(np.concatenate(parts))
        numbers.append(np.repeat(np.arange(len(parts)), [len(part) for part in parts]))
        rows.append(outline.properties)
        places.append(outline.place)
    if not polygons:
        raise ResultError(f"{path}: there are no bodies to write")
    columns = {name: _column(name, rows, places) for name in PROPERTIES if any(name in row for row in rows)}
    columns.setdefault("fixed", np.zeros(len(rows), dtype=np.int8))
    piece = np.concatenate(numbers)
    if piece.any():
        columns["piece"] = piece
    if path.exists() and not overwrite:
        raise ResultError(f"{path}: exists already; --force replaces it, in Python overwrite=True")
    _write(path, polygons, columns, origin)
    return len(polygons)


def _numbers(fixed: list[Any], count: int) -> set[int]:
    """Numbers of outlines, also where they are given by one truth value per outline."""
    if not any(isinstance(each, (bool, np.bool_)) for each in fixed):
        return set(fixed)
    if len(fixed) != count or not all(isinstance(each, (bool, np.bool_)) for each in fixed):
        raise ResultError(f"fixed has {len(fixed)} values, but must have one truth value for each of {count} outlines, "
                          "or numbers of outlines")
    return {number for number, each in enumerate(fixed, 1) if each}


def origin_of(path: str | os.PathLike[str]) -> tuple[float, float]:
    """The point that became the origin of a bodies file [m]; (0, 0) if none did."""
    with reading_any(Path(path)) as file:
        return float(file.attrs.get("origin_x", 0.0)), float(file.attrs.get("origin_y", 0.0))


def pieces_of(path: str | os.PathLike[str]) -> tuple[int, int, float]:
    """Number of bodies of several pieces, most pieces of a body, and thickness of the thinnest piece of them [m].

    The thickness is twice the smallest distance of an edge from the centroid.
    """
    body, thickness = _thicknesses(path)
    count = np.bincount(body)
    several = count[body] > 1
    return int((count > 1).sum()), int(count.max()), float(thickness[several].min(initial=np.inf))


def _thicknesses(path: str | os.PathLike[str]) -> tuple[IntArray, FloatArray]:
    """The body of each piece of a bodies file, from 0, and its thickness [m]."""
    with reading_any(Path(path)) as file:
        vertex, start = file["vertex"][:], file["vertex_start"][:]
        piece = file["piece"][:] if "piece" in file else np.zeros(len(vertex), dtype=np.int64)
    body = np.repeat(np.arange(len(start) - 1), np.diff(start))
    begins = np.flatnonzero(np.append(True, (np.diff(body) != 0) | (np.diff(piece) != 0)))
    return body[begins], thicknesses(vertex, np.append(begins, len(vertex)))


def _shift(outlines: list[Outline], scale: float, origin: Origin) -> FloatArray:
    """The point that becomes the origin [m], (2)."""
    if origin is None or not outlines:
        return np.zeros(2)
    if isinstance(origin, str):
        if origin != "centre":
            raise ResultError(f"the origin is '{origin}', but must be 'centre' or a point (x, y)")
        points = np.concatenate([np.asarray(outline.points, dtype=float).reshape(-1, 2) for outline in outlines])
        return np.round(0.5 * scale * (points.min(axis=0) + points.max(axis=0))) + 0.0
    point = np.asarray(origin, dtype=float)
    if point.shape != (2,) or not np.isfinite(point).all():
        raise ResultError(f"the origin is {origin}, but must be 'centre' or a point of two finite numbers")
    return point


def _pieces(outline: Outline, scale: float, shift: FloatArray, decomposed: bool) -> list[FloatArray]:
    """The convex polygons of an outline: itself, unless it is concave."""
    try:
        points = tidy(outline.points * scale - shift)
        wrong = concave_vertices(points)
        if not wrong:
            return [points]
        insist_on_simple(points)
        if not decomposed:
            x, y = (points[wrong[0]] + shift) / scale
            vertex = ", ".join(repr(float(each)).removesuffix(".0")
                               for each in (x, y if outline.down is None else outline.down - y))
            raise OutlineError(f"it is concave at the vertex ({vertex}); --decompose makes a body of "
                               "several convex pieces of it")
        return decompose(points)
    except OutlineError as error:
        raise ResultError(f"{outline.place}: the outline cannot be a body: {error}{outline.hint}") from error


def _column(name: str, rows: list[dict[str, Any]], places: list[str]) -> Any:
    """A data set of a bodies file; a body without a value has the default of the file format."""
    if name in ("id", "density"):
        for place, row in zip(places, rows):
            if name not in row:
                raise ResultError(f"{place}: has no {name}, which other polygons have")
    if name == "material":
        return _material_column(rows, places)
    width = WIDE.get(name, 1)
    values = []
    for place, row in zip(places, rows):
        try:
            value = np.array(row.get(name, np.zeros(width)), dtype=float).reshape(width)
        except (TypeError, ValueError) as error:
            wanted = f"but must be {MEANINGS[name]}, without quotes" if name in MEANINGS else f"not {width} number(s)"
            raise ResultError(f"{place}: the {name} is {row[name]!r}, {wanted}") from error
        if name in row and not (np.isfinite(value).all() and RANGES.get(name, np.isfinite)(value[0])):
            raise ResultError(f"{place}: the {name} is {row[name]!r}, but must be {MEANINGS.get(name, 'finite')}")
        values.append(value)
    column = np.array(values)
    if name == "id":
        first: dict[float, int] = {}
        for k, value in enumerate(column[:, 0]):
            if first.setdefault(value, k) != k:
                raise ResultError(f"{places[k]}: the id {int(value)} is that of {places[first[value]]}, too; each body "
                                  "needs its own")
    if name in ("fixed", "id"):
        return column[:, 0].astype(np.int8 if name == "fixed" else np.int64)
    return column if width > 1 else column[:, 0]


def _material_column(rows: list[dict[str, Any]], places: list[str]) -> list[str]:
    """Name of the material of each body; empty if it has none of its own."""
    names = []
    for place, row in zip(places, rows):
        name = row.get("material", "")
        if not isinstance(name, str) or not re.fullmatch(r"\w*", name, re.ASCII):
            raise ResultError(f"{place}: the material is {name!r}, but must be a name of letters, digits and _")
        names.append(name)
    return names


def _write(path: Path, polygons: list[FloatArray], columns: dict[str, Any], origin: FloatArray | None) -> None:
    vertex, start = join(polygons)
    with new_file(path) as part, NewHdf5(part) as file:
        file["vertex"], file["vertex_start"] = vertex, start
        materials = columns.pop("material", None)
        if materials is not None:
            names = sorted(set(materials) - {""})
            file["material"] = [names.index(name) + 1 if name else 0 for name in materials]
            file["material_names"] = " ".join(names)
        for name, values in columns.items():
            file[name] = values
        if origin is not None:
            file.attrs["origin_x"], file.attrs["origin_y"] = (float(each) for each in origin)
