"""Compare overlaps computed by the program overlap_stream with exact rational arithmetic.

    check_exact_overlap.py PROGRAM [--full] [--seed SEED] [--table FOLDER] [--behind]

By default there are ten thousand pairs, more than a thousand of them degenerate; with `--full` a hundred thousand
random and ten thousand degenerate ones. `--table` prints rows of the table of `./polydem verify` and writes them into
a folder. With `--behind` it appends them to the existing table.

Exit status 1 if any pair misses its bound:

    |A - A*| <= max(1e-12 A*, 16 u p s),  p perimeter and s size of the smaller body, u = 2^-53
    A = 0 where A* = 0
    |N - N*| <= e s and |M - M*| <= e s (s + |offset|) with e = max(1e-12, 16 u s^2/A*), except for polygons whose
    common edges agree only up to rounding: there N jumps
    every stored separating edge gives the same bits
"""

import argparse
import concurrent.futures
import math
import os
import random
import struct
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from fractions import Fraction

from exact_overlap import edges_of, exact_overlap
from verification_rows import expect_zero, print_row, write_rows

UNIT_ROUNDOFF = 2.0**-53


# --- pairs --------------------------------------------------------------------------------------------------


def hull(points):
    """Strictly convex hull, anticlockwise (Andrew's monotone chain)."""
    points = sorted(set(points))

    def chain(sequence):
        kept = []
        for p in sequence:
            while len(kept) > 1 and ((kept[-1][0] - kept[-2][0]) * (p[1] - kept[-2][1])
                                     - (kept[-1][1] - kept[-2][1]) * (p[0] - kept[-2][0])) <= 0:
                kept.pop()
            kept.append(p)
        return kept[:-1]

    return chain(points) + chain(points[::-1])


def grain(rng, corners, size, aspect=1.0):
    """Convex polygon in an ellipse, about its centre."""
    turn = rng.uniform(0, 2 * math.pi)
    angles = sorted(2 * math.pi * (k + 0.7 * rng.random()) / corners for k in range(corners))
    return turned([(0.5 * size * math.cos(t), 0.5 * size / aspect * math.sin(t)) for t in angles], turn)


def turned(points, angle):
    c, s = math.cos(angle), math.sin(angle)
    return [(c * x - s * y, s * x + c * y) for x, y in points]


def support(points, direction):
    return max(x * direction[0] + y * direction[1] for x, y in points)


def corner_on_edge(rng, a, b, depth):
    """b turned and moved so that a corner of a lies on an edge of b, then pushed in by a depth."""
    i = rng.randrange(len(a))
    before, corner, after = a[i - 1], a[i], a[(i + 1) % len(a)]
    share = rng.uniform(0.05, 0.95)
    along = math.atan2(corner[1] - before[1], corner[0] - before[0])
    corner_turn = (math.atan2(after[1] - corner[1], after[0] - corner[0]) - along) % (2 * math.pi)
    normal = along + share * corner_turn - math.pi / 2
    p, q = b[0], b[1]
    b = turned(b, normal + math.pi / 2 + math.pi - math.atan2(q[1] - p[1], q[0] - p[0]))
    share = rng.uniform(0, 1)
    point = [v + share * (w - v) for v, w in zip(b[0], b[1])]
    return a, b, (corner[0] - point[0] - depth * math.cos(normal), corner[1] - point[1] - depth * math.sin(normal))


def swapped(rng, pair):
    a, b, offset = pair
    return pair if rng.random() < 0.5 else (b, a, (-offset[0], -offset[1]))


def pair_of_grains(rng):
    a = grain(rng, rng.randint(3, 12), 0.008)
    b = grain(rng, rng.randint(3, 12), 0.008 * 10 ** rng.uniform(-1, 1))
    return corner_on_edge(rng, a, b, 0.004 * 10 ** rng.uniform(-13, 0) * rng.choice([-1, 1, 1, 1]))


def grain_on_wall(rng):
    tilt = rng.uniform(0, 2 * math.pi)
    wall = turned([(-0.8, -0.02), (0.8, -0.02), (0.8, 0.02), (-0.8, 0.02)], tilt)
    g = grain(rng, rng.randint(3, 12), 0.008, rng.uniform(1, 3))
    side = (-math.sin(tilt), math.cos(tilt))
    if rng.random() < 0.3:  # a face of the grain flush with the wall
        p, q = g[0], g[1]
        g = turned(g, tilt + math.pi - math.atan2(q[1] - p[1], q[0] - p[0]))
    depth = rng.choice([0.0, 0.008 * 10 ** rng.uniform(-14, 0)])
    distance = 0.02 + support(g, (-side[0], -side[1])) - depth
    along = rng.uniform(-0.79, 0.79)
    offset = (side[0] * distance + side[1] * along, side[1] * distance - side[0] * along)
    return swapped(rng, (wall, g, offset))


