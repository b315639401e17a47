"""Outlines of grains from a picture or a drawing, and what their simplification changed."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..base.optional import need
from ..base.polygons import FloatArray, area_of, join, moments
from ..outlines import Outline
from .choices import Tracing
from .contours import contours
from .drawings import read_drawing
from .labels import read_labels
from .picture_files import Picture, name_of
from .simplify import simplified, with_area

#: End of a file name -> format
FORMAT_OF_SUFFIX = {**dict.fromkeys((".png", ".tif", ".tiff", ".bmp", ".gif", ".jpg", ".jpeg", ".npy"), "picture"),
                    ".dxf": "dxf", ".svg": "svg"}
#: Tolerance unless it is chosen, over the square root of the area of a grain
TOLERANCE = 0.02
#: Errors below this are not told as numbers
LEAST_ERROR = 1e-4
#: A curve of a drawing that counts as exact, over the tolerance
FINE = 2e-3


@dataclass(frozen=True)
class Traced:
    """Outlines of a file, and sentences on how they were found."""

    outlines: list[Outline]
    said: list[str] = field(default_factory=list)


def trace(source: Picture, choices: Tracing, scale: float | None, form: str = "") -> Traced:
    """The grains of a picture (a number or a colour per grain, or grey values), or the closed lines of DXF or SVG.

    A unit of the outlines is a pixel, or the unit of the drawing; y is up. The tolerance is the greatest distance of
    an outline from that of the file, over the square root of the area of its grain. The form of a file follows from
    the end of its name unless it is given; an array is a picture.
    """
    tolerance = TOLERANCE if choices.tolerance is None else choices.tolerance
    if not isinstance(source, Path):
        return _of_picture(source, choices, tolerance, scale)
    form = form or FORMAT_OF_SUFFIX[source.suffix.lower()]
    return (_of_picture if form == "picture" else partial(_of_drawing, form=form))(source, choices, tolerance, scale)


def _of_drawing(path: Path, choices: Tracing, tolerance: float, scale: float | None, form: str) -> Traced:
    choices.insist_on(path, ("tolerance",), "drawings")
    drawing = read_drawing(path, form)
    # One distance for all, so that lines that neighbours share remain the same
    distance = tolerance * float(np.sqrt(min(_area(line(1e-3 * _size(line))) for line in drawing.lines)))
    exact = [line(FINE * distance)[:-1] for line in drawing.lines]
    lines = _with_areas([line(distance)[:-1] for line in drawing.lines], exact, distance)
    names = [f"body {k}, {place.removeprefix(f'{path}: ')}" for k, place in enumerate(drawing.places, 1)]
    said = [f"closed lines: {len(lines)}", *drawing.said, _said_of_scale("metres per unit", "m per unit", scale),
            *_errors(exact, lines, scale, names, "bodies")]
    return Traced([Outline(line, place, down=drawing.bottom) for line, place in zip(lines, drawing.places)], said)


def _with_areas(lines: list[FloatArray], exact: list[FloatArray], distance: float) -> list[FloatArray]:
    """Lines that are far from all others, scaled to their exact areas; chords of a circle lose some."""
    shapely = need("shapely", "pictures", "the import of drawings")
    polygons = np.array([shapely.Polygon(_left(line)) for line in exact], dtype=object)
    one, two = shapely.STRtree(polygons).query(polygons, predicate="dwithin", distance=2.0 * distance)
    near = set(one[one != two].tolist())
    return [line if k in near else with_area(shapely, _left(line), _left(whole), distance)
            for k, (line, whole) in enumerate(zip(lines, exact))]


def _of_picture(source: Picture, choices: Tracing, tolerance: float, scale: float | None) -> Traced:
    choices.insist_on(name_of(source), tuple(vars(choices)), "pictures")
    labels = read_labels(source, choices)
    numbers, exact = contours(labels)
    size = np.sqrt([_area(each) for each in exact])
    lines, hulls = simplified(numbers, exact, tolerance * size, bool(choices.convex))
    across = float(np.median(size))
    said = [f"grains: {len(lines)}, of {across:.0f} pixels = {across * (scale or 1.0):.3g} m across (root of the area, "
            "median)", *labels.said, "origin: lower left corner of the picture, y up; "
            + _said_of_scale("metres per pixel", "m per pixel", scale)]
    middle = [each.mean(axis=0) for each in exact]
    names = [f"grain {k} at pixel ({x:.0f}, {y:.0f})" for k, (x, y) in enumerate(middle, 1)]
    if choices.convex:
        said.append(_said_of_hulls(exact, lines, hulls, names))
    said += _errors(exact, lines, scale, names, "grains")
    if labels.level is None and tolerance * across < 1.0:
        said.append(f"--tolerance {tolerance:g} is less than a pixel for most grains: steps of pixels stay as corners")
    return Traced([Outline(line, f"{name_of(source)}: {name} from the lower left")
                   for line, name in zip(lines, names)], said)


def _said_of_scale(words: str, unit: str, scale: float | None) -> str:
    """The scale, and whether it was chosen."""
    return f"the scale is 1 {unit}, because --scale is not given" if scale is None else f"{words}: {scale:g} (--scale)"


def _said_of_hulls(exact: list[FloatArray], lines: list[FloatArray], hulls: list[bool], names: list[str]) -> str:
    """How many grains became their convex hulls, and what that added to their area."""
    before = np.array([_area(each) for each, hull in zip(exact, hulls) if hull])
    more = np.array([_area(each) for each, hull in zip(lines, hulls) if hull]) - before
    if not before.size:
        return "convex hulls: none, since each would overlap another grain"
    worst = int(np.argmax(more / before))
    name = [name for name, hull in zip(names, hulls) if hull][worst]
    rest = "" if all(hulls) else f"; {hulls.count(False)} others keep their outlines, since their hulls would overlap"
    return (f"convex hulls: {len(before)} of {len(hulls)} grains, which adds {_percent(more.sum() / before.sum())} to "
            f"their area (greatest {_percent(more[worst] / before[worst])}, {name}){rest}")


def _errors(exact: list[FloatArray], lines: list[FloatArray], scale: float | None, names: list[str],
            kind: str) -> list[str]:
    """Corners, and errors of area, moment of inertia and distance, of simplified outlines."""
    shapely = need("shapely", "pictures", "the import of pictures and drawings")
    (area, _, second), (area_now, _, second_now) = (moments(*join([_left(each) for each in some]))
                                                    for some in (exact, lines))
    distance = np.array([shapely.hausdorff_distance(shapely.LinearRing(one), shapely.LinearRing(other))
                         for one, other in zip(exact, lines)])
    corners = [[len(each) for each in some] for some in (exact, lines)]
    errors = {"area": np.abs(area_now / area - 1.0), "moment of inertia": np.abs(second_now / second - 1.0),
              "distance over the root of the area": distance / np.sqrt(area)}
    total = _percent(area_now.sum() / area.sum() - 1.0, "+")
    words = [f"{name} {_percent(np.median(each))} (greatest {_percent(each.max())}{_of_worst(each, names)})"
             for name, each in errors.items()]
    return [f"corners per grain, median: {np.median(corners[1]):.0f}, before: {np.median(corners[0]):.0f}",
            f"errors by the simplification alone, medians: {', '.join(words)}; greatest distance: "
            f"{distance.max() * (scale or 1.0):.3g} m",
            f"total area of all {kind}, changed by the simplification: {total}"]


def _of_worst(errors: FloatArray, names: list[str]) -> str:
    """Which body has the greatest error, if that can be seen."""
    return f", {names[int(np.argmax(errors))]}" if errors.max() >= LEAST_ERROR else ""


def _percent(value: Any, sign: str = "") -> str:
    share = float(value)
    return f"{100.0 * share:{sign}.2g} %" if abs(share) >= LEAST_ERROR else f"less than {100.0 * LEAST_ERROR:g} %"


def _left(outline: FloatArray) -> FloatArray:
    """An outline anticlockwise."""
    return outline if area_of(outline) > 0.0 else outline[::-1]


def _area(outline: FloatArray) -> float:
    return abs(area_of(outline))


def _size(line: Any) -> float:
    """Size of a line from a crude flattening."""
    return float(np.ptp(line(float("inf")), axis=0).max())
