"""Closed lines of drawings: DXF and SVG."""

from __future__ import annotations

import re
import xml.etree.ElementTree as Xml
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from ..base.optional import need
from ..base.polygons import FloatArray
from ..base.result_file import ResultError, cannot_read, insist_on_file
from .lines import Line, Lines

EXTRA = "pictures"
#: Deepest bisection of a curve: 4096 chords
DEEPEST = 12
#: Parts of SVG that are not drawn themselves
NOT_DRAWN = ("defs", "clipPath", "mask", "symbol", "pattern", "marker")


@dataclass(frozen=True)
class Drawing:
    """The closed lines of a drawing."""

    #: The points of each line for a greatest distance of the chords from its curves, y up
    lines: list[Line]
    #: Where each line is, for messages
    places: list[str]
    #: What was left out, and the units, in sentences
    said: list[str]
    #: The y of a file, where it points down, that became 0
    bottom: float | None = None


def read_drawing(path: Path, form: str) -> Drawing:
    """The closed lines of a DXF or SVG file."""
    try:
        insist_on_file(path)
        drawing = _read_dxf(path) if form == "dxf" else _read_svg(path)
    except (OSError, UnicodeDecodeError) as error:
        raise cannot_read(path, error) from error
    if not drawing.lines:
        raise ResultError(f"{path}: has no closed lines; {'; '.join(drawing.said)}")
    return drawing


def _read_dxf(path: Path) -> Drawing:
    ezdxf = need("ezdxf", EXTRA, "the import of DXF")
    need("ezdxf.path", EXTRA, "the import of DXF")
    try:
        document = ezdxf.readfile(path)
    except ezdxf.DXFError as error:
        raise ResultError(f"{path}: is not DXF that ezdxf reads ({error})") from error
    lines = Lines()
    for entity in _entities(document.modelspace()):
        kind = entity.dxftype()
        try:
            shape = ezdxf.path.make_path(entity)
        except (TypeError, ValueError):
            shape = None
        if shape is None or not len(shape):
            lines.leave(kind)
        else:
            lines.add(partial(_of_dxf, shape), kind, f"{kind} {entity.dxf.handle}")
    unit = ezdxf.units.unit_name(document.units) if document.units else "not given"
    metres = ezdxf.units.conversion_factor(document.units, ezdxf.units.M) if document.units else None
    return _drawing(path, lines, f"unit of the file: {unit}", metres)


def _entities(layout: Any) -> Iterator[Any]:
    """The entities of a layout, also those in blocks; layers make no difference."""
    for entity in layout:
        if entity.dxftype() == "INSERT":
            yield from _entities(entity.virtual_entities())
        else:
            yield entity


def _of_dxf(shape: Any, distance: float | None) -> FloatArray:
    """The points of a path of ezdxf."""
    points = shape.flattening(distance) if distance else shape.approximate(16)
    return np.array([(point.x, point.y) for point in points])


def _read_svg(path: Path) -> Drawing:
    elements = need("svgelements", EXTRA, "the import of SVG")
    try:
        root = Xml.fromstring(path.read_bytes())
    except Xml.ParseError as error:
        raise ResultError(f"{path}: is not XML ({error})") from error
    if root.tag.rpartition("}")[2] != "svg":
        raise ResultError(f"{path}: is XML, but no SVG")
    # Coordinates are those of the file, so what scales them to a screen goes.
    size = {name: root.attrib.pop(name, "") for name in ("width", "height", "viewBox")}
    top, metres = _sheet(size)
    text = StringIO(Xml.tostring(root, encoding="unicode"))
    lines = Lines()
    try:
        drawn = [each for each in elements.SVG.parse(text, reify=False).elements()
                 if getattr(each, "values", None) and each.values.get("visibility") != "hidden"]
        for each in drawn:
            if isinstance(each, (elements.Text, elements.Image)):
                lines.leave(type(each).__name__.lower())
        for number, shape in enumerate((each for each in drawn if isinstance(each, elements.Shape)), 1):
            whole = abs(elements.Path(shape))
            for segments in ([*each] for each in whole.as_subpaths()):
                kind = type(shape).__name__
                lines.add(partial(_of_svg, elements, segments, top), kind, shape.id or f"{kind} {number}")
    except (ValueError, IndexError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ResultError(f"{path}: is not SVG that svgelements reads ({error})") from error
    unit = f"size of the sheet: {size['width'] or 'not given'} for {_number_of_units(size)} units"
    return _drawing(path, lines, unit, metres, top)


def _number_of_units(size: dict[str, str]) -> str:
    words = re.split(r"[\s,]+", size["viewBox"].strip())
    return words[2] if len(words) == 4 else re.sub(r"[a-z%]+$", "", size["width"]) or "?"


def _sheet(size: dict[str, str]) -> tuple[float, float | None]:
    """The y of the lower edge of the sheet, which becomes 0, and the metres per unit if the file tells."""
    inch = 0.0254
    units = {"mm": 1e-3, "cm": 1e-2, "in": inch, "pt": inch / 72, "pc": inch / 6, "px": inch / 96}
    found = re.fullmatch(r"\s*([0-9.eE+-]+)\s*(mm|cm|in|pt|pc|px)?\s*", size["width"])
    words = re.split(r"[\s,]+", size["viewBox"].strip())
    try:
        box = [float(word) for word in words] if len(words) == 4 else None
        height = re.fullmatch(r"\s*([0-9.]+)(px)?\s*", size["height"])
        bottom = box[1] + box[3] if box else float(height[1]) if height else 0.0
        width = float(found[1]) * units.get(found[2] or "", 0.0) if found else 0.0
    except ValueError:
        return 0.0, None
    if found and not box:
        return bottom, units.get("px") if found[2] == "px" else None
    return bottom, width / box[2] if width and box and box[2] else None


def _of_svg(elements: Any, segments: list[Any], bottom: float, distance: float | None) -> FloatArray:
    """The points of a part of a path of svgelements."""
    points: list[tuple[float, float]] = []
    for segment in segments:
        if segment.end is None:
            continue
        if isinstance(segment, (elements.Move, elements.Line, elements.Close)):
            points.append((segment.end.x, segment.end.y))
        else:
            points += _curve(segment, distance)
    return np.array([(x, bottom - y) for x, y in points]).reshape(-1, 2)


def _curve(segment: Any, distance: float | None) -> list[tuple[float, float]]:
    """Points of a curve after its begin, from equal steps of its parameter."""
    for level in range(2, DEEPEST + 1):
        point = [(each.x, each.y) for each in (segment.point(k / 2**level) for k in range(2**level + 1))]
        place = np.array(point)
        # Odd points against the chords of the even ones
        sagitta = np.hypot(*(place[1::2] - 0.5 * (place[:-2:2] + place[2::2])).T).max()
        if distance is None:
            return point[1:]
        if sagitta <= distance:
            return point[2::2]
    return point[1:]


def _drawing(path: Path, lines: Lines, unit: str, metres: float | None, bottom: float | None = None) -> Drawing:
    """The closed lines, with those that separate lines make, and what is to be said of them."""
    count, kinds = lines.join()
    said = [f"{unit}, 1 unit = {metres:.6g} m" if metres else unit]
    if count:
        said.append(f"of these joined of separate lines, end to end: {count}, of {_counted(kinds)}")
    if lines.left:
        said.append(f"left out, since they are no closed lines: {_counted(lines.left)}")
    return Drawing(lines.closed, [f"{path}: {place}" for place in lines.places], said, bottom)


def _counted(kinds: dict[str, int]) -> str:
    """Numbers of lines by their kinds."""
    return ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items()))
