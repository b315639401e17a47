"""Figures of speed against error beside other codes."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
from matplotlib.ticker import LogLocator, NullFormatter
from polydem_post.base.result_file import ResultError, cannot_read

from ..report.style import Drawing, grid_with_legend, panels, panels_with_legend, shared_legend
from .points import ERRORS, OWN, Comparison
from .problems import PROBLEMS

#: Code -> colours of its series (Okabe & Ito 2008, and paler ones) and marker; laws of polydem take those left
LOOKS = {
    "polydem": (("#D55E00", "#E69F00"), "o"),
    "Box2D v3": (("#0072B2", "#56B4E9"), "s"),
    "Chipmunk": (("#009E73", "#7FC9A9"), "^"),
    "Rapier": (("#6A3D9A", "#B79BD1"), "v"),
    "Siconos": (("#333333", "#888888"), "*"),
    "Yade": (("#8B4513", "#C09060"), "P"),
}
OTHER_LAWS = (("#CC79A7", "#E3B6CC"), ("#B00020", "#D98890"), ("#F0A000", "#F7D080"), ("#7A5C00", "#B8A670"))

#: Errors below this are drawn at it
LOWEST = 1e-8

#: File in the folder of a study with errors that were asked for and achieved: columns scene, requested, achieved
REQUESTED = "requested.csv"


def rivals_drawings(found: Comparison, folder: Path) -> list[Drawing]:
    """All figures that the points give."""
    drawings = [summary(found), *(error_against_time(found, problem) for problem in found.problems), profiles(found)]
    optional = [collective(found), requested_against_achieved(Path(folder) / REQUESTED)]
    return drawings + [each for each in optional if each]


def look_of(found: Comparison, column: str) -> tuple:
    """Colours of the series of a column, and its marker."""
    laws = [each for each in found.columns if each.startswith(OWN) and each != OWN]
    if column in laws:
        return OTHER_LAWS[laws.index(column) % len(OTHER_LAWS)], "D"
    return LOOKS.get(column, (("0.4", "0.7"), "h"))


def error_against_time(found: Comparison, problem: str) -> Drawing:
    """Error against time of one problem, all codes."""
    figure, (axis,), below = panels_with_legend(1, 6.0, 4.2, 5)
    _draw(axis, found, problem)
    axis.set(xlabel="processor seconds per simulated second", ylabel=f"error of {PROBLEMS[problem].measured}")
    shared_legend(below, [axis], columns=2)
    return Drawing(
        f"rivals_{problem}", figure,
        f"{_title(problem)}: error of the {PROBLEMS[problem].measured} against the processor time of stepping per "
        "simulated second, one thread; median of the repeats, whiskers to the least and the greatest. Grey: closer "
        "than that the right answer is not known.",
    )


def summary(found: Comparison) -> Drawing:
    """Error against time of all problems in small panels."""
    columns = min(4, max(2, len(found.problems)))
    rows = math.ceil(len(found.problems) / columns)
    figure, grid, below = grid_with_legend(rows, columns, 3.0, 2.4, 20 // columns)
    axes = [axis for row in grid for axis in row]
    for axis, problem in zip(axes, found.problems):
        _draw(axis, found, problem)
        axis.set_title(problem, fontsize=8)
    for axis in axes[len(found.problems) :]:
        axis.axis("off")
    for k, axis in enumerate(axes[: len(found.problems)]):
        axis.set_xlabel("s per simulated s" if k >= len(found.problems) - columns else "")
        axis.set_ylabel("error" if k % columns == 0 else "")
    shared_legend(below, axes, columns=columns)
    return Drawing("rivals_all", figure, "Error against processor time per simulated second, all problems and codes.")


def _title(problem: str) -> str:
    title = PROBLEMS[problem].title
    return title[0].upper() + title[1:]


def _draw(axis, found: Comparison, problem: str) -> None:
    """All series of a problem."""
    number: dict = {}
    for (column, series), points in found.series(problem).items():
        kept = [point for point in points if math.isfinite(point.error)]
        if not kept:
            continue
        colours, marker = look_of(found, column)
        shade = number[column] = number.get(column, -1) + 1
        time = np.array([point.median for point in kept])
        ends = [time - np.array([point.least for point in kept]), np.array([point.most for point in kept]) - time]
        axis.errorbar(time, [max(point.error, LOWEST) for point in kept], xerr=np.maximum(ends, 0.0), marker=marker,
                      markersize=3.5, color=colours[min(shade, 1)], linestyle="-" if shade == 0 else "--",
                      linewidth=1.0, elinewidth=0.5, label=series)
    axis.set(xscale="log", yscale="log")
    if found.floor(problem):
        axis.axhspan(LOWEST / 10.0, found.floor(problem), color="0.9", zorder=0)
    errors = [max(point.error, LOWEST) for point in found.points
              if point.problem == problem and math.isfinite(point.error)]
    if errors:
        axis.set_ylim(min(errors) / 2.0, max(errors) * 2.0)
    axis.xaxis.set_major_locator(LogLocator(numticks=8))
    axis.xaxis.set_minor_formatter(NullFormatter())


def profiles(found: Comparison) -> Drawing:
    """Performance profiles for each error, and over all."""
    figure, axes, below = panels_with_legend(len(ERRORS) + 1, 2.9, 2.7, 3)
    for axis, error in zip(axes, (*ERRORS, None)):
        ratios = found.profile(found.columns, error)
        count = max(len(each) for each in ratios.values())
        for column, each in ratios.items():
            finite = np.sort([ratio for ratio in each if math.isfinite(ratio)])
            share = np.arange(1, len(finite) + 1) / max(count, 1)
            last = max((max(some) for some in ratios.values() if some and math.isfinite(max(some))), default=1.0)
            axis.step([1.0, *finite, max(last, 1e4)], [0.0, *share, share[-1] if len(share) else 0.0], where="post",
                      color=look_of(found, column)[0][0], linewidth=1.2, label=column)
        axis.set(xscale="log", ylim=(0.0, 1.02), xlabel="time over the best")
        axis.set_title(f"error {error:g}, {count} problems" if error else f"all, {count} pairs", fontsize=8)
    axes[0].set_ylabel("share of problems")
    shared_legend(below, axes, columns=5)
    return Drawing(
        "rivals_profile", figure,
        "Performance profiles (Dolan & Moré 2002): share of the problems in which a code keeps the error within a "
        "factor of the time of the best code for it. Left end: how often it is the fastest; right end: how often it "
        "keeps the error at all.",
    )


def collective(found: Comparison) -> Drawing | None:
    """Values of collective problems over seeds, with the floor of sampling."""
    known = {name: reference for name, reference in found.references.items() if reference}
    if not known:
        return None
    figure, axes, below = panels_with_legend(len(known), 5.5, 3.6, 4)
    for axis, (name, (mean, sampling)) in zip(axes, known.items()):
        axis.axhspan(mean - 2.0 * sampling, mean + 2.0 * sampling, color="0.9", zorder=0)
        axis.axhline(mean, color="0.5", linewidth=0.8)
        for (column, series), points in found.series(name).items():
            colours, marker = look_of(found, column)
            axis.errorbar([point.median for point in points], [point.mean for point in points],
                          yerr=[2.0 * np.nan_to_num(point.sampling) for point in points], marker=marker,
                          color=colours[0 if series == column else 1], markersize=3.5, linewidth=1.0, elinewidth=0.8,
                          label=series)
        axis.set(xscale="log", xlabel="processor seconds per simulated second", ylabel=PROBLEMS[name].measured)
    shared_legend(below, axes, columns=3)
    return Drawing(
        "rivals_collective", figure,
        "Collective quantities over seeds: means with two standard errors. Grey: two standard errors of the mean of "
        "the rivals at their finest steps, the floor of sampling, below which no difference shows.",
    )


def requested_against_achieved(path: Path) -> Drawing | None:
    """Errors that were asked for and achieved, if a file beside the points has them."""
    if not path.exists():
        return None
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = [(row["scene"], float(row["requested"]), float(row["achieved"])) for row in csv.DictReader(file)]
    except OSError as error:
        raise cannot_read(path, error) from error
    except (KeyError, TypeError, ValueError, csv.Error) as error:
        raise ResultError(f"{path}: needs the columns scene, requested and achieved ({error})") from error
    if not rows:
        return None
    figure, (axis,) = panels(1)
    for scene in dict.fromkeys(row[0] for row in rows):
        kept = [row[1:] for row in rows if row[0] == scene]
        axis.plot(*zip(*kept), "o", markersize=3.5, label=scene)
    ends = [min(row[1] for row in rows), max(row[1] for row in rows)]
    axis.plot(ends, ends, color="0.5", linewidth=0.8)
    axis.set(xscale="log", yscale="log", xlabel="requested error", ylabel="achieved error")
    axis.legend(fontsize=6.5)
    return Drawing("rivals_requested", figure, "Achieved error against the requested one; below the line it is kept.")
