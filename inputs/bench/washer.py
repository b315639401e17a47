"""Write the scene `washer` of the benchmarks of Box2D (E. Catto, box2d.org, file shared/benchmarks.c) for polydem.

    python3 inputs/bench/washer.py FOLDER
    ./polydem run FOLDER/washer.nml

8100 squares of 0.2 m tumble in a ring of 36 segments with four paddles, which turns by 25 degrees per second. Geometry,
density, friction coefficient and gravity are those of Box2D. Its restitution is 0; here collisions are damped, but not
without any rebound. Stiffness and time step have no counterpart: at rest, the weight of forty squares presses two of
them together by a depth of about 1 % of their side (computed); Box2D accepts a penetration of 2.5 %. When the block of
squares falls on the ring at the start, some contacts are deeper.
"""

import sys
from pathlib import Path

import h5py
import numpy as np

CENTRE = (0.0, 10.0)
SEGMENTS = 36
ROWS = 90
HALF = 0.1

NAMELIST = """! The washer of Box2D's benchmarks: 8100 squares in a turning ring. Written by inputs/bench/washer.py.
&scene
   name = 'file'
   bodies_file = '{bodies}'
   density = 1              ! kg/m3
/
&motion
   name = 'turn'
   kind = 'rotation'
   pivot = 0, 10            ! m
   rate = 0.0694444         ! revolutions per second, 25 degrees per second
/
&forces
   gravity = 0, -10         ! m/s2
   stiffness = 1e4          ! N/m2
   damping_coefficient = 0.5
   friction_coefficient = 0.6
/
&integrate
   dt = 2.5e-4              ! s
   duration = 8.3325        ! s, nearly 500 steps of 1/60 s
/
&output
   frame_interval = 0.5     ! s
   energy_balance = .false.
   step_profile = .true.
/
"""


def segment(k: int, inner: float, outer: float, overlap: float) -> np.ndarray:
    """Corners of one segment of a ring, longer at both ends by an angle [rad]."""
    low = 2.0 * np.pi * k / SEGMENTS - overlap
    high = 2.0 * np.pi * (k + 1) / SEGMENTS + overlap
    corners = [(inner, low), (outer, low), (outer, high), (inner, high)]
    return np.array([(r * np.cos(a), r * np.sin(a)) for r, a in corners]) + CENTRE


def squares() -> list[np.ndarray]:
    """Squares in rows, from the bottom."""
    square = HALF * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    start = np.array(CENTRE) - 1.1 * HALF * ROWS
    start[0] -= CENTRE[0]
    places = 2.1 * HALF * np.arange(ROWS)
    return [square + start + (x, y) for y in places for x in places]


def main(folder: Path) -> None:
    """Write bodies file and namelist."""
    overlap = 0.1 * np.pi / 18.0
    walls = [segment(k, 16.0, 18.0, overlap) for k in range(SEGMENTS)]
    walls += [segment(k, 14.0, 16.0, 0.0) for k in range(0, SEGMENTS, 9)]
    grains = squares()
    polygons = grains + walls
    folder.mkdir(parents=True, exist_ok=True)
    with h5py.File(folder / "washer.h5", "w") as file:
        file["vertex"] = np.concatenate(polygons)
        file["vertex_start"] = np.concatenate([[0], np.cumsum([len(polygon) for polygon in polygons])])
        file["fixed"] = np.array([0] * len(grains) + [1] * len(walls), dtype="int8")
    (folder / "washer.nml").write_text(NAMELIST.format(bodies=folder / "washer.h5"))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
