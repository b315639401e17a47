"""The share of an area that bodies cover."""

from __future__ import annotations

from typing import Any

from ..base.optional import need
from ..base.polygons import area_of
from ..read.frames import Frame
from .windows import Window, area_inside, outline_of, shifts_into


def solid_fraction(frame: Frame, window: Window, *, fixed: bool = True, union: bool = False) -> float:
    """Solid fraction in a window: the area of the bodies inside the window over the area of the window.

    The areas are exact: polygons that cross the edge of the window are clipped (Sutherland & Hodgman, Commun. ACM 17
    (1974) 32). Where bodies overlap their areas count twice; with `union` they count once, for which the package
    shapely is needed. `fixed=False` leaves fixed bodies out. In a periodic cell copies count as bodies do.
    """
    outline = outline_of(window)
    chosen = frame.free | (frame.fixed if fixed else False)
    if union:
        return _united_area(frame, outline, chosen) / area_of(outline)
    return float(area_inside(frame, outline)[chosen].sum()) / area_of(outline)


def _united_area(frame: Frame, outline: Any, chosen: Any) -> float:
    shapely = need("shapely", "shapely", "solid_fraction(union=True)")
    polygons = [shapely.Polygon(vertices + shift) for shift in shifts_into(frame, outline)
                for vertices, wanted in zip(frame.vertices, chosen & ~(frame.spans & (shift != 0.0)).any(axis=1))
                if wanted]
    return float(shapely.union_all(polygons).intersection(shapely.Polygon(outline)).area)
