"""Speed against error: what the samples of a study say.

The error of a run is its distance from the converged solution of the same model (quadruple precision, far smaller
steps): the error of the integration. What the model itself is wrong by is the distance of the converged solution from
theory, and stands apart.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from polydem_post.base.result_file import ResultError

from .samples import PRECISIONS, REFERENCE, Choice, Sample, read_samples
from .scenes import SCENES, Model

#: Errors for which the fastest choice is sought
ERRORS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5)

#: Times that differ by less than this are not told apart
TIE = 1.1

#: The reference must be so many times more exact than an error from which an order is fitted
MARGIN = 10.0


@dataclass(frozen=True)
class Point:
    """One choice: its error and its cost."""

    choice: Choice
    #: Time step [s]
    dt: float
    #: Greatest share of the stable step of the contacts
    share: float
    #: Error: root of the mean square over the items, and that of the worst item
    rms: float
    worst: float
    #: Root of the mean square at each moment
    growth: tuple
    #: Seconds of stepping per simulated second: least and median of the repeats
    least: float
    median: float
    repeats: int


@dataclass(frozen=True)
class Curve:
    """All points of a scene, a model, numerics and a precision, from the largest step to the smallest."""

    scene: str
    model: str
    numerics: str
    precision: str
    points: tuple

    def time_for(self, error: float) -> tuple | None:
        """Seconds per simulated second, dt and share of the stable step at which the error is reached, and stays so.

        Interpolated between the last point that misses it and the first from which on all reach it; nothing is
        extrapolated.
        """
        reached = len(self.points)
        while reached > 0 and self.points[reached - 1].rms <= error:
            reached -= 1
        if reached == len(self.points):
            return None
        fine = self.points[reached]
        if reached == 0:
            return fine.least, fine.dt, fine.share
        coarse = self.points[reached - 1]
        part = math.log(error / coarse.rms) / math.log(max(fine.rms, 1e-300) / coarse.rms)
        return tuple(
            math.exp(math.log(a) + part * math.log(b / a)) if a > 0.0 and b > 0.0 else math.nan
            for a, b in ((coarse.least, fine.least), (coarse.dt, fine.dt), (coarse.share, fine.share))
        )

    def order(self, floor: float, worst: bool = False) -> float:
        """Exponent of the error over the step, by least squares over all points well above the floor."""
        kept = [(p.dt, p.worst if worst else p.rms) for p in self.points]
        kept = [(dt, error) for dt, error in kept if error > MARGIN * floor and math.isfinite(error)]
        if len(kept) < 3:
            return math.nan
        steps, errors = np.log(np.array(kept)).T
        return float(np.polyfit(steps, errors, 1)[0])


@dataclass(frozen=True)
class Reference:
    """The converged solution of a model."""

    values: np.ndarray
    #: How exact it is: its distance from the one with twice the step, as an error
    floor: float
    floor_worst: float


class WorkPrecision:
    """Errors and times of a study."""

    def __init__(self, samples: list):
        self.samples = [sample for sample in samples if sample.scene in SCENES]
        if not self.samples:
            raise ResultError("there are no samples of the scenes of ./polydem workprecision")
        self.scenes = [name for name in SCENES if any(sample.scene == name for sample in self.samples)]
        self.references = self._references()
        self.curves = self._curves()

    def models_of(self, scene: str) -> list[str]:
        """Models of a scene for which there are curves, in the order of the matrix."""
        found = {curve.model for curve in self.curves if curve.scene == scene}
        return [model.name for model in SCENES[scene].models if model.name in found]

    def curves_of(self, scene: str, model: str) -> list[Curve]:
        """Curves of a scene and a model."""
        return [curve for curve in self.curves if (curve.scene, curve.model) == (scene, model)]

    def floor(self, scene: str, model: str) -> float:
        """Errors below this are those of the reference; 0 if the exact result is known."""
        reference = self.references.get((scene, model))
        return reference.floor if reference else 0.0

    def left_out(self) -> list[Sample]:
        """One sample for each scene, model and numerics that the program refused."""
        found: dict = {}
        for sample in self.samples:
            if sample.status == "refused":
                found.setdefault((sample.scene, sample.model, sample.numerics), sample)
        return list(found.values())

    def stopped(self) -> dict:
        """(scene, model, numerics, precision) -> numbers of steps with which a guard stopped the run."""
        found: dict = {}
        for sample in self.samples:
            if sample.status == "stopped" and sample.precision in PRECISIONS:
                key = (sample.scene, sample.model, sample.numerics, sample.precision)
                found.setdefault(key, set()).add(sample.steps)
        return {key: sorted(steps) for key, steps in found.items()}

    def _references(self) -> dict:
        found: dict = {}
        for sample in self.samples:
            if sample.precision == REFERENCE and sample.status == "finished" and sample.result:
                found.setdefault((sample.scene, sample.model), {})[sample.steps] = sample.values
        references = {}
        for key, runs in found.items():
            if len(runs) > 1:
                finest, coarser = (runs[steps] for steps in sorted(runs, reverse=True)[:2])
                rms, worst, _ = errors_of(coarser, finest)
                references[key] = Reference(finest, rms, worst)
        return references

    def _curves(self) -> list[Curve]:
        runs: dict = {}
        for sample in self.samples:
            if sample.status == "finished" and sample.precision in PRECISIONS:
                runs.setdefault(sample.choice, []).append(sample)
        points: dict = {}
        for choice, repeats in runs.items():
            point = self._point(choice, repeats)
            if point is not None:
                points.setdefault((choice.scene, choice.model, choice.numerics, choice.precision), []).append(point)
        return [Curve(scene, model, numerics, precision, tuple(sorted(found, key=lambda p: -p.dt)))
                for (scene, model, numerics, precision), found in points.items()]

    def _point(self, choice: Choice, repeats: list) -> Point | None:
        measured = next((sample.values for sample in repeats if sample.result), None)
        known = self.references.get((choice.scene, choice.model))
        if measured is None or (known is None and SCENES[choice.scene].reference > 0):
            return None
        rms, worst, growth = errors_of(measured, known.values if known else None)
        duration = repeats[0].duration
        cost = [sample.seconds / duration for sample in repeats]
        return Point(choice, duration / choice.steps, repeats[0].share, rms, worst, growth, min(cost),
                     float(np.median(cost)), len(cost))


def errors_of(values: np.ndarray, reference: np.ndarray | None) -> tuple:
    """Error of the last moment, rms and worst over the items, and rms at each moment.

    Without a reference the values are errors themselves, and all moments count; those that are NaN do not.
    """
    distance = np.sqrt(np.sum((values - (0.0 if reference is None else reference)) ** 2, axis=2))
    growth = tuple(np.sqrt(np.mean(distance**2, axis=1)).tolist())
    counted = distance[~np.isnan(distance)] if reference is None else distance[-1]
    if counted.size == 0:
        return math.nan, math.nan, growth
    return float(np.sqrt(np.mean(counted**2))), float(np.max(counted)), growth


def read_study(folder: Path) -> WorkPrecision:
    """What the samples in a folder say."""
    return WorkPrecision(read_samples(folder))


def fastest(curves: list, error: float) -> tuple | None:
    """(curve, seconds per simulated second, dt, share) of the fastest curve that reaches an error."""
    found = [(curve, *reached) for curve in curves if (reached := curve.time_for(error)) is not None]
    return min(found, key=lambda each: each[1], default=None)


def model_of(name: str) -> Model:
    """A model by its name."""
    return Model(*name.split("/"))
