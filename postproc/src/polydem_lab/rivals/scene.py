"""A scene that every code can be given: convex polygons, gravity, friction, restitution.

Sizes are about 1 m, for which Box2D and Rapier are made. polydem knows no scale: with E = 1e9 N/m2 these bodies
are as stiff under their weight as grains of 1 cm with E = 1e7 (E/(density g size) = 4e4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

#: Density [kg/m2], acceleration of gravity [m/s2]
DENSITY, GRAVITY = 2500.0, 9.81

#: Columns of the states of a body
X, Y, ANGLE, VX, VY, SPIN = range(6)


@dataclass(frozen=True)
class Body:
    """A convex polygon, anticlockwise, by its vertices about its centroid."""

    vertices: tuple
    x: float = 0.0
    y: float = 0.0
    angle: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    spin: float = 0.0
    fixed: bool = False

    def corners(self) -> np.ndarray:
        """Its vertices where it is at the start."""
        return turned(self.vertices, self.angle) + np.array([self.x, self.y])


@dataclass(frozen=True)
class Scene:
    """What happens, and when it is looked at."""

    bodies: tuple
    #: Simulated time [s], and how often states are taken in it beside the start
    duration: float
    samples: int
    gravity: tuple = (0.0, -GRAVITY)
    friction: float = 0.0
    #: Restitution of impacts; None where it does not matter: 0 for rivals, its default for polydem
    restitution: float | None = None
    density: float = DENSITY

    @property
    def free(self) -> list[int]:
        """Numbers of the bodies that move."""
        return [k for k, body in enumerate(self.bodies) if not body.fixed]


def turned(vertices, angle: float) -> np.ndarray:
    """Points turned about the origin."""
    c, s = math.cos(angle), math.sin(angle)
    return np.asarray(vertices, dtype=float) @ np.array([[c, s], [-s, c]])


def box(width: float, height: float, **place) -> Body:
    """A rectangle."""
    a, b = width / 2.0, height / 2.0
    return Body(((-a, -b), (a, -b), (a, b), (-a, b)), **place)


def regular(count: int, diameter: float, **place) -> Body:
    """A regular polygon with its corners on a circle."""
    around = 2.0 * math.pi * np.arange(count) / count
    return Body(tuple(zip(np.cos(around) * diameter / 2.0, np.sin(around) * diameter / 2.0)), **place)


def wall(left: float, right: float, low: float, high: float) -> Body:
    """A fixed rectangle between four coordinates."""
    return replace(box(right - left, high - low), x=(left + right) / 2.0, y=(low + high) / 2.0, fixed=True)


def floor(width: float, centre: float = 0.0) -> Body:
    """A fixed rectangle below y = 0."""
    return wall(centre - width / 2.0, centre + width / 2.0, -2.0, 0.0)


def slope(angle: float) -> tuple:
    """Gravity on a level floor that stands for one inclined by an angle, down to the right."""
    return GRAVITY * math.sin(angle), -GRAVITY * math.cos(angle)


def area_and_inertia(vertices) -> tuple:
    """Area of a polygon about its centroid, and its second moment."""
    x, y = np.asarray(vertices, dtype=float).T
    x1, y1 = np.roll(x, -1), np.roll(y, -1)
    cross = x * y1 - x1 * y
    return cross.sum() / 2.0, (cross * (x * x + x * x1 + x1 * x1 + y * y + y * y1 + y1 * y1)).sum() / 12.0


def kinetic(states: np.ndarray, scene: Scene) -> np.ndarray:
    """Kinetic energy at each sample, translation and rotation, (samples, 2)."""
    free = scene.free
    moments = scene.density * np.array([area_and_inertia(scene.bodies[k].vertices) for k in free])
    moving = states[:, free]
    squares = moving[:, :, VX] ** 2 + moving[:, :, VY] ** 2, moving[:, :, SPIN] ** 2
    return np.stack([0.5 * square @ moment for square, moment in zip(squares, moments.T)], axis=1)