def grain_at_end_of_wall(rng):
    wall, g, _ = grain_on_wall(rng)
    if len(wall) != 4 or abs(wall[0][0]) + abs(wall[0][1]) < 0.5:
        wall, g = g, wall
    return swapped(rng, corner_on_edge(rng, wall, g, 0.008 * 10 ** rng.uniform(-14, 0)))


def lattice_polygon(rng, span):
    while True:
        polygon = hull([(rng.randint(-span, span), rng.randint(-span, span)) for _ in range(rng.randint(3, 12))])
        edges = edges_of(polygon)
        if len(polygon) > 2 and all(-x * dy + y * dx < 0 for x, y, dx, dy in edges):
            return polygon


def lattice_pair(rng):
    """Exact degeneracies: vertices on vertices and on edges, common edges, containment, copies."""
    a = lattice_polygon(rng, rng.choice([2, 3, 5]))
    b = rng.choice([a, lattice_polygon(rng, 3), lattice_polygon(rng, 2)])
    unit = rng.choice([1.0, 0.125, 2.0**-30])
    offset = (rng.randint(-6, 6), rng.randint(-6, 6))
    return ([(x * unit, y * unit) for x, y in a], [(x * unit, y * unit) for x, y in b],
            (offset[0] * unit, offset[1] * unit))


def turned_lattice_pair(rng):
    """Degeneracies as in `lattice_pair`, but only up to rounding."""
    a, b, offset = lattice_pair(rng)
    angle = rng.uniform(0, 2 * math.pi)
    return turned(a, angle), turned(b, angle), turned([offset], angle)[0]


def needles(rng):
    a = grain(rng, rng.randint(3, 8), 1.0, 50.0)
    b = grain(rng, rng.randint(3, 8), 1.0, rng.choice([1.0, 50.0, 500.0]))
    return corner_on_edge(rng, a, b, 0.1 * 10 ** rng.uniform(-13, 0))


def nearly_parallel(rng):
    a = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
    angle = 10 ** rng.uniform(-16, -3) * rng.choice([-1, 1])
    depth = 10 ** rng.uniform(-16, -1) * rng.choice([-1, 0, 1])
    turn = rng.uniform(0, 2 * math.pi)
    return (turned(a, turn), turned(a, turn + angle), turned([(rng.uniform(-1, 1), 2.0 - depth)], turn)[0])


def many_corners(rng):
    a = grain(rng, rng.randint(40, 70), 1.0, rng.uniform(1, 2))
    b = grain(rng, rng.randint(3, 70), 1.0, rng.uniform(1, 4))
    return a, b, (rng.uniform(-1, 1), rng.uniform(-1, 1))


RANDOM = [pair_of_grains, grain_on_wall, grain_at_end_of_wall, needles, many_corners]
DEGENERATE = [lattice_pair, turned_lattice_pair, nearly_parallel]
# pairs of each kind
USUAL = dict.fromkeys(RANDOM, 1800) | dict.fromkeys(DEGENERATE, 400)
FULL = dict.fromkeys(RANDOM, 20000) | dict.fromkeys(DEGENERATE, 3334)
# pairs that one process compares at a time
LOT = 200
# kinds whose polygons share edges up to rounding: N jumps when a body inside another leaves the edge it lies at
WITHOUT_NORMAL = [turned_lattice_pair]


# --- comparison ---------------------------------------------------------------------------------------------


def computed(program, pairs):
    with tempfile.TemporaryDirectory() as folder:
        source, target = os.path.join(folder, "pairs"), os.path.join(folder, "results")
        with open(source, "wb") as file:
            for a, b, offset, edge in pairs:
                numbers = [len(a), len(b), edge, *offset] + [v for p in a + b for v in p]
                file.write(struct.pack(f"={len(numbers)}d", *numbers))
        subprocess.run([program, source, target], check=True)
        with open(target, "rb") as file:
            return list(struct.iter_unpack("=8d", file.read()))


def allowed_error(a, b, exact):
    def size(p):
        return max(math.dist(v, w) for v in p for w in p)

    smaller = min(a, b, key=size)
    perimeter = sum(math.dist(v, w) for v, w in zip(smaller, smaller[1:] + smaller[:1]))
    return max(1e-12 * float(exact), 16 * UNIT_ROUNDOFF * perimeter * size(smaller))


def integral_error(a, b, offset, exact, integrals, result):
    """Greatest error of N, M_a and M_b over the allowed error; rounding moves the ends of slivers along the edges."""
    size = min(max(math.dist(v, w) for v in p for w in p) for p in (a, b))
    allowed = max(1e-12, 16 * UNIT_ROUNDOFF * size**2 / float(exact))
    scales = [size, size] + 2 * [size * (size + math.hypot(*offset))]
    return max(abs(x - y) / scale for x, y, scale in zip(integrals, result[3:7], scales)) / allowed


