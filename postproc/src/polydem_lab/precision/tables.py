"""Tables of speed against error, down to a recommendation."""

from __future__ import annotations

import itertools

import numpy as np
from polydem_post.base.emit import Table

from ..bench.statistics import number
from .samples import NUMERICS, PRECISIONS, numerics_of
from .scenes import SCENES
from .work_precision import ERRORS, TIE, WorkPrecision, fastest, model_of

#: What all tables of times say
CLOCK = (
    "Times: seconds of stepping (without start and output) per simulated second, one thread, least of the repeats. "
    "Errors: root mean square over the copies (or grains) of the distance from the converged solution of the same "
    "model."
)

#: How second order has all pairs of scene and model
STAND_IN = "Where neither damping nor friction has an entry for second order, the plain numerics stand for it."


def all_tables(study: WorkPrecision) -> list[Table]:
    """Every table of a report."""
    tables = [recommendation(study), fastest_choices(study), overall(study), orders(study), models(study),
              energy(study), points(study), left_out(study), stopped(study)]
    return [table for table in tables if table.rows]


def points(study: WorkPrecision) -> Table:
    """Every choice that was measured."""
    table = Table(
        "workprecision_points", "Speed against error: all choices",
        ("scene", "model", "numerics", "precision", "steps", "dt [s]", "share of stable step", "error, rms",
         "error, worst", "least time", "median time", "repeats"), texts=4,
    )
    for curve in study.curves:
        for point in curve.points:
            table.add(curve.scene, curve.model, curve.numerics, curve.precision, point.choice.steps, number(point.dt),
                      number(point.share), f"{point.rms:.2e}", f"{point.worst:.2e}", number(point.least),
                      number(point.median), point.repeats)
    table.note = CLOCK
    return table


def orders(study: WorkPrecision) -> Table:
    """How errors fall with the step."""
    table = Table(
        "workprecision_orders", "Orders of convergence, double precision",
        ("scene", "model", "numerics", "order, rms", "order, worst", "least error, rms", "of the reference"), texts=3,
    )
    for curve in study.curves:
        if curve.precision != "double":
            continue
        floor = study.floor(curve.scene, curve.model)
        reference = study.references.get((curve.scene, curve.model))
        table.add(curve.scene, curve.model, curve.numerics, number(curve.order(floor), 2),
                  number(curve.order(reference.floor_worst if reference else 0.0, worst=True), 2),
                  f"{min(point.rms for point in curve.points):.1e}", f"{floor:.1e}" if floor else "exact")
    table.note = (
        "Exponents of the error over the step, over all steps whose error is ten times that of the reference, which is "
        "how much the reference changes when its step is halved."
    )
    return table


def models(study: WorkPrecision) -> Table:
    """What the models themselves are wrong by."""
    table = Table(
        "workprecision_models", "Converged results of the models beside theory",
        ("scene", "model", "quantity", "converged", "theory", "model error", "error of the reference"), texts=3,
    )
    for (scene, name), reference in study.references.items():
        about = SCENES[scene]
        if about.quantity is None:
            continue
        value, target = about.quantity(reference.values), about.target(model_of(name)) if about.target else None
        table.add(scene, name, about.quantity_name, f"{value:.6f}", "-" if target is None else f"{target:.6f}",
                  "-" if target is None else f"{abs(value - target):.1e}", f"{reference.floor:.1e}")
    table.note = "No step and no integrator makes these errors smaller: they are those of the force law."
    return table


def fastest_choices(study: WorkPrecision) -> Table:
    """The fastest choice of every scene and model for every error."""
    table = Table(
        "workprecision_fastest", "For an error, the fastest choice of each scene and model",
        ("scene", "model", *(f"{error:g}" for error in ERRORS)), texts=2 + len(ERRORS),
    )
    for scene in _converging(study):
        for model in study.models_of(scene):
            curves = study.curves_of(scene, model)
            table.add(scene, model, *(_choice_text(fastest(curves, error)) for error in ERRORS))
    table.note = (
        "numerics, precision: seconds per simulated second (share of the stable step of the contacts). '-': no choice "
        "reaches the error. " + CLOCK
    )
    return table


def _choice_text(found: tuple | None) -> str:
    if found is None:
        return "-"
    curve, time, _, share = found
    return f"{curve.numerics}, {curve.precision}: {number(time)} s ({number(share, 2)})"


def overall(study: WorkPrecision) -> Table:
    """How often each choice is the fastest, and how far from it otherwise."""
    table = Table(
        "workprecision_overall", "Numerics and precision over all scenes and models",
        ("error", "numerics", "precision", "reaches it in", "fastest in",
         "time over the fastest, geometric mean"), texts=3,
    )
    for error in ERRORS:
        pairs = _pairs(study, error)
        for choice in _choices(study) if pairs else ():
            ratios = [pair[choice][0] for pair in pairs if choice in pair]
            wins = sum(ratio <= TIE for ratio in ratios)
            table.add(f"{error:g}", *choice, f"{len(ratios)} of {len(pairs)}", wins, number(_mean(ratios)))
    table.note = (
        "Counted are pairs of scene and model for which at least one choice reaches the error; fastest: within a "
        f"factor of {TIE:g}. The last column is the geometric mean over the pairs in which the choice reaches the "
        "error: means over different pairs do not compare. " + STAND_IN
    )
    return table


