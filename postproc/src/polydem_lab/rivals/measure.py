"""Measuring a point: the error and the time of a code with certain settings in a problem."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .problems import Problem, Threshold
from .runs import RunError
from .scene import Scene

#: A run is repeated until its processor time is this, so that the clock can see it [s]
LEAST_SECONDS = 0.05

#: Bisections of the distance from the right answer of a threshold, in powers of ten; the nearest that is tried
BISECTIONS, NEAREST = 5, -4.0


@dataclass(frozen=True)
class Measured:
    """What a measurement says."""

    #: Error, or value of a collective problem; NaN if only the time was measured
    error: float
    #: Processor seconds per simulated second of each repetition
    seconds: tuple
    #: Steps per simulated second
    steps: float
    #: Load of a threshold at which the time was measured
    load: float


def measure(run, problem: Problem, knobs: dict, seed: int, patience: float, load: float = math.nan) -> Measured:
    """Error and time; with the load of a threshold that was found before, the time alone."""
    if isinstance(problem, Threshold):
        found = threshold(run, problem, knobs, patience) if math.isnan(load) else load
        scene, error = problem.scene(found), abs(found - 1.0) if math.isnan(load) else math.nan
    else:
        scene, found, error = problem.scene(seed), math.nan, math.nan
    done = run(scene, knobs, LEAST_SECONDS, patience)
    if not isinstance(problem, Threshold):
        error = problem.error(done.states, scene)
        if not math.isfinite(error):
            raise RunError("what is measured did not happen")
    return Measured(error, tuple(each / scene.duration for each in done.seconds), done.steps / scene.duration, found)


def threshold(run, problem: Threshold, knobs: dict, patience: float) -> float:
    """Greatest load at which bodies stay, as a share of the right answer.

    A load of 1 tells the side; on this side the logarithm of the distance from 1 is bisected, so that small errors are
    found as well as large ones.
    """

    def stays(load: float) -> bool:
        scene: Scene = problem.scene(load)
        return problem.error(run(scene, knobs, 0.0, patience).states, scene)

    too_strong = stays(1.0)
    near, far = NEAREST, 0.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (near + far)
        if stays(1.0 + 10.0**middle if too_strong else 1.0 - 10.0**middle) == too_strong:
            near = middle
        else:
            far = middle
    distance = 10.0 ** (0.5 * (near + far))
    return 1.0 + distance if too_strong else 1.0 - distance