@dataclass
class Findings:
    """Result of the comparison of pairs of one kind."""

    pairs: int = 0
    contacts: int = 0
    #: Greatest error of the area over the allowed error
    worst: float = 0.0
    #: Greatest error of N and M over the allowed error
    worst_integral: float = 0.0
    #: Processor time, including that of the program [s]
    seconds: float = 0.0
    #: Failures, one line per pair
    misses: tuple = ()

    def __add__(self, other):
        return Findings(self.pairs + other.pairs, self.contacts + other.contacts, max(self.worst, other.worst),
                        max(self.worst_integral, other.worst_integral), self.seconds + other.seconds,
                        self.misses + other.misses)


def check(program, kind, count, seed):
    """Compare some pairs of one kind."""
    start = sum(os.times()[:4])
    rng = random.Random(f"{kind.__name__} {seed}")
    pairs = [kind(rng) for _ in range(count)]
    results = computed(program, [(a, b, o, 0) for a, b, o in pairs])
    again = computed(program, [(a, b, o, rng.choice([r[7], rng.randint(1, len(a)), -rng.randint(1, len(b))]))
                               for (a, b, o), r in zip(pairs, results)])
    found = Findings(pairs=count, contacts=sum(result[0] > 0.0 for result in results))
    for pair, result, other in zip(pairs, results, again):
        found += compare(kind, pair, result, other)
    found.seconds = sum(os.times()[:4]) - start
    return found


def compare(kind, pair, result, other):
    """Compare one pair; `other` is the result with a stored separating edge."""
    a, b, offset = pair
    exact, integrals = exact_overlap(a, b, offset)
    found, miss = Findings(), []
    found.worst = float(abs(Fraction(result[0]) - exact)) / allowed_error(a, b, exact)
    if not found.worst <= 1.0:
        miss.append(f"error {found.worst:.2f} of what is allowed")
    if exact > 0 and kind not in WITHOUT_NORMAL:
        found.worst_integral = integral_error(a, b, offset, exact, integrals, result)
        if not found.worst_integral <= 1.0:
            miss.append(f"integrals {result[3:7]} instead of {integrals}")
    if exact == 0 and result[0] != 0.0:
        miss.append("false contact")
    if result[:7] != other[:7]:
        miss.append("depends on the remembered edge")
    if not all(map(math.isfinite, result)):
        miss.append("not finite")
    if miss:
        found.misses = (f"{', '.join(miss)}: A* = {float(exact):.6e}, A = {result[0]:.6e}, a = {a}, b = {b}, "
                        f"offset = {offset}",)
    return found


def check_kind(pool, program, kind, count, seed):
    """Compare the pairs of one kind in batches; print the first failures."""
    sizes = [min(LOT, count - first) for first in range(0, count, LOT)]
    lots = [pool.submit(check, program, kind, size, f"{seed} {lot}") for lot, size in enumerate(sizes)]
    found = sum((lot.result() for lot in lots), Findings())
    for miss in found.misses[:3]:
        print(f"  {kind.__name__}: {miss}")
    return found


def rows_of(kind, found):
    """Rows of one kind for the table of verification."""
    name = f"{found.pairs} pairs, {kind.__name__.replace('_', ' ')}, {found.contacts} contacts: "
    rows = [expect_zero("exact", name + "A, error/allowed", found.worst, 1.0, found.seconds)]
    if kind not in WITHOUT_NORMAL:
        rows.append(expect_zero("exact", name + "N and M", found.worst_integral, 1.0, 0.0))
    return rows


def print_findings(kind, found):
    """Print one line about one kind."""
    print(f"{kind.__name__:24s} {found.pairs:6d} pairs {found.contacts:6d} contacts, worst errors over the allowed: "
          f"A {found.worst:8.2e}, N and M {found.worst_integral:8.2e}; {len(found.misses)} misses", flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--seed", default="1")
    parser.add_argument("--table")
    parser.add_argument("--behind", action="store_true")
    given = parser.parse_args()
    plan, rows, misses = FULL if given.full else USUAL, [], 0
    title = f"{sum(plan.values())} pairs, {sum(plan[kind] for kind in DEGENERATE)} of them degenerate"
    if given.table:
        print(f"exact  overlaps against exact rational arithmetic, {title}", flush=True)
    with concurrent.futures.ProcessPoolExecutor(None if given.full else 2) as pool:
        for kind, count in plan.items():
            found = check_kind(pool, given.program, kind, count, given.seed)
            misses += len(found.misses)
            if not given.table:
                print_findings(kind, found)
                continue
            of_kind = rows_of(kind, found)
            for row in of_kind:
                print_row(row)
            rows += of_kind
    if given.table:
        rows.append(expect_zero("exact", f"{title}: misses, false contacts included", misses, 0.0, 0.0))
        print_row(rows[-1])
        write_rows(rows, given.table, given.behind)
        print(f"{sum(row.verdict == 'MISSED' for row in rows)} rows missed their tolerance")
    else:
        print(f"{title}: {misses} misses")
    sys.exit(1 if misses else 0)


if __name__ == "__main__":
    main()
