"""Figures of speed against error."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from ..report.style import Drawing, panels, shared_legend
from .scenes import SCENES
from .work_precision import Curve, WorkPrecision

#: Numerics -> colour (Okabe & Ito 2008) and marker
LOOKS = {
    "velocity_verlet": ("#0072B2", "o"),
    "velocity_verlet, second order": ("#009E73", "^"),
    "gear": ("#D55E00", "s"),
    "gear_3_20": ("#CC79A7", "v"),
    "gear, second order": ("#E69F00", "D"),
}

#: Elastic law -> line
LAWS = {"area": "--", "polar": "-"}


def precision_drawings(study: WorkPrecision) -> list[Drawing]:
    """All figures that the samples give."""
    drawings = [work_precision(study, scene) for scene in study.scenes]
    return drawings + [each for each in (energy_drift(study), growth(study)) if each]


def work_precision(study: WorkPrecision, scene: str) -> Drawing:
    """Error against time of one scene, one panel per model."""
    models = study.models_of(scene)
    figure, axes, below = _grid(len(models))
    for axis, model in zip(axes, models):
        floor = study.floor(scene, model)
        for curve in study.curves_of(scene, model):
            _draw(axis, curve)
        if floor > 0.0:
            axis.axhspan(1e-300, floor, color="0.9", zorder=0)
        _limit(axis, study.curves_of(scene, model), floor)
        axis.set_title(model.replace("/", ", "), fontsize=8)
        axis.set_xlabel("s per simulated s")
        axis.xaxis.set_minor_formatter(NullFormatter())
        if axis.get_subplotspec().is_first_col():
            axis.set_ylabel(f"error of {SCENES[scene].measured}")
    shared_legend(below, axes, columns=4)
    exact = SCENES[scene].reference == 0
    return Drawing(
        f"workprecision_{scene}", figure,
        f"{SCENES[scene].title}: error of the {SCENES[scene].measured} (root mean square; whiskers to the worst "
        f"{'moment' if exact else 'copy'}) against the time of stepping per simulated second, one thread, for steps "
        "that are halved from left to right. "
        + ("Whatever changes is an error." if exact else "Reference: the same model in quadruple precision with a far "
           "smaller step; grey: closer than that is known."),
    )


def _grid(count: int) -> tuple:
    """Panels in rows of at most four, and an empty one below for a legend."""
    columns = min(4, max(1, count))
    rows = max(1, math.ceil(count / columns))
    figure = Figure(figsize=(max(3.0 * columns, 6.0), 2.7 * rows + 0.5), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(rows + 1, columns, height_ratios=[2.7] * rows + [0.45])
    below = figure.add_subplot(grid[rows, :])
    below.axis("off")
    return figure, [figure.add_subplot(grid[k // columns, k % columns]) for k in range(count)], below


def _draw(axis, curve: Curve) -> None:
    colour, marker = LOOKS[curve.numerics]
    double = curve.precision == "double"
    time = [point.least for point in curve.points]
    rms = np.array([point.rms for point in curve.points])
    worst = np.array([point.worst for point in curve.points])
    axis.errorbar(
        time, rms, yerr=[np.zeros_like(rms), np.maximum(worst - rms, 0.0)], color=colour, marker=marker, markersize=3.5,
        markerfacecolor=colour if double else "white", linestyle="-" if double else ":", linewidth=1.0,
        elinewidth=0.5, label=f"{curve.numerics}, {curve.precision}",
    )
    axis.set(xscale="log", yscale="log")


def _limit(axis, curves: list, floor: float) -> None:
    """Show all errors, but not all of what lies below the reference."""
    errors = [point.rms for curve in curves for point in curve.points if point.rms > 0.0]
    highest = max(point.worst for curve in curves for point in curve.points)
    if errors:
        axis.set_ylim(max(min(errors), 0.3 * floor, 1e-16) / 2.0, 2.0 * highest)


def energy_drift(study: WorkPrecision) -> Drawing | None:
    """Model error and integration error of the energy, apart: the polar law against the area law."""
    curves = [curve for curve in study.curves if curve.scene == "gas" and curve.precision == "double"]
    if not curves:
        return None
    figure, (left, right) = panels(2, 4.4, 3.4)
    for curve in curves:
        law = curve.model.split("/")[0]
        colour, marker = LOOKS[curve.numerics]
        left.plot([p.dt for p in curve.points], [p.rms for p in curve.points], linestyle=LAWS[law], color=colour,
                  marker=marker, markersize=4.0, label=f"{law}, {curve.numerics}")
    dt = np.array([p.dt for curve in curves for p in curve.points])
    ends = np.array([dt.min(), dt.max()])
    smooth = [p for c in curves if c.model.startswith("polar") for p in c.points]
    if smooth:
        lowest = min(smooth, key=lambda p: p.dt)
        left.plot(ends, lowest.rms * (ends / lowest.dt) ** 2, color="0.6", linewidth=0.8, label="second order")
    left.set(xscale="log", yscale="log", xlabel="dt [s]", ylabel="relative change of the kinetic energy")
    left.xaxis.set_minor_formatter(NullFormatter())
    left.legend(fontsize=6.5, handlelength=3.5)
    _draw_drifts(right, curves)
    return Drawing(
        "workprecision_energy_drift", figure,
        "Elastic gas without friction. Left: root mean square of the change of the kinetic energy over all moments "
        "without a contact. With the polar law it is the error of the integration and falls with the step; with "
        "the area law it is that of the model and stays. Right: the change over time, velocity Verlet.",
    )


def _draw_drifts(axis, curves: list) -> None:
    shades = {"area": ("#D55E00", "#E69F00"), "polar": ("#0072B2", "#56B4E9")}
    for curve in curves:
        if curve.numerics != "velocity_verlet":
            continue
        law = curve.model.split("/")[0]
        for point, colour in zip((curve.points[0], curve.points[-1]), reversed(shades[law])):
            change = np.array(point.growth)
            time = SCENES["gas"].duration * np.arange(1, len(change) + 1) / len(change)
            axis.plot(time, change, ".", markersize=3.0, color=colour, label=f"{law}, dt = {point.dt:.1e} s")
    axis.set(yscale="log", xlabel="time [s]", ylabel="relative change, amount")
    axis.legend(fontsize=6.5)


def growth(study: WorkPrecision) -> Drawing | None:
    """How errors grow by themselves in the drum."""
    models = study.models_of("drum") if "drum" in study.scenes else []
    if not models:
        return None
    figure, axes = panels(len(models), 3.2, 3.0)
    for axis, model in zip(axes, models):
        for curve in study.curves_of("drum", model):
            if curve.precision != "double" or "gear" in curve.numerics:
                continue
            for point in curve.points:
                time = SCENES["drum"].duration * np.arange(1, len(point.growth) + 1) / len(point.growth)
                axis.plot(time, point.growth, color=LOOKS[curve.numerics][0], linewidth=0.9,
                          alpha=0.35 + 0.65 * curve.points[-1].dt / point.dt,
                          label=curve.numerics if point is curve.points[-1] else None)
        axis.set(yscale="log", xlabel="time [s]", ylabel="error [grain diameters]")
        axis.set_title(model.replace("/", ", "), fontsize=8)
        axis.legend(fontsize=6.5)
    return Drawing(
        "workprecision_growth", figure,
        "Drum: root mean square distance of the grains from where they are in the reference, for all steps (the "
        "darker, the smaller). Parallel rising lines: deviations grow by themselves, by the same factor for all steps.",
    )
