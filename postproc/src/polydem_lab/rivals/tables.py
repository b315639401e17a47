"""Tables of speed against error beside other codes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from polydem_post.base.emit import Table

from ..bench.statistics import number
from .codes import CODES
from .codes.polydem import DEFAULT
from .points import OWN, Comparison, order_in_stiffness
from .problems import PROBLEMS, Collective
from .samples import ORIGIN

#: What all tables of times say
CLOCK = (
    "Times: processor seconds of stepping per simulated second, one thread, median of the repeats, which take turns; "
    "start-up and output are not counted."
)

#: Factors of the best time of which the profile is tabled
FACTORS = (1.0, 2.0, 10.0, 100.0, 1000.0)

#: Nothing there
NONE = "-"


def all_tables(found: Comparison, folder: Path) -> list[Table]:
    """Every table of a report that has rows."""
    tables = [ratios(found), cheapest(found), least(found), stiffness(found), profile(found), collective(found),
              body_steps(found), spread(found), left_out(found, folder), seeds(found), points(found)]
    return [table for table in tables if table.rows]


def cheapest(found: Comparison) -> Table:
    """Times for an error."""
    table = Table("rivals_cheapest", "Processor time for an error",
                  ("problem", "error", *found.columns, "polydem over the cheapest rival"), texts=1)
    for problem, error in found.judged():
        times = {column: found.time_for(problem, column, error) for column in found.columns}
        if math.isfinite(min(times.values())):
            table.add(problem, f"{error:g}", *map(_error, times.values()), _ratio(times))
    table.note = (
        f"{CLOCK} An error is kept by the first point of a series that is below it together with the next finer one, "
        "and time is interpolated to the point before; - if no series of a code keeps it. Errors below what is known "
        "of the right answer are left out."
    )
    return table


def ratios(found: Comparison) -> Table:
    """Times of polydem over those of the cheapest rival, errors side by side."""
    errors = sorted({error for _, error in found.judged()}, reverse=True)
    table = Table("rivals_ratios", "Time of polydem over that of the cheapest rival, for an error",
                  ("problem", *(f"{error:g}" for error in errors)), texts=1)
    rows = {(row[0], row[1]): row[-1] for row in cheapest(found).rows}
    for problem in dict.fromkeys(name for name, _ in rows):
        table.add(problem, *(rows.get((problem, f"{error:g}"), NONE) for error in errors))
    table.note = (f"{CLOCK} An error is kept by the first point of a series that is below it together with the next "
                  "finer one, and time is interpolated to the point before. *Never*: no series of polydem keeps it; -: "
                  "no code does, or less is known of the right answer. The times: rivals_cheapest.csv.")
    return table


def _ratio(times: dict) -> str:
    """Time of polydem with its default settings over that of the cheapest rival."""
    own = times.get(OWN, math.inf)
    best = min((time for column, time in times.items() if not column.startswith(OWN)), default=math.inf)
    if math.isinf(own):
        return "never" if math.isfinite(best) else NONE
    return f"{own / best:.2g}" if math.isfinite(best) else "only polydem"


def least(found: Comparison) -> Table:
    """The least error of each code."""
    table = Table("rivals_least", "Least error reached", ("problem", *found.columns, "not judged below"), texts=1)
    for problem in found.problems:
        floor = found.floor(problem)
        table.add(problem, *(_error(found.least_error(problem, column)) for column in found.columns),
                  f"{floor:.0e}" if floor else NONE)
    return table


def _error(value: float) -> str:
    return f"{value:.1e}" if math.isfinite(value) else NONE


def stiffness(found: Comparison) -> Table:
    """What the stiffness of polydem leaves."""
    table = Table("rivals_stiffness", "Error of polydem at a stiffness, and its order",
                  ("problem", "law", *(f"1e{level}" for level in range(DEFAULT - 2, DEFAULT + 4)), "order"), texts=2)
    for problem in found.problems:
        for (column, series), listed in found.series(problem).items():
            if column.startswith(OWN) and series == column:
                errors = {point.level: point.error for point in listed}
                table.add(problem, column.removeprefix(OWN).lstrip(", ") or "default",
                          *(_error(errors.get(level, math.nan)) for level in range(DEFAULT - 2, DEFAULT + 4)),
                          number(order_in_stiffness(listed), 2))
    table.note = (f"E in N/m2 for bodies of 1 m; 1e{DEFAULT} is as stiff as the default of the program with grains of "
                  "1 cm. Order: the error falls with this power of E over its last three stiffnesses; 0: it is not one "
                  "of the stiffness.")
    return table


def profile(found: Comparison) -> Table:
    """Performance profile in numbers."""
    table = Table("rivals_profile", "Performance profile: share of the pairs of problem and error that a code keeps",
                  ("code", *(f"within {factor:g} of the best time" for factor in FACTORS), "at all", "pairs"), texts=1)
    for column, ratios in found.profile(found.columns).items():
        if ratios:
            shares = [np.mean(np.array(ratios) <= factor) for factor in (*FACTORS, 1e300)]
            table.add(column, *(f"{share:.2f}" for share in shares), len(ratios))
    table.note = ("After Dolan & Moré (2002), Mathematical Programming 91, 201: the best time is that of the fastest "
                  "of these codes for this problem and error.")
    return table


def collective(found: Comparison) -> Table:
    """Collective quantities and the floor of sampling."""
    table = Table("rivals_collective", "Collective quantities, means over seeds",
                  ("problem", "series", "level", "mean", "standard error", "error", "seeds", "time", "steps per s"),
                  texts=2)
    for point in found.points:
        if isinstance(PROBLEMS[point.problem], Collective):
            table.add(point.problem, point.series, point.level, number(point.mean), _error(point.sampling),
                      _error(point.error), len(point.values), _error(point.median), number(point.steps))
    table.note = "".join(
        f"{name}: errors are those from {number(known[0])} +- {number(known[1], 2)}, the mean of the rivals at their "
        "finest steps; twice its standard error is the floor of sampling. "
        for name, known in found.references.items() if known).strip()
    return table


def seeds(found: Comparison) -> Table:
    """Errors over seeds."""
    table = Table("rivals_seeds", "Errors over seeds",
                  ("problem", "series", "level", "error, rms", "error, worst", "seeds", "time"), texts=2)
    for point in found.points:
        if len(point.values) > 1 and not isinstance(PROBLEMS[point.problem], Collective):
            table.add(point.problem, point.series, point.level, _error(point.error), _error(max(point.values)),
                      len(point.values), _error(point.median))
    return table


def body_steps(found: Comparison) -> Table:
    """Time of a step and body."""
    shown = [name for name in ("slide", "stack", "gas", "hopper", "dense") if name in found.problems]
    table = Table("rivals_body_steps", "Time of a step per free body [ns], least of all settings and repeats",
                  ("code", *shown), texts=1)
    for column in found.columns:
        cells = []
        for name in shown:
            problem = PROBLEMS[name]
            count = len(problem.scene(problem.seeds[0]).free)
            costs = [1e9 * point.least / point.steps / count for point in found.points
                     if (point.problem, point.column) == (name, column)]
            cells.append(number(min(costs)) if costs else NONE)
        table.add(column, *cells)
    return table


def spread(found: Comparison) -> Table:
    """How far times are to be trusted."""
    table = Table("rivals_spread", "Spread of times: greatest over least of the repeats of a point",
                  ("code", "median", "nine in ten below", "greatest", "points"), texts=1)
    for column in found.columns:
        ratios = [point.most / point.least for point in found.points
                  if point.column == column and point.repeats > 1]
        if ratios:
            table.add(column, *(f"{each:.2f}" for each in (np.median(ratios), np.quantile(ratios, 0.9), max(ratios))),
                      len(ratios))
    return table


def left_out(found: Comparison, folder: Path) -> Table:
    """Who did not take part, and what failed."""
    table = Table("rivals_left_out", "Missing codes, omissions and failures", ("code", "where", "why"), texts=3)
    path = Path(folder) / ORIGIN
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines() if path.exists() else []
    missing = dict(line.split(": missing, ", 1) for line in lines if ": missing, " in line)
    for name, why in missing.items():
        table.add(name, "everywhere", why)
    for module in CODES.values():
        omitted: dict = {}
        for problem in found.problems:
            why = module.omits(PROBLEMS[problem])
            if why and module.NAME not in missing:
                omitted.setdefault(why, []).append(problem)
        for why, names in omitted.items():
            table.add(module.NAME, ", ".join(names), why)
    failed: dict = {}
    for sample in found.failures():
        failed.setdefault((sample.series, sample.problem, sample.message), []).append(f"{sample.level}")
    for (series, problem, message), levels in failed.items():
        table.add(series, f"{problem}, level {', '.join(dict.fromkeys(levels))}", message)
    return table


def points(found: Comparison) -> Table:
    """Every point."""
    table = Table("rivals_points", "All points", ("problem", "code", "series", "level", "error", "median time",
                                                  "least time", "repeats", "steps per s"), texts=3)
    for point in found.points:
        table.add(point.problem, point.column, point.series, point.level, _error(point.error), f"{point.median:.2e}",
                  f"{point.least:.2e}", point.repeats, number(point.steps))
    table.note = CLOCK
    return table
