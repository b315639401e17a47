"""A study of the accuracy of one scene: windows are run, errors estimated, entries recommended."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from ..base.result_file import ResultError
from .estimate import (
    CONSTANT,
    DISTANCE_SHARE,
    INTEGRATION_SHARE,
    MOST,
    REFUSED,
    Estimate,
    estimate,
    integrate,
    needs_separation,
    noise_of,
    separated,
)
from .quantities import Quantity, horizon, parse, usual_quantities
from .scene import check, window_of, write_scene, write_start
from .windows import BASE, CHANGED, COARSE, NEAR, NEEDED, TRIED, Study, Window

#: Folder of studies
RESULTS = Path("results/accuracy")

#: Schemes of &integrate
SCHEMES = ("velocity_verlet", "gear", "gear_3_20")

#: Stiffnesses at which windows of half the step separate integration errors from differences of stiffness
HALVES = (0.25, 4.0, 16.0)

#: So many windows are tried with entries that may keep the tolerance
ATTEMPTS = 5

#: The start of a scene may be a little deeper than `check` prints
SLACK = 1.01


@dataclass(frozen=True)
class Request:
    """What a user asks for."""

    namelist: Path
    program: Path
    tolerance: float = 1e-2
    quantities: tuple[str, ...] = ()
    duration: float | None = None
    start: str = ""
    entries: tuple[str, ...] = ()
    output: Path | None = None
    cores: int = 1
    threads: int = 1


@dataclass(frozen=True)
class Recommendation:
    """Entries that keep the tolerance in a window that was run."""

    window: Window
    #: Entries to give, as they are written
    entries: dict[str, str]
    #: Steps over those of the scene
    cost: float
    #: Quantity -> distance of this window from infinite stiffness and dt -> 0
    errors: dict[str, float]


@dataclass
class Outcome:
    """Errors of each quantity, and what is recommended."""

    study: Study
    request: Request
    quantities: dict[str, Quantity]
    estimates: dict[str, Estimate]
    scales: dict[str, float]
    horizon: float | None
    #: None: nothing keeps the tolerance, for the reason
    recommended: Recommendation | None
    reason: str = ""


def study_accuracy(request: Request, say: Callable[[str], None] = print) -> Outcome:
    """Run the windows of a scene and say what they tell."""
    study = _begin(request, say)
    study.run([BASE], "scene")
    base = study.result(BASE)
    words = request.quantities or tuple(usual_quantities(base))
    quantities = {quantity.name: quantity for quantity in (parse(word, base) for word in words)}
    study.run([*NEEDED, *CHANGED, *NEAR], "needed")
    study.run(TRIED, "tried")
    scales = {name: quantity.scale(base) for name, quantity in quantities.items()}
    estimates = {name: _first_estimate(study, quantity, scales[name], request.tolerance)
                 for name, quantity in quantities.items()}
    spoilt = [name for name, found in estimates.items() if found.integration is not None and needs_separation(
        found.values, found.integration, found.noise, request.tolerance)]
    if spoilt:
        study.run([Window(stiffness=factor, step=0.5) for factor in HALVES
                   if Window(stiffness=factor) in study.runs], "halves")
        for name in spoilt:
            estimates[name] = _second_estimate(study, quantities[name], scales[name], estimates[name],
                                               request.tolerance)
    outcome = Outcome(study, request, quantities, estimates, scales,
                      horizon(base, [study.result(window) for window in CHANGED], request.tolerance), None)
    _recommend(outcome)
    return outcome


def _begin(request: Request, say: Callable[[str], None]) -> Study:
    """Check the scene and write its namelist."""
    folder = request.output or RESULTS / request.namelist.stem
    entries = list(request.entries)
    if request.duration is not None:
        entries.append(f"integrate.duration={request.duration!r}")
    namelist = request.namelist
    if not namelist.is_file():
        raise ResultError(f"{namelist}: there is no such file")
    checked = check(request.program, namelist, entries)
    depth = 0.0
    if request.start:
        namelist = write_start(request.start, request.namelist, checked, folder)
        checked = check(request.program, namelist, ["guards.listed_depth=0"])
        depth = SLACK * checked.depth
    study = Study(request.program, namelist, checked, folder, window_of(checked.settings), depth, request.cores,
                  request.threads, say)
    study.scene = write_scene(namelist, checked, folder, study.duration, study.rows)
    return study


def _values(study: Study, quantity: Quantity, scale: float, windows: dict[float, Window]) -> dict[float, float]:
    """Values over their scale in those windows that were run."""
    return {key: quantity.value(study.result(window)) / scale for key, window in windows.items()
            if window in study.runs}


def _first_estimate(study: Study, quantity: Quantity, scale: float, tolerance: float) -> Estimate:
    if not math.isfinite(scale):
        return Estimate(REFUSED, reason="it is not a number in the window of the scene")
    if not scale > 0.0:
        return Estimate(CONSTANT, reason="it is zero in all of the window")
    steps = {step: Window(step=step) for step in (0.5, 1.0, *COARSE)}
    stiff = {factor: Window(stiffness=factor) for factor in (0.25, 1.0, 4.0, 16.0)}
    at_steps = _values(study, quantity, scale, steps)
    values = _values(study, quantity, scale, stiff)
    changed = list(_values(study, quantity, scale, dict(enumerate(CHANGED))).values())
    near = list(_values(study, quantity, scale, dict(enumerate(NEAR))).values())
    if not all(map(math.isfinite, [*at_steps.values(), *values.values(), *changed, *near])):
        return Estimate(REFUSED, reason="it is not a number in some window")
    noise = noise_of(values[1.0], changed, near)
    return estimate(values, integrate(at_steps, noise), noise, tolerance)


def _second_estimate(study: Study, quantity: Quantity, scale: float, first: Estimate, tolerance: float) -> Estimate:
    """The estimate from values without integration errors."""
    integration = first.integration
    if integration is None:
        return first
    pairs: dict[float, tuple[float, float]] = {}
    for factor in HALVES:
        found = _values(study, quantity, scale, {step: Window(stiffness=factor, step=step) for step in (1.0, 0.5)})
        if len(found) == 2:
            pairs[factor] = found[1.0], found[0.5]
    if not {4.0, 16.0} <= set(pairs):
        first.state, first.reason = REFUSED, "a window at half the step failed"
        return first
    values, doubt = separated(pairs, integration)
    values[1.0] = integration.limit
    return estimate(values, integration, first.noise, tolerance, max(doubt, integration.doubt))


# --- what keeps the tolerance ------------------------------------------------------------------------------------


def _recommend(outcome: Outcome) -> None:
    """The cheapest entries that keep the tolerance for all quantities that have an estimate."""
    study, tolerance = outcome.study, outcome.request.tolerance
    usable = {name: found for name, found in outcome.estimates.items() if found.is_usable}
    if not usable:
        outcome.reason = "no quantity has an estimate"
        return
    stiffness = _rounded_up(max(found.stiffness(tolerance) for found in usable.values()))
    if stiffness > MOST:
        worst = max(usable, key=lambda name: usable[name].stiffness(tolerance))
        outcome.reason = (f"{worst} would need about {stiffness:.1g} times the stiffness, beyond the {MOST:g} times "
                          "for which fits are tested: take the extrapolated value, or another law")
        return
    steps = {step for step in (0.5, 1.0, *COARSE) if study.is_stable(Window(step=step)) or step <= 1.0}
    allowed = INTEGRATION_SHARE * tolerance
    step = min([found.integration.widest(allowed, steps) for found in usable.values() if found.integration is not None],
               default=1.0)
    window = Window(stiffness=stiffness, step=step)
    if step >= 0.5:
        window = _other_scheme(outcome, usable, window, allowed)
    outcome.recommended = _confirmed(outcome, usable, window)
    if outcome.recommended is None:
        outcome.reason = f"windows with the expected entries miss it {ATTEMPTS} times: the fit does not hold"


def _other_scheme(outcome: Outcome, usable: dict[str, Estimate], window: Window, allowed: float) -> Window:
    """The same window with another scheme and twice the step, if that keeps the integration error, too."""
    study = outcome.study
    wider = [Window(step=2.0 * window.step, scheme=scheme) for scheme in SCHEMES
             if scheme != study.checked.settings.integrate.scheme]
    study.run(wider, f"schemes_dt{2.0 * window.step:g}")
    for other in wider:
        if study.is_stable(other) and _keeps(outcome, usable, other, allowed):
            return replace(other, stiffness=window.stiffness)
    return window


def _confirmed(outcome: Outcome, usable: dict[str, Estimate], window: Window) -> Recommendation | None:
    """Entries with which a window was run and kept the tolerance: finer or stiffer ones where the first do not."""
    study, tolerance = outcome.study, outcome.request.tolerance
    for _ in range(ATTEMPTS):
        if window not in study.runs:
            study.run([window], f"chosen_{window.name}")
        if not study.is_stable(window):
            window = replace(window, step=0.5 * window.step, scheme="")
            continue
        errors = {name: abs(_value(outcome, name, window) - found.limit) for name, found in usable.items()
                  if found.state != CONSTANT}
        name = max(errors, key=lambda each: errors[each], default="")
        if not name or errors[name] <= tolerance:
            return _recommendation(outcome, window, errors)
        order = usable[name].low_order
        if order is None:
            window = replace(window, step=0.5 * window.step, scheme="")
            continue
        stiffness = window.stiffness * max(1.5, (errors[name] / (DISTANCE_SHARE * tolerance)) ** (1.0 / order))
        if stiffness > MOST:
            return None
        window = replace(window, stiffness=_rounded_up(stiffness))
    return None


def _value(outcome: Outcome, name: str, window: Window) -> float:
    """A quantity of a window over its scale."""
    return outcome.quantities[name].value(outcome.study.result(window)) / outcome.scales[name]


def _keeps(outcome: Outcome, usable: dict[str, Estimate], window: Window, allowed: float) -> bool:
    """Whether a window has integration errors below the allowed ones."""
    return all(abs(_value(outcome, name, window) - found.integration.limit) + found.integration.doubt <= allowed
               for name, found in usable.items() if found.integration is not None)


def _recommendation(outcome: Outcome, window: Window, errors: dict[str, float]) -> Recommendation:
    """Entries that make a window, with a step of three digits."""
    study = outcome.study
    settings = study.checked.settings
    dt = study.duration / study.steps_of(window)
    entries = {entry: f"{float(value):.6g}" for entry, value in study.entries_of(window.stiffness).items()}
    if window.scheme:
        entries["integrate.scheme"] = window.scheme
    if float(settings.integrate.dt) > 0.0:
        entries["integrate.dt"] = f"{_rounded_down(dt):.6g}"
    else:
        share = dt / study.stable(window.stiffness, window.scheme)
        entries["integrate.safety_factor"] = f"{_rounded_down(share):.6g}"
    return Recommendation(window, entries, study.checked.dt / dt, errors)


def _rounded_up(value: float) -> float:
    """A number of two digits that is not less."""
    digits = 10.0 ** (math.floor(math.log10(value)) - 1)
    return round(math.ceil(value / digits - 1e-9) * digits, 12)


def _rounded_down(value: float) -> float:
    """A number of three digits that is not greater."""
    digits = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.floor(value / digits + 1e-9) * digits
