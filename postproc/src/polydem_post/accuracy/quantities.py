"""What accuracy is measured of: columns of the series, bodies, the centre of all bodies, flow through a line."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..analysis import flow_rate
from ..base.result_file import ResultError
from ..read.frames import Frame
from ..read.trajectory import Trajectory

#: What a body and the centre of all bodies have
OF_BODY, OF_CENTRE = ("x", "y", "angle", "vx", "vy", "spin"), ("x", "y")

BODY = re.compile(rf"body\.(\d+)\.({'|'.join(OF_BODY)})")
CENTRE = re.compile(rf"centre\.({'|'.join(OF_CENTRE)})")
FLOW = re.compile(r"flow:(.+)")
UNITS = {"x": "m", "y": "m", "angle": "rad", "vx": "m/s", "vy": "m/s", "spin": "rad/s"}

#: How a quantity is written, for messages
KNOWN = ("a column of the series such as kinetic_energy, or COLUMN:mean; body.ID." + "|".join(OF_BODY)
         + "; centre.x|y; flow:X1,Y1,X2,Y2")

#: Scenes of at most so many free bodies are judged by each of them
FEW = 3


@dataclass(frozen=True)
class Quantity:
    """A number that a window gives, in SI units, and the scale of its error."""

    name: str
    unit: str
    value: Callable[[Trajectory], float]
    scale: Callable[[Trajectory], float]


def parse(word: str, run: Trajectory) -> Quantity:
    """The quantity of a word such as body.1.x, kinetic_energy:mean or flow:-0.03,0,0.03,0; =SCALE may follow."""
    name, equals, given = word.partition("=")
    found = _named(name, run)
    if not equals:
        return found
    try:
        scale = float(given)
    except ValueError:
        scale = math.nan
    if not 0.0 < scale < math.inf:
        raise ResultError(f"--quantity {word}: the scale '{given}' is not a number above 0")
    return Quantity(name, found.unit, found.value, lambda run: scale)


def _named(name: str, run: Trajectory) -> Quantity:
    if match := BODY.fullmatch(name):
        identifier, what = int(match[1]), match[2]
        _row(run[0], identifier)
        return Quantity(name, UNITS[what], lambda run: _body(run, identifier, what)[-1],
                        lambda run: _scale_of_body(run, identifier, what))
    if match := CENTRE.fullmatch(name):
        axis = OF_CENTRE.index(match[1])
        return Quantity(name, "m", lambda run: float(_ways(run[0], run[-1])[0][axis]), _scale_of_centre)
    if match := FLOW.fullmatch(name):
        start, end = _line(name, match[1])
        return Quantity(name, "kg/m", lambda run: float(flow_rate(run, start, end).mass.sum()),
                        lambda run: float(np.abs(np.cumsum(flow_rate(run, start, end).mass)).max()))
    column, _, mean = name.partition(":")
    units = {**run.balance_units, **run.time_series_units}
    if column not in units or column in ("time", "step") or mean not in ("", "mean"):
        raise ResultError(f"--quantity {name}: there is no such quantity; there are {KNOWN}. Columns here: "
                          f"{', '.join(key for key in units if key not in ('time', 'step'))}")
    take = _mean if mean else _last
    return Quantity(name, units[column], lambda run: take(run, column),
                    lambda run: float(np.nanmax(np.abs(_column(run, column)))))


def usual_quantities(run: Trajectory) -> list[str]:
    """What is judged if nothing is named."""
    first = run[0]
    identifiers = first.id[first.free]
    if 0 < len(identifiers) <= FEW:
        return [f"body.{identifier}.{what}" for identifier in identifiers for what in ("x", "y", "angle")]
    return ["centre.x", "centre.y", "kinetic_energy:mean",
            *(f"{name}.mass" for name in run.settings.get("sink", {}))]


def horizon(run: Trajectory, others: list[Trajectory], tolerance: float) -> float | None:
    """Time of the last frame before free bodies differ between windows [s]; None: they do not.

    They differ if one is further from itself in another window than the tolerance times its diameter.
    """
    before = 0.0
    for number, frame in enumerate(run):
        for other in others:
            theirs = other[number]
            common, mine, their = np.intersect1d(frame.id, theirs.id, return_indices=True)
            way = np.hypot(*(frame.unwrapped[mine] - theirs.unwrapped[their]).T)
            turn = np.abs(frame.angle[mine] - theirs.angle[their]) * frame.radius[mine]
            share = np.maximum(way, turn) / (2.0 * frame.radius[mine])
            if len(common) < max(len(frame), len(theirs)) or np.any(share[frame.free[mine]] > tolerance):
                return before
        before = float(frame.time)
    return None


def _line(name: str, text: str) -> tuple[list[float], list[float]]:
    try:
        x1, y1, x2, y2 = (float(word) for word in text.split(","))
    except ValueError as error:
        raise ResultError(f"--quantity {name}: a line has four numbers, flow:X1,Y1,X2,Y2") from error
    if (x1, y1) == (x2, y2):
        raise ResultError(f"--quantity {name}: the line has no length")
    return [x1, y1], [x2, y2]


def _row(frame: Frame, identifier: int) -> int:
    found = np.flatnonzero(frame.id == identifier)
    if not len(found):
        raise ResultError(f"--quantity body.{identifier}: there is no such body at {frame.time:g} s")
    return int(found[0])


def _body(run: Trajectory, identifier: int, what: str, only_ends: bool = True) -> list[float]:
    """Way, turn or velocity of a body in the last frame, or in all frames."""
    first = run[0]
    row = _row(first, identifier)
    found = []
    for frame in [run[-1]] if only_ends else run:
        here = _row(frame, identifier)
        if what in ("x", "y"):
            axis = OF_CENTRE.index(what)
            found.append(float(frame.unwrapped[here, axis] - first.unwrapped[row, axis]))
        elif what in ("vx", "vy"):
            found.append(float(frame.velocity[here, ("vx", "vy").index(what)]))
        elif what == "angle":
            found.append(float(frame.angle[here] - first.angle[row]))
        else:
            found.append(float(frame.angular_velocity[here]))
    return found


def _scale_of_body(run: Trajectory, identifier: int, what: str) -> float:
    """The greatest way, or speed, of the body or of its rim by its rotation; over its radius for angles."""
    names = ("x", "y", "angle") if what in ("x", "y", "angle") else ("vx", "vy", "spin")
    x, y, turn = (np.array(_body(run, identifier, name, only_ends=False)) for name in names)
    radius = float(run[0].radius[_row(run[0], identifier)])
    greatest = float(max(np.hypot(x, y).max(), radius * np.abs(turn).max()))
    return greatest / radius if what in ("angle", "spin") else greatest


def _ways(first: Frame, last: Frame) -> tuple[np.ndarray, float]:
    """Mean way of the free bodies that are in both frames, and the root of its mean square, weighted by mass."""
    common, mine, their = np.intersect1d(first.id[first.free], last.id[last.free], return_indices=True)
    if not len(common):
        return np.zeros(2), 0.0
    way = last.unwrapped[last.free][their] - first.unwrapped[first.free][mine]
    mass = first.mass[first.free][mine]
    return mass @ way / mass.sum(), math.sqrt(float(mass @ (way**2).sum(axis=1) / mass.sum()))


def _scale_of_centre(run: Trajectory) -> float:
    first = run[0]
    return max(_ways(first, frame)[1] for frame in run)


def _column(run: Trajectory, name: str) -> np.ndarray:
    return np.asarray(run.time_series[name] if name in run.time_series else run.energy_balance[name])


def _last(run: Trajectory, name: str) -> float:
    return float(_column(run, name)[-1])


def _mean(run: Trajectory, name: str) -> float:
    """Mean over time by the trapezoidal rule; rows are equally spaced. Rows that are NaN do not count."""
    values = _column(run, name)
    weights = np.ones(len(values))
    weights[[0, -1]] = 0.5
    kept = np.isfinite(values)
    return float(weights[kept] @ values[kept] / weights[kept].sum())
