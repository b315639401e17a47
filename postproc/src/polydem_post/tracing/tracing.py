"""Outlines of grains from a picture or a drawing, and what their simplification changed."""

from __future__ import annotations

from dataclasses import dataclass, field
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
from .simplify import simplified

#: End of a file name -> format
FORMAT_OF_SUFFIX = {**dict.fromkeys((".png", ".tif", ".tiff", ".bmp", ".gif", ".jpg", ".jpeg"), "picture"),
                    ".dxf": "dxf", ".svg": "svg"}
#: Tolerance unless it is chosen, over the square root of the area of a grain
TOLERANCE = 0.02
#: A curve of a drawing that counts as exact, over the tolerance
FINE = 0.02


@dataclass(frozen=True)
class Traced:
    """Outlines of a file, and sentences on how they were found."""

    outlines: list[Outline]
    said: list[str] = field(default_factory=list)


def trace(path: Path, choices: Tracing, scale: float) -> Traced:
    """The grains of a picture (a number or a colour per grain, or grey values), or the closed lines of DXF or SVG.

    A unit of the outlines is a pixel, or the unit of the drawing; y is up. The tolerance is the greatest distance of
    an outline from that of the file, over the square root of the area of its grain.
    """
    tolerance = TOLERANCE if choices.tolerance is None else choices.tolerance
    if FORMAT_OF_SUFFIX[path.suffix.lower()] == "picture":
        return _of_picture(path, choices, tolerance, scale)
    choices.insist_on(path, ("tolerance",), "drawings")
    drawing = read_drawing(path)
    # One distance for all, so that lines that neighbours share remain the same
    distance = tolerance * float(np.sqrt(min(_area(line(1e-3 * _size(line))) for line in drawing.lines)))
    lines = [line(distance)[:-1] for line in drawing.lines]
    exact = [line(FINE * distance)[:-1] for line in drawing.lines]
    said = [f"closed lines: {len(lines)}", *drawing.said, f"metres per unit: {scale:g} (--scale)",
            *_errors(exact, lines, scale)]
    return Traced([Outline(line, place) for line, place in zip(lines, drawing.places)], said)


def _of_picture(path: Path, choices: Tracing, tolerance: float, scale: float) -> Traced:
    choices.insist_on(path, tuple(vars(choices)), "pictures")
    labels = read_labels(path, choices)
    numbers, exact = contours(labels)
    size = np.sqrt([_area(each) for each in exact])
    lines = simplified(numbers, exact, tolerance * size)
    said = [f"grains: {len(lines)}, of {np.median(size):.0f} pixels across (root of the area, median)", *labels.said,
            f"origin: lower left corner of the picture, y up; metres per pixel: {scale:g} (--scale)",
            *_errors(exact, lines, scale)]
    if tolerance * np.median(size) < 1.0:
        said.append(f"--tolerance {tolerance:g} is less than a pixel for most grains: steps of pixels stay as corners")
    return Traced([Outline(line, f"{path}: grain {k} at pixel ({x:.0f}, {y:.0f}) from the lower left")
                   for k, (line, (x, y)) in enumerate(zip(lines, (each.mean(axis=0) for each in exact)), 1)], said)


def _errors(exact: list[FloatArray], lines: list[FloatArray], scale: float) -> list[str]:
    """Corners, and errors of area, moment of inertia and distance, of simplified outlines."""
    shapely = need("shapely", "pictures", "the import of pictures and drawings")
    (area, _, second), (area_now, _, second_now) = (moments(*join([_left(each) for each in some]))
                                                    for some in (exact, lines))
    distance = np.array([shapely.hausdorff_distance(shapely.LinearRing(one), shapely.LinearRing(other))
                         for one, other in zip(exact, lines)])
    corners = [[len(each) for each in some] for some in (exact, lines)]
    errors = {"area": area_now / area - 1.0, "moment of inertia": second_now / second - 1.0,
              "distance over the root of the area": distance / np.sqrt(area)}
    words = [f"{name} {_percent(np.median(np.abs(each)))} (greatest {_percent(np.abs(each).max())})"
             for name, each in errors.items()]
    return [f"corners per grain, median: {np.median(corners[1]):.0f}, before: {np.median(corners[0]):.0f}",
            f"errors by this, medians: {', '.join(words)}; greatest distance: {distance.max() * scale:.3g} m; all "
            f"grains have {area_now.sum() / area.sum() - 1.0:+.2%} of area"]


def _percent(value: Any) -> str:
    return f"{100.0 * float(value):.2g} %"


def _left(outline: FloatArray) -> FloatArray:
    """An outline anticlockwise."""
    return outline if area_of(outline) > 0.0 else outline[::-1]


def _area(outline: FloatArray) -> float:
    return abs(area_of(outline))


def _size(line: Any) -> float:
    """Size of a line from a crude flattening."""
    return float(np.ptp(line(float("inf")), axis=0).max())
