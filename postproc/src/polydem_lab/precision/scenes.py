"""The scenes of the study of speed against error: bodies, models, steps, and what is measured.

Where an error depends on the phase of the step in which bodies touch, a scene consists of many copies side by side
that differ in this phase alone; they do not see each other.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Callable

import h5py
import numpy as np
from polydem_post.base.result_file import ResultError
from polydem_post.read.trajectory import Trajectory

#: Folder of the namelists
INPUTS = Path(__file__).resolve().parents[4] / "inputs" / "precision"

#: Defaults of the namelist that the scenes rely on: density [kg/m3], E [N/m2], acceleration of gravity [m/s2]
DENSITY, STIFFNESS, GRAVITY = 2500.0, 1.0e7, 9.81

#: Side of the squares [m], and their velocity before an impact [m/s]
SIDE, SPEED = 0.01, 0.1

#: Greatest and least velocity of the sliding blocks [m/s], and their friction coefficient
SLIDING, FRICTION = (0.04, 0.06), 0.23

#: Blocks of a stack
BLOCKS = 5

#: Damping -> damping coefficient: a restitution of about three quarters for a flat impact at SPEED
DAMPING = {"rate": 0.2, "matuttis_chen": 0.2, "hunt_crossley": 250.0}


@dataclass(frozen=True)
class Model:
    """What is simulated: entries of &forces."""

    law: str
    damping: str
    friction: str

    @property
    def name(self) -> str:
        """The three laws, as in tables."""
        return f"{self.law}/{self.damping}/{self.friction}"

    def overrides(self) -> list[str]:
        """Entries for --set; the inputs have the area law."""
        entries = [f"forces.damping={self.damping}", f"forces.friction={self.friction}"]
        if self.law != "area":
            entries.append(f"forces.law={self.law}")
        if self.damping in DAMPING:
            entries.append(f"forces.damping_coefficient={DAMPING[self.damping]!r}")
        return entries


@dataclass
class BodyList:
    """Bodies to be written to a bodies file."""

    polygons: list = field(default_factory=list)
    fixed: list = field(default_factory=list)
    velocities: list = field(default_factory=list)
    spins: list = field(default_factory=list)

    def add(self, polygon, velocity=(0.0, 0.0), spin: float = 0.0, fixed: bool = False) -> None:
        """Append a body."""
        self.polygons.append(np.asarray(polygon, dtype=float))
        self.fixed.append(fixed)
        self.velocities.append(velocity)
        self.spins.append(spin)

    def write(self, path: Path) -> None:
        """Write the bodies file."""
        counts = [len(polygon) for polygon in self.polygons]
        with h5py.File(path, "w") as file:
            file["vertex"] = np.concatenate(self.polygons)
            file["vertex_start"] = np.concatenate([[0], np.cumsum(counts)])
            file["fixed"] = np.asarray(self.fixed, dtype="int8")
            file["velocity"] = np.asarray(self.velocities, dtype=float)
            file["angular_velocity"] = np.asarray(self.spins, dtype=float)


@dataclass(frozen=True)
class Scene:
    """A scene with everything that is varied in it."""

    name: str
    title: str
    #: What the errors are errors of, for axes and tables
    measured: str
    models: tuple
    #: Numbers of steps, from the largest step to the smallest
    steps: tuple
    #: Steps of the reference; half as many tell how exact it is. 0: the exact result is zero
    reference: int
    #: From the result of a run to (moments, items, components), in units that make an error of 1 a large one
    measure: Callable
    #: Bodies at the start; absent: they come from a run of NAME_start.nml
    bodies: Callable | None = None
    #: Moments at which the bodies are looked at, evenly spread
    moments: int = 1
    #: One number of a converged result, what it is, and what theory says of it for a model (None: nothing)
    quantity: Callable | None = None
    quantity_name: str = ""
    target: Callable | None = None

    @property
    def namelist(self) -> Path:
        """The input file of the scene."""
        return INPUTS / f"{self.name}.nml"

    @property
    def duration(self) -> float:
        """Simulated time as the namelist says [s]."""
        found = re.search(r"^\s*duration\s*=\s*(\S+)", self.namelist.read_text(encoding="utf-8"), re.MULTILINE)
        if not found:
            raise ResultError(f"{self.namelist}: has no duration")
        return float(found.group(1))


# --- bodies ------------------------------------------------------------------------------------------------------


def rectangle(x: float, y: float, width: float, height: float) -> np.ndarray:
    """Corners of a rectangle whose lower edge has its middle at (x, y)."""
    half = 0.5 * width
    return np.array([(x - half, y), (x + half, y), (x + half, y + height), (x - half, y + height)])


def turned(polygon: np.ndarray, angle: float) -> np.ndarray:
    """A polygon turned about the mean of its corners [rad]."""
    centre = polygon.mean(axis=0)
    c, s = math.cos(angle), math.sin(angle)
    return centre + (polygon - centre) @ np.array([[c, s], [-s, c]])


def spread(count: int) -> np.ndarray:
    """Numbers between 0 and 1 whose multiples are evenly spread over any period (golden section)."""
    return np.mod((np.arange(count) + 0.5) * 0.5 * (math.sqrt(5.0) - 1.0), 1.0)


def places(count: int, width: float, height: float) -> list:
    """Places of copies in rows around the origin, so that coordinates stay small."""
    columns = max(1, round(math.sqrt(count * height / width)))
    rows = -(-count // columns)
    return [
        ((k % columns - 0.5 * (columns - 1)) * width, (k // columns - 0.5 * rows) * height) for k in range(count)
    ]


def _impacts(angle: float, velocity: tuple, flight: float, copies: int = 32) -> BodyList:
    """Squares, turned by an angle, above a plate each that they reach after 0 to `flight` seconds."""
    bodies = BodyList()
    for (x, y), wait in zip(places(copies, 4.0 * SIDE, 4.0 * SIDE), flight * spread(copies)):
        square = turned(rectangle(x, y, SIDE, SIDE), angle)
        square += np.array([0.0, y - square[:, 1].min()]) - wait * np.array(velocity)
        bodies.add(square, velocity)
        bodies.add(rectangle(x, y - SIDE, 3.0 * SIDE, SIDE), fixed=True)
    return bodies


def flat_impact() -> BodyList:
    """Squares parallel to their plates."""
    return _impacts(0.0, (0.0, -SPEED), 3.0e-4)


def corner_impact() -> BodyList:
    """Squares on a corner."""
    return _impacts(0.25 * math.pi, (0.0, -SPEED), 2.0e-3)


def oblique_impact() -> BodyList:
    """Squares turned by 30 degrees that move at 45 degrees."""
    return _impacts(math.pi / 6.0, (SPEED, -SPEED), 2.0e-3)


def sliding_speeds(copies: int = 8) -> np.ndarray:
    """Velocities of the sliding blocks at the start [m/s]."""
    return SLIDING[0] + (SLIDING[1] - SLIDING[0]) * spread(copies)


def sliding_block() -> BodyList:
    """Blocks of 2 x 1 cm, as deep in their plates as their weight asks for."""
    bodies = BodyList()
    width, height = 2.0 * SIDE, SIDE
    depth = 0.0
    for _ in range(12):  # F = E w d/l with l = h - d, Matuttis & Chen 2014
        depth = DENSITY * width * height * GRAVITY * (height - depth) / (STIFFNESS * width)
    for (x, y), speed in zip(places(8, 6.0 * SIDE, 4.0 * SIDE), sliding_speeds()):
        bodies.add(rectangle(x, y - depth, width, height), (speed, 0.0))
        bodies.add(rectangle(x, y - height, 5.0 * SIDE, height), fixed=True)
    return bodies


def sag() -> float:
    """How far the topmost square of a stack sinks at rest [m]."""
    return 0.5 * BLOCKS * (BLOCKS + 1) * DENSITY * SIDE**2 * GRAVITY / STIFFNESS


def stack() -> BodyList:
    """Stacks whose squares are less than a tenth of the sag apart."""
    bodies = BodyList()
    gaps = 0.1 * sag() * spread(8 * BLOCKS).reshape(8, BLOCKS)
    for (x, y), between in zip(places(8, 4.0 * SIDE, 8.0 * SIDE), gaps):
        for k, gap in enumerate(np.cumsum(between)):
            bodies.add(rectangle(x, y + k * SIDE + gap, SIDE, SIDE))
        bodies.add(rectangle(x, y - SIDE, 3.0 * SIDE, SIDE), fixed=True)
    return bodies


def gas() -> BodyList:
    """Regular pentagons in a square box, with velocities in all directions."""
    bodies = BodyList()
    cell, rows = 0.015, 4
    corners = 0.005 * np.array([(math.cos(a), math.sin(a)) for a in 0.4 * math.pi * np.arange(5)])
    random = np.random.default_rng(7)
    for k in range(rows * rows):
        middle = cell * (np.array([k % rows, k // rows]) - 0.5 * (rows - 1))
        angle, way = random.uniform(0.0, 2.0 * math.pi, 2)
        velocity = 0.3 * np.array([math.cos(way), math.sin(way)])
        bodies.add(turned(corners, angle) + middle, velocity, random.normal(0.0, 30.0))
    half = 0.5 * cell * rows
    long = 2.0 * half + 2.0 * SIDE
    for x, y, width, height in [
        (0.0, -half - SIDE, long, SIDE), (0.0, half, long, SIDE),
        (-half - 0.5 * SIDE, -half, SIDE, 2.0 * half), (half + 0.5 * SIDE, -half, SIDE, 2.0 * half),
    ]:
        bodies.add(rectangle(x, y, width, height), fixed=True)
    return bodies


def last_frame(run: Trajectory) -> BodyList:
    """The bodies of the last frame of a run as bodies of a new one."""
    frame = run.frame(-1)
    bodies = BodyList()
    for k, outline in enumerate(frame.vertices):
        fixed = bool(frame.fixed[k])
        bodies.add(outline, (0.0, 0.0) if fixed else frame.velocity[k],
                   0.0 if fixed else float(frame.angular_velocity[k]), fixed)
    return bodies


# --- measures ----------------------------------------------------------------------------------------------------


def velocities_after(run: Trajectory) -> np.ndarray:
    """Velocities, and that of a corner due to the rotation, of the free bodies at the end, over SPEED."""
    frame = run.frame(-1)
    free = ~frame.fixed
    corner = frame.angular_velocity[free, None] * SIDE * math.sqrt(0.5)
    return np.concatenate([frame.velocity[free], corner], axis=1)[None] / SPEED


def ways(run: Trajectory) -> np.ndarray:
    """Ways of the sliding blocks over v^2/(2 mu g)."""
    first, last = run.frame(0), run.frame(-1)
    free = ~first.fixed
    way = last.position[free, 0] - first.position[free, 0]
    return (way * 2.0 * FRICTION * GRAVITY / first.velocity[free, 0] ** 2)[None, :, None]


def sinking(run: Trajectory) -> np.ndarray:
    """Ways of the blocks of each stack downwards, over the sag; the root of their number makes a norm a mean."""
    first, last = run.frame(0), run.frame(-1)
    free = ~first.fixed
    way = first.position[free, 1] - last.position[free, 1]
    return (way / (sag() * math.sqrt(BLOCKS))).reshape(1, -1, BLOCKS)


def grain_positions(run: Trajectory) -> np.ndarray:
    """Positions of the grains over 1 cm, about their diameter, at all frames but the first."""
    frames = [run.frame(k) for k in range(1, len(run))]
    return np.stack([frame.position[~frame.fixed] for frame in frames]) / 0.01


def energy_changes(run: Trajectory) -> np.ndarray:
    """Relative change of the kinetic energy at each frame; NaN where bodies touch."""
    with h5py.File(run.folder / "steps.h5", "r") as file:
        contacts = dict(zip(file["steps/step"][:].tolist(), file["steps/contacts"][:].tolist()))
    kinetic = run.energy_balance["kinetic"]
    free = np.array([contacts.get(int(step), 0) == 0 for step in run.steps])
    return np.where(free, kinetic / kinetic[0] - 1.0, np.nan)[1:, None, None]


# --- what theory says ---------------------------------------------------------------------------------------------


def restitution(model: Model) -> float | None:
    """Restitution of a flat impact of a square on a plate three times as wide.

    Dashpot: T. Schwager & T. Poeschel, Granular Matter 9 (2007) 465, with and without the book's limit of the damping
    to four times the elastic force; K.H. Hunt & F.R.E. Crossley, J. Appl. Mech. 42 (1975) 440.
    """
    if model.damping == "none":
        return 1.0
    zeta = 0.5 * DAMPING["rate"]  # a face is as stiff as E, whatever its width
    s = math.sqrt(1.0 - zeta**2)
    e = math.exp(-zeta / s * (math.pi - math.atan2(2.0 * zeta * s, 1.0 - 2.0 * zeta**2)))
    if model.damping == "rate":
        return e
    if model.damping == "matuttis_chen":
        root = math.sqrt(5.0)
        theta = math.atan(0.5 * zeta * root)
        x, v = math.sin(theta) / root, math.cos(theta)
        tau = math.atan2(s * x, v + zeta * x) / s
        return e * math.exp(zeta * tau) * math.hypot(s * x, v + zeta * x)
    if model.damping == "hunt_crossley":
        rate = DAMPING["hunt_crossley"] * math.sqrt(DENSITY * SIDE**2 / STIFFNESS) / SIDE
        return _hunt_crossley(rate * SPEED)
    return None


def _hunt_crossley(u: float) -> float:
    """Solution e of u - ln(1 + u) = -e u - ln(1 - e u), by bisection."""
    low, high = 0.0, min(1.0, (1.0 - 1e-15) / u)
    for _ in range(200):
        middle = 0.5 * (low + high)
        loss = -middle * u - math.log1p(-middle * u)
        low, high = (middle, high) if loss < u - math.log1p(u) else (low, middle)
    return 0.5 * (low + high)


def _models(*names: str) -> tuple:
    return tuple(Model(*name.split("/")) for name in names)


def _doubled(first: int, count: int) -> tuple:
    return tuple(first * 2**k for k in range(count))


SCENES = {
    scene.name: scene
    for scene in [
        Scene("flat_impact", "Flat impact", "velocity after the impact",
              _models("area/none/none", "area/rate/none", "area/matuttis_chen/none", "area/hunt_crossley/none",
                      "polar/none/none", "polar/rate/none", "polar/hunt_crossley/none"),
              _doubled(8, 6), 4096, velocities_after, flat_impact,
              quantity=lambda result: float(result[-1, :, 1].mean()), quantity_name="restitution",
              target=restitution),
        Scene("corner_impact", "Corner impact", "velocity after the impact",
              _models("area/none/none", "area/rate/none", "area/hunt_crossley/none", "polar/none/none",
                      "polar/hunt_crossley/none"),
              _doubled(64, 6), 16384, velocities_after, corner_impact,
              quantity=lambda result: float(result[-1, :, 1].mean()), quantity_name="restitution",
              target=lambda model: 1.0 if model.damping == "none" else None),
        Scene("oblique_impact", "Oblique impact", "velocity after the impact",
              _models("area/rate/none", "area/rate/cundall_strack", "area/hunt_crossley/cundall_strack",
                      "polar/rate/cundall_strack", "polar/hunt_crossley/cundall_strack",
                      "area/rate/exact"),
              _doubled(64, 6), 16384, velocities_after, oblique_impact),
        Scene("sliding_block", "Sliding block", "way until rest",
              _models("area/rate/cundall_strack", "polar/rate/cundall_strack",
                      "polar/hunt_crossley/cundall_strack", "area/rate/exact"),
              _doubled(256, 6), 32768, ways, sliding_block,
              quantity=lambda result: float(result[-1].mean()), quantity_name="way over v^2/(2 mu g)",
              target=lambda model: 1.0),
        Scene("stack", "Stack", "sinking of the blocks",
              _models("area/rate/none", "area/rate/cundall_strack", "area/hunt_crossley/none",
                      "polar/rate/none"),
              _doubled(80, 6), 10240, sinking, stack),
        Scene("drum", "Drum", "position of the grains",
              _models("area/rate/cundall_strack", "area/hunt_crossley/cundall_strack",
                      "polar/rate/cundall_strack", "area/rate/exact"),
              _doubled(2048, 4), 65536, grain_positions, moments=8),
        Scene("gas", "Elastic gas", "kinetic energy", _models("area/none/none", "polar/none/none"),
              _doubled(3600, 5), 0, energy_changes, gas, moments=100),
    ]
}
