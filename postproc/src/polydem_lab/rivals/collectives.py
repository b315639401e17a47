"""Problems of many bodies: an elastic gas, a row of dominoes, a hopper and a settling heap."""

from __future__ import annotations

import math

import numpy as np

from .scene import ANGLE, Scene, X, Y, box, floor, kinetic, regular, turned, wall

#: Thickness of walls [m]
THICK = 4.0


# --- gas ---------------------------------------------------------------------------------------------------------


def gas_scene(seed: int, count: int = 100, speed: float = 5.0, fraction: float = 0.3) -> Scene:
    """Hexagons in a box, with velocities of a Maxwell distribution and the root mean square `speed`."""
    random = np.random.default_rng(seed)
    side = math.sqrt(count * 0.375 * math.sqrt(3.0) / fraction)
    row = math.isqrt(count)
    velocity = random.normal(size=(count, 2))
    velocity -= velocity.mean(axis=0)
    velocity *= speed / np.sqrt((velocity**2).sum(axis=1).mean())
    bodies = [regular(6, 1.0, x=(k % row + 0.5) * side / row, y=(k // row + 0.5) * side / row,
                      angle=random.uniform(0.0, 1.0), vx=velocity[k, 0], vy=velocity[k, 1]) for k in range(count)]
    far = side + THICK
    walls = (wall(-THICK, far, -THICK, 0.0), wall(-THICK, far, side, far), wall(-THICK, 0.0, 0.0, side),
             wall(side, far, 0.0, side))
    return Scene((*bodies, *walls), 2.0, 200, (0.0, 0.0), 0.0, 1.0)


def energy_error(states: np.ndarray, scene: Scene) -> float:
    """Change of the kinetic energy over the run.

    Soft contacts hold a part of it for a moment, so the greatest of the last fifth counts, when the fewest touch.
    """
    energy = kinetic(states, scene).sum(axis=1)
    return abs(float(energy[-len(energy) // 5 :].max() / energy[0]) - 1.0)


# --- dominoes ----------------------------------------------------------------------------------------------------

#: Number, width, height and gap of the dominoes [m]; angle at which one counts as fallen [rad]
DOMINOES, WIDTH, HEIGHT, GAP, FALLEN = 30, 0.2, 1.0, 0.3, 0.15

#: Between these two the speed is measured; limit of three rivals (Chipmunk, Box2D v3, Rapier) at fine steps [m/s]
FIRST, LAST, SPEED = 10, 25, 4.235


def train_scene(_: int) -> Scene:
    """A row of dominoes, the first of which falls."""
    tilt, spin = math.radians(-15.0), -2.0
    corners = turned(box(WIDTH, HEIGHT).vertices, tilt)
    x, y = corners[1]  # the foot about which it turns, at rest
    first = box(WIDTH, HEIGHT, x=-x + WIDTH / 2.0, y=-corners[:, 1].min(), angle=tilt, vx=y * spin, vy=-x * spin,
                spin=spin)
    others = (box(WIDTH, HEIGHT, x=k * (GAP + WIDTH), y=HEIGHT / 2.0) for k in range(1, DOMINOES))
    return Scene((first, *others, floor(80.0, 5.0)), 3.5, 420, friction=0.2, restitution=0.0)


def train_speed(states: np.ndarray, scene: Scene) -> float:
    """Speed of the wave; NaN if it does not arrive."""
    times = np.linspace(0.0, scene.duration, scene.samples + 1)
    passed = []
    for domino in (FIRST, LAST):
        fallen = -states[:, domino, ANGLE]
        sample = int(np.argmax(fallen > FALLEN))
        if sample == 0:
            return math.nan
        passed.append(np.interp(FALLEN, fallen[sample - 1 : sample + 1], times[sample - 1 : sample + 1]))
    return (LAST - FIRST) * (GAP + WIDTH) / (passed[1] - passed[0])


def train_speed_error(states: np.ndarray, scene: Scene) -> float:
    """Error of the speed of the wave."""
    return abs(train_speed(states, scene) / SPEED - 1.0)


# --- hopper ------------------------------------------------------------------------------------------------------


def hopper_scene(seed: int, count: int = 500, opening: float = 7.0, width: float = 24.0) -> Scene:
    """Hexagons that fall into a box with an opening in its flat bottom."""
    random = np.random.default_rng(seed)
    columns = int(width / 1.1)
    grains = [regular(6, random.uniform(0.9, 1.1), x=(k % columns + 0.6) * width / columns,
                      y=0.7 + 1.12 * (k // columns), angle=random.uniform(0.0, 1.05)) for k in range(count)]
    left, right = (width - opening) / 2.0, (width + opening) / 2.0
    walls = (wall(-THICK, left, -1.0, 0.0), wall(right, width + THICK, -1.0, 0.0), wall(-THICK, 0.0, 0.0, 60.0),
             wall(width, width + THICK, 0.0, 60.0))
    return Scene((*grains, *walls), 9.0, 180, friction=0.4, restitution=0.3)


def flow(states: np.ndarray, scene: Scene) -> float:
    """Grains per second that leave, between a fifth and three fifths of them; NaN if fewer leave."""
    free = scene.free
    left = (states[:, free, Y] < -1.0).sum(axis=1)
    share = np.array([0.2, 0.6]) * len(free)
    if left[-1] < share[1]:
        return math.nan
    times = np.linspace(0.0, scene.duration, scene.samples + 1)
    begin, end = np.interp(share, left + 1e-9 * np.arange(len(left)), times)
    return float((share[1] - share[0]) / (end - begin))


# --- settling ----------------------------------------------------------------------------------------------------


def dense_scene(seed: int, count: int = 2000, width: float = 48.0) -> Scene:
    """Hexagons that settle in a box."""
    random = np.random.default_rng(seed + 4)
    columns = int(width / 1.08)
    grains = [regular(6, 1.0, x=(k % columns + 0.55) * width / columns, y=0.6 + 1.05 * (k // columns),
                      angle=random.uniform(0.0, 1.05)) for k in range(count)]
    walls = (wall(-THICK, width + THICK, -THICK, 0.0), wall(-THICK, 0.0, 0.0, 200.0),
             wall(width, width + THICK, 0.0, 200.0))
    return Scene((*grains, *walls), 4.0, 8, friction=0.4)


def greatest_depth(states: np.ndarray, scene: Scene) -> float:
    """Greatest depth of two hexagons, or of one and a wall, at any sample but the start."""
    free = scene.free
    shapes = np.array([scene.bodies[k].vertices for k in free])
    walls = [scene.bodies[k].corners() for k in range(len(scene.bodies)) if k not in set(free)]
    deepest = 0.0
    for moment in states[1:, free]:
        c, s = np.cos(moment[:, ANGLE]), np.sin(moment[:, ANGLE])
        turn = np.stack([np.stack([c, s], 1), np.stack([-s, c], 1)], 1)
        corners = shapes @ turn + moment[:, None, : Y + 1]
        deepest = max(deepest, _pair_depth(corners, moment[:, : Y + 1]), _wall_depth(corners, walls))
    return deepest


def _pair_depth(corners: np.ndarray, centres: np.ndarray, reach: float = 1.05) -> float:
    """Greatest depth of two convex polygons along the directions of their edges (separating axes)."""
    first, second = close_pairs(centres, reach)
    depth = np.full(len(first), np.inf)
    for one, other in ((first, second), (second, first)):
        for k in range(corners.shape[1]):
            begin, end = corners[one, k], corners[one, (k + 1) % corners.shape[1]]
            edge = end - begin
            normal = np.stack([edge[:, 1], -edge[:, 0]], 1) / np.hypot(*edge.T)[:, None]
            apart = np.einsum("kij,kj->ki", corners[other] - begin[:, None], normal).min(axis=1)
            depth = np.minimum(depth, -apart)
    return float(max(depth.max(initial=0.0), 0.0))


def close_pairs(points: np.ndarray, reach: float) -> tuple:
    """Numbers of all pairs of points that are closer than `reach`: from strips of the points in the order of x."""
    order = np.argsort(points[:, X])
    x = points[order, X]
    found: list = [[], []]
    ends = np.searchsorted(x, x + reach)
    for k, end in enumerate(ends):
        near = order[k + 1 : end]
        near = near[np.hypot(*(points[near] - points[order[k]]).T) < reach]
        found[0] += [int(order[k])] * len(near)
        found[1] += near.tolist()
    return np.array(found[0], dtype=int), np.array(found[1], dtype=int)


def _wall_depth(corners: np.ndarray, walls: list) -> float:
    """Greatest depth of a polygon in a wall along the axes."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    depth = 0.0
    for each in walls:
        inside = np.minimum(each.max(axis=0) - low, high - each.min(axis=0)).min(axis=1)
        depth = max(depth, float(inside.max(initial=0.0)))
    return depth
