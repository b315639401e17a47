"""The problems: scenes, what is measured, and the right answer of rigid bodies.

A problem is one of three kinds. A `Problem` has one scene and an error of its states. A `Threshold` asks for the
greatest load at which bodies stay where they are; its scenes have a share of the right answer as load. A
`Collective` has a value of which the mean over seeds is compared, with the mean of the rivals at their finest steps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Callable

import numpy as np

from .collectives import (
    dense_scene,
    energy_error,
    flow,
    gas_scene,
    greatest_depth,
    hopper_scene,
    train_scene,
    train_speed_error,
)
from .scene import ANGLE, SPIN, VX, Scene, X, Y, box, floor, slope, turned


@dataclass(frozen=True)
class Problem:
    """A scene and the error of its states."""

    name: str
    title: str
    #: What the error is an error of, for axes and tables
    measured: str
    #: seed -> scene
    scene: Callable
    #: (states, scene) -> error
    error: Callable
    #: Errors below this are not judged: the answer is not known better
    floor: float = 0.0
    seeds: tuple = (1,)
    #: Least and greatest exponent of the stiffnesses of polydem, and of the refinements of rivals (2**n)
    stiffness: tuple = (7, 12)
    refinement: int = 8
    #: Whether the error is also sought with smaller steps of polydem at one stiffness
    finer_steps: bool = False
    #: Whether a short study has it
    quick: bool = True


@dataclass(frozen=True)
class Threshold(Problem):
    """A load at which bodies begin to move; `error` has the states and says whether they stayed."""


@dataclass(frozen=True)
class Collective(Problem):
    """A value whose mean over seeds is compared; `error` gives the value."""


# --- sliding -----------------------------------------------------------------------------------------------------


def sliding(angle: float, friction: float, duration: float) -> Scene:
    """A block of 2 x 1 on a slope."""
    return Scene((box(2.0, 1.0, y=0.5), floor(60.0)), duration, 4, slope(angle), friction)


def slid(states: np.ndarray) -> float:
    """Way of the first body."""
    return float(states[-1, 0, X] - states[0, 0, X])


def slide_way(scene: Scene) -> float:
    """Way of a rigid block from rest."""
    along, across = scene.gravity
    return 0.5 * (along + scene.friction * across) * scene.duration**2


# --- impacts -----------------------------------------------------------------------------------------------------


def gaps(count: int = 16) -> np.ndarray:
    """Distances that are evenly spread over the steps of any size (golden section) [m]."""
    return 0.2 + 0.1 * np.mod(np.arange(count) * 0.5 * (math.sqrt(5.0) - 1.0), 1.0)


def faces(restitution: float) -> Scene:
    """Pairs of squares that meet face to face at 2 m/s."""
    bodies = []
    for k, gap in enumerate(gaps()):
        bodies += [box(1.0, 1.0, x=side * (0.5 + gap / 2.0), y=5.0 * k, vx=-side) for side in (-1.0, 1.0)]
    return Scene(tuple(bodies), 1.0, 2, (0.0, 0.0), 0.0, restitution)


def faces_error(states: np.ndarray, scene: Scene) -> float:
    """Root mean square error of the velocities afterwards."""
    after = states[-1, :, VX] + scene.restitution * states[0, :, VX]
    return float(np.sqrt(np.mean(after**2)))


#: Tilt of the squares that fall on a corner [rad], and their velocity downwards [m/s]
TILT, FALL = math.radians(25.0), 1.0


def after_corner(restitution: float, friction: float, speed: float) -> np.ndarray:
    """Velocities of a unit square (mass 1, inertia 1/6) after its lowest corner hit a floor, slipping all the time.

    The impulse is j (-friction, 1): the corner's normal velocity changes by j (1/m + x^2/I + friction x y/I).
    """
    corners = turned(box(1.0, 1.0).vertices, TILT)
    x, y = corners[np.argmin(corners[:, 1])]
    pull = friction * math.copysign(1.0, speed)
    impulse = (1.0 + restitution) * FALL / (1.0 + 6.0 * x * x + 6.0 * pull * x * y)
    return np.array([speed - pull * impulse, impulse - FALL, 6.0 * impulse * (x + pull * y)])


def corners_scene(restitution: float, friction: float, speed: float) -> Scene:
    """Squares that fall on a corner each, without gravity."""
    low = turned(box(1.0, 1.0).vertices, TILT)[:, 1].min()
    bodies = [box(1.0, 1.0, x=6.0 * k, y=gap - low, angle=TILT, vx=speed, vy=-FALL) for k, gap in enumerate(gaps())]
    return Scene((*bodies, floor(200.0, 45.0)), 0.4, 2, (0.0, 0.0), friction, restitution)


def corners_error(states: np.ndarray, scene: Scene) -> float:
    """Root mean square error of the velocities afterwards, of rotation at half of the side."""
    after = states[-1, :-1, VX : SPIN + 1]
    wanted = after_corner(scene.restitution or 0.0, scene.friction, float(states[0, 0, VX]))
    return float(np.sqrt(np.mean((((after - wanted) * [1.0, 1.0, 0.5]) ** 2).sum(axis=1))))


# --- rest --------------------------------------------------------------------------------------------------------


def stack_scene(_: int) -> Scene:
    """Ten unit squares one on the other, up to 2 % beside each other."""
    beside = np.random.default_rng(1).uniform(-0.02, 0.02, 10)
    return Scene((*(box(1.0, 1.0, x=x, y=0.5 + k) for k, x in enumerate(beside)), floor(30.0)), 20.0, 8, friction=0.5)


def stack_error(states: np.ndarray, scene: Scene) -> float:
    """Greatest displacement of a block, of rotation at half of the side."""
    moved = (states[-1] - states[0])[scene.free][:, [X, Y, ANGLE]] * [1.0, 1.0, 0.5]
    return float(np.sqrt((moved**2).sum(axis=1)).max())


def topple_scene(share: float) -> Scene:
    """A block of 1 x 4 on a slope of a share of the tangent 1/4."""
    return Scene((box(1.0, 4.0, y=2.0), floor(30.0)), 5.0, 4, slope(math.atan(0.25 * share)), 1.0)


#: The ladder: length, thickness [m], coefficient of friction, by which it stands
LENGTH, THICK, GRIP = 4.0, 0.1, 0.3


def ladder_corners(cotangent: float) -> tuple:
    """Centre, foot, head and angle of a ladder against the wall x = 0, by the cotangent of its angle from the floor."""
    angle = math.atan2(1.0, cotangent)
    corners = turned(box(LENGTH, THICK).vertices, angle)
    shift = np.array([-corners[:, 0].max(), -corners[:, 1].min()])
    return shift, corners[np.argmin(corners[:, 1])] + shift, corners[np.argmax(corners[:, 0])] + shift, angle


def ladder_answer() -> float:
    """Greatest cotangent at which a ladder stands: foot and head both at the limit of friction (statics)."""

    def margin(cotangent: float) -> float:
        centre, foot, head, _ = ladder_corners(cotangent)
        arm, (wide, high) = centre[0] - foot[0], head - foot
        return GRIP * (high + GRIP * wide) - arm * (1.0 + GRIP * GRIP)

    low, high = 0.1, 2.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if margin(middle) > 0.0 else (low, middle)
    return low


def ladder_scene(share: float) -> Scene:
    """A ladder between floor and wall, at a share of the greatest cotangent."""
    (x, y), _, _, angle = ladder_corners(share * ladder_answer())
    against = replace(box(2.0, 20.0), x=1.0, y=10.0, fixed=True)
    return Scene((box(LENGTH, THICK, x=x, y=y, angle=angle), floor(40.0), against), 4.0, 4, friction=GRIP)


def lean_scene(share: float, count: int = 5) -> Scene:
    """Blocks that lean over by a share of the greatest offset, 1/count each."""
    blocks = (box(1.0, 1.0, x=k * share / count, y=0.5 + k) for k in range(count))
    return Scene((*blocks, floor(30.0)), 5.0, 4, friction=0.8)


def stays_upright(states: np.ndarray, _: Scene) -> bool:
    """Whether the first body has hardly turned."""
    return bool(abs(states[-1, 0, ANGLE]) < 0.2)


def stays_in_place(states: np.ndarray, _: Scene) -> bool:
    """Whether the first body stays where it was after a quarter of the time."""
    return bool(np.hypot(*(states[-1, 0, :Y + 1] - states[1, 0, :Y + 1])) < 0.03)


def stays_high(states: np.ndarray, scene: Scene) -> bool:
    """Whether no body has sunk."""
    return bool(np.abs(states[-1, scene.free, Y] - states[0, scene.free, Y]).max() < 0.2)


#: Slope and friction of the sliding block; friction of the creeping one
SLOPE, SLIDING, CREEPING = math.radians(30.0), 0.5, 0.5

#: Nothing falls within the time of a run at a load nearer to the limit
UNSEEN = 2e-4

#: polydem runs the plastic impacts of the dominoes with a small restitution, which changes their speed by 2 %
LOOSE = 3e-2

PROBLEMS = {each.name: each for each in (
    Problem("slide", "block slides down a slope of 30 degrees for 2 s", "way",
            lambda seed: sliding(SLOPE, SLIDING, 2.0),
            lambda states, scene: abs(slid(states) / slide_way(scene) - 1.0), stiffness=(7, 13)),
    Problem("creep", "block at 0.98 of the limit of friction for 10 s", "way, block heights",
            lambda seed: sliding(math.atan(0.98 * CREEPING), CREEPING, 10.0),
            lambda states, scene: abs(slid(states)), stiffness=(7, 11)),
    Problem("headon_elastic", "faces meet head-on, e = 1", "velocity", lambda seed: faces(1.0), faces_error,
            finer_steps=True),
    Problem("headon_half", "faces meet head-on, e = 0.5", "velocity", lambda seed: faces(0.5), faces_error,
            finer_steps=True),
    Problem("corner_smooth", "corner on a floor, e = 0.5, smooth", "velocities",
            lambda seed: corners_scene(0.5, 0.0, 0.0), corners_error, finer_steps=True),
    Problem("corner_elastic", "corner on a floor, e = 1, smooth", "velocities",
            lambda seed: corners_scene(1.0, 0.0, 0.0), corners_error, finer_steps=True),
    Problem("corner_slip", "corner on a floor, e = 0.5, friction 0.2, slips", "velocities",
            lambda seed: corners_scene(0.5, 0.2, 2.0), corners_error),
    Problem("stack", "stack of ten squares for 20 s", "greatest displacement, sides", stack_scene, stack_error,
            stiffness=(8, 11), refinement=5),
    Threshold("topple", "block of 1 x 4: slope at which it topples", "tangent", topple_scene, stays_upright, UNSEEN,
              stiffness=(8, 12), refinement=6),
    Threshold("ladder", "ladder: slope at which it slips", "cotangent", ladder_scene, stays_in_place, UNSEEN,
              stiffness=(7, 10), refinement=6),
    Threshold("lean", "leaning stack of five: offset at which it falls", "offset", lean_scene, stays_high, UNSEEN,
              stiffness=(8, 11), refinement=5),
    Problem("gas", "elastic gas of 100 hexagons for 2 s", "energy", gas_scene, energy_error, seeds=(1, 2, 3, 4, 5),
            refinement=7, finer_steps=True),
    Problem("domino", "row of 30 dominoes", "speed of the wave", train_scene, train_speed_error, LOOSE,
            stiffness=(7, 10), refinement=5),
    Collective("hopper", "500 hexagons leave a hopper", "flow", hopper_scene, flow, seeds=tuple(range(1, 9)),
               stiffness=(7, 9), refinement=3, quick=False),
    Problem("dense", "2000 hexagons settle for 4 s", "greatest depth, diameters", dense_scene, greatest_depth,
            stiffness=(7, 9), refinement=2, quick=False),
)}
