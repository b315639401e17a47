"""The overlap of two convex polygons in exact rational arithmetic, with the standard library alone.

It knows nothing of clipping loops: every edge of one polygon is cut to the interval that lies in the other (Cyrus &
Beck), in integers, and the area follows from Green's theorem.
"""

import itertools
import math
from fractions import Fraction


def to_integers(points, offset, bits):
    """Points plus offset as integers in units of 2^-bits; exact."""
    return [
        (int(Fraction(x) * 2**bits) + int(Fraction(offset[0]) * 2**bits),
         int(Fraction(y) * 2**bits) + int(Fraction(offset[1]) * 2**bits))
        for x, y in points
    ]


def edges_of(polygon):
    return [
        (p[0], p[1], q[0] - p[0], q[1] - p[1]) for p, q in zip(polygon, polygon[1:] + polygon[:1])
    ]


def intervals(edges, other_edges, keep_common):
    """For each edge the interval (t0, t1) inside the other polygon; None instead of the list if the polygons are apart.

    An edge on a line of the other's outline counts if the directions agree and `keep_common` is set. If the
    directions are opposite the polygons lie on opposite sides of that line: no overlap at all.
    """
    found = []
    for x, y, dx, dy in edges:
        t0, t1 = Fraction(0), Fraction(1)
        for ox, oy, ex, ey in other_edges:
            start = ex * (y - oy) - ey * (x - ox)
            slope = ex * dy - ey * dx
            if slope == 0:
                if start < 0 or (start == 0 and ex * dx + ey * dy > 0 and not keep_common):
                    t1 = t0
                elif start == 0 and ex * dx + ey * dy < 0:
                    return None
            elif start >= 0 and start + slope >= 0:
                continue
            elif start <= 0 and start + slope <= 0:
                t1 = t0
            elif slope > 0:
                t0 = max(t0, Fraction(-start, slope))
            else:
                t1 = min(t1, Fraction(-start, slope))
            if t0 >= t1:
                break
        if t0 < t1:
            found.append((t0, t1, x, y, dx, dy))
    return found


def radius(polygon):
    """Size of a polygon by which the program chooses the smaller of two."""
    return max(math.sqrt(x * x + y * y) for x, y in polygon)


def exact_overlap(a, b, offset):
    """Area of the overlap as a fraction, and (N, M_a, M_b) as real numbers.

    The integrals leave edges that both outlines share to the larger polygon, and half of them to each if the polygons
    are equally large, as the program does.
    """
    exponents = [math.frexp(v)[1] for v in itertools.chain(*a, *b, offset) if v != 0.0]
    bits = 54 - min(exponents)
    a_edges = edges_of(to_integers(a, (0.0, 0.0), bits))
    b_edges = edges_of(to_integers(b, offset, bits))
    with_common, without = intervals(a_edges, b_edges, True), intervals(a_edges, b_edges, False)
    on_b = intervals(b_edges, a_edges, False)
    if on_b is None or with_common is None:
        return Fraction(0), None
    twice = sum((t1 - t0) * (x * dy - y * dx) for t0, t1, x, y, dx, dy in with_common + on_b)
    unit = Fraction(1, 2**bits)
    cx, cy = int(Fraction(offset[0]) * 2**bits), int(Fraction(offset[1]) * 2**bits)
    share = Fraction(1, 2) if radius(a) == radius(b) else Fraction(int(radius(a) > radius(b)))
    weighted = [(share, edge) for edge in with_common] + [(1 - share, edge) for edge in without]
    normal = [sum(w * (t1 - t0) * dy for w, (t0, t1, x, y, dx, dy) in weighted),
              -sum(w * (t1 - t0) * dx for w, (t0, t1, x, y, dx, dy) in weighted)]

    def moment(centre_x, centre_y):
        return -sum(w * (t1 - t0) * (dx * (x - centre_x + dx * (t0 + t1) / 2)
                                     + dy * (y - centre_y + dy * (t0 + t1) / 2))
                    for w, (t0, t1, x, y, dx, dy) in weighted)

    integrals = [float(normal[0] * unit), float(normal[1] * unit),
                 float(moment(0, 0) * unit**2), float(moment(cx, cy) * unit**2)]
    return twice * unit**2 / 2, integrals