def recommendation(study: WorkPrecision) -> Table:
    """For an error, one choice."""
    table = Table(
        "workprecision_recommendation", "Recommendation",
        ("error", "numerics", "precision", "reaches it in", "time over the fastest, geometric mean", "over pairs",
         "share of the stable step"),
        texts=3,
    )
    for error in ERRORS:
        pairs = _pairs(study, error)
        count = {choice: sum(choice in pair for pair in pairs) for choice in _choices(study)}
        most = max(count.values(), default=0)
        if most == 0:
            continue
        # As often as possible, then as fast as possible where all of those reach it.
        often = [choice for choice, n in count.items() if n == most]
        common = [pair for pair in pairs if all(choice in pair for choice in often)]
        mean = {choice: _mean([pair[choice][0] for pair in common]) for choice in often}
        best = min(often, key=lambda choice: mean[choice])
        shares = [pair[best][1] for pair in pairs if best in pair and pair[best][1] > 0.0]
        spread = f"{number(min(shares), 2)} to {number(max(shares), 2)}" if shares else "-"
        table.add(f"{error:g}", *best, f"{most} of {len(pairs)}", number(mean[best]),
                  len(common), spread)
    table.note = (
        "The choice that reaches the error in most pairs of scene and model, of those in which any choice does. Of "
        "several, the fastest in the geometric mean over the pairs in which all of them reach it, one set for all. "
        f"{STAND_IN} The share of the stable step is that in the hardest and in the easiest scene."
    )
    return table


def _converging(study: WorkPrecision) -> list[str]:
    """Scenes whose errors are those of the integration alone, and so say which one is the best."""
    return [scene for scene in study.scenes if SCENES[scene].reference > 0]


def energy(study: WorkPrecision) -> Table:
    """Change of the energy where it is conserved, over the step."""
    table = Table(
        "workprecision_energy", "Change of the kinetic energy of the elastic gas, which is an error",
        ("law", "numerics", "precision", "dt [s]", "share of stable step", "rms", "greatest"), texts=3,
    )
    for curve in study.curves:
        if SCENES[curve.scene].reference == 0:
            for point in curve.points:
                table.add(curve.model.split("/")[0], curve.numerics, curve.precision, number(point.dt),
                          number(point.share), f"{point.rms:.2e}", f"{point.worst:.2e}")
    table.note = "Relative to that at the start, over all moments without a contact."
    return table


def _choices(study: WorkPrecision) -> list[tuple[str, str]]:
    """Numerics and precisions that the study has tried."""
    tried = {(curve.numerics, curve.precision) for curve in study.curves} | {key[2:] for key in study.stopped()}
    return [choice for choice in itertools.product(NUMERICS, PRECISIONS) if choice in tried]


def _pairs(study: WorkPrecision, error: float) -> list[dict[tuple[str, str], tuple[float, float]]]:
    """For each scene and model in which any choice reaches an error: those that do, with time over the fastest, share.

    The pairs are the same for all choices: where second order makes no difference, the plain numerics stand for it.
    """
    found = []
    for scene in _converging(study):
        for model in study.models_of(scene):
            curves = study.curves_of(scene, model)
            best = fastest(curves, error)
            if best is None:
                continue
            times = {(curve.numerics, curve.precision): curve.time_for(error) for curve in curves}
            offered = numerics_of(model_of(model))
            pair = {}
            for numerics, precision in _choices(study):
                name = numerics if numerics in offered else numerics.removesuffix(", second order")
                reached = times.get((name, precision))
                if reached is not None:
                    pair[numerics, precision] = (reached[0] / best[1], reached[2])
            found.append(pair)
    return found


def _mean(ratios: list) -> float:
    return float(np.exp(np.mean(np.log(ratios)))) if ratios else np.nan


def left_out(study: WorkPrecision) -> Table:
    """What the matrix asks for and the program does not know."""
    table = Table("workprecision_left_out", "Left out: refused by the program",
                  ("scene", "model", "numerics", "what it said"), texts=4)
    for sample in study.left_out():
        table.add(sample.scene, sample.model, sample.numerics, sample.result)
    return table


def stopped(study: WorkPrecision) -> Table:
    """Runs that a guard stopped, since their step was not stable."""
    table = Table("workprecision_stopped", "Stopped by a guard", ("scene", "model", "numerics", "precision", "steps"),
                  texts=5)
    for key, steps in study.stopped().items():
        table.add(*key, ", ".join(map(str, steps)))
    table.note = "Their steps were too large for the contacts; all others ran to the end."
    return table
