"""What a study says: a table of errors, the horizon, and entries to paste; the same as a file for programs."""

from __future__ import annotations

import csv
import shlex
from collections.abc import Iterator
from pathlib import Path

from ..base.emit import Table
from ..base.new_file import new_file
from ..base.result_file import cannot_write
from .estimate import CONSTANT, FITTED, Estimate
from .scene import stiffness_entries
from .study import Outcome

#: The table of a study in its folder
FILE = "accuracy.csv"

#: Columns of that file; errors are shares of the scale
COLUMNS = ("quantity", "unit", "scale", "value", "noise", "integration_error", "order_in_dt", "distance", "order_in_E",
           "extrapolated", "uncertainty", "state", "reason")


def lines_of(outcome: Outcome) -> Iterator[str]:
    """The report, line by line."""
    study, tolerance = outcome.study, outcome.request.tolerance
    checked = study.checked
    yield ""
    yield (f"scene      {outcome.request.namelist}, windows of {study.duration:g} s, "
           f"dt = {checked.dt:.4g} s ({checked.dt / checked.stable:.3g} of the stable step), stiffness "
           f"{float(checked.settings.forces.stiffness):.4g} N/m2")
    yield from _remarks(outcome)
    yield ""
    yield _table(outcome).document("text").rstrip("\n")
    for name, found in outcome.estimates.items():
        if found.reason:
            yield f"{name}: {found.state}: {found.reason}"
        if found.integration is not None and found.integration.order is None:
            yield f"{name}: the order in dt could not be measured: its integration error is that of order 1"
    yield ""
    yield from _horizon(outcome)
    yield from _entries(outcome, tolerance)


def write_table(outcome: Outcome) -> Path:
    """Write the table of a study into its folder."""
    path = outcome.study.folder / FILE
    try:
        with new_file(path) as part, part.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(COLUMNS)
            for name, found in outcome.estimates.items():
                writer.writerow([name, outcome.quantities[name].unit, repr(outcome.scales[name]),
                                 *_numbers(found, outcome.scales[name]), found.state, found.reason])
    except OSError as error:
        raise cannot_write(path, error) from error
    return path


def _numbers(found: Estimate, scale: float) -> list[str]:
    integration = found.integration
    if integration is None:
        return [""] * 8
    order = "" if integration.order is None else f"{integration.order:.3g}"
    fitted = found.state == FITTED
    return [repr(integration.values[1.0] * scale), f"{found.noise:.3e}", f"{integration.error(1.0):.3e}", order,
            f"{found.distance:.3e}" if fitted else "", f"{found.order:.3f}" if fitted else "",
            repr(found.limit * scale) if fitted else "", f"{found.doubt * scale:.3e}" if fitted else ""]


def _remarks(outcome: Outcome) -> Iterator[str]:
    checked = outcome.study.checked
    if float(checked.settings.integrate.dt) > 0.0:
        yield "           dt is given: windows of other stiffness have it scaled with the stable step"
    several = [entry for entry in stiffness_entries(checked.settings, 1.0) if entry != "forces.stiffness"]
    if several:
        yield f"           with {', '.join(several)}: every stiffness is scaled by the same factor"
    if outcome.request.start:
        yield (f"           starts from {outcome.request.start}: contacts begin anew; those deeper than the stiffness "
               "allows are pushed apart")


def _table(outcome: Outcome) -> Table:
    """Errors as shares of the scale, values in SI units."""
    table = Table("accuracy", f"errors as shares of the scale; tolerance {outcome.request.tolerance:g}",
                  ("quantity", "state", "value", "unit", "scale", "integration", "order in dt", "distance from E = inf",
                   "order in E", "value at E = inf", "noise"), texts=2)
    for name, found in outcome.estimates.items():
        scale, unit = outcome.scales[name], outcome.quantities[name].unit
        if found.state == CONSTANT or found.integration is None:
            table.add(name, found.state, *[""] * 9)
            continue
        integration = found.integration
        order = "-" if integration.order is None else f"{integration.order:.2f}"
        if found.state == FITTED:
            distance = f"{found.distance:+.1e}"
            fit = (f"{found.order:.2f}", f"{found.limit * scale:.6g} +- {found.doubt * scale:.1g}")
        else:
            known = found.is_usable
            distance = f"below {abs(found.distance) + found.doubt:.1e}" if known else "-"
            fit = ("-", "-")
        table.add(name, found.state, f"{integration.values[1.0] * scale:.6g}", unit, f"{scale:.3g}",
                  f"{integration.error(1.0):.1e}", order, distance, *fit, f"{found.noise:.1e}")
    return table


def _horizon(outcome: Outcome) -> Iterator[str]:
    share = f"{outcome.request.tolerance:g} of a diameter"
    if outcome.horizon is None:
        yield f"horizon    positions are the same to {share} in all of the window when last bits change"
    else:
        yield (f"horizon    {outcome.horizon:.4g} s: later, positions differ by more than {share} when last bits "
               "change")


def _entries(outcome: Outcome, tolerance: float) -> Iterator[str]:
    chosen = outcome.recommended
    if chosen is None:
        yield f"entries    none keep the tolerance {tolerance:g}: {outcome.reason}"
        return
    left_out = [name for name, found in outcome.estimates.items() if not found.is_usable]
    scope = f", without {', '.join(left_out)}" if left_out else ""
    yield (f"entries    for the tolerance {tolerance:g}{scope}: {chosen.window.stiffness:g} times the stiffness, "
           f"{chosen.cost:.2g} times the steps of the scene")
    if chosen.errors:
        worst = max(chosen.errors, key=lambda name: chosen.errors[name])
        yield f"           a window with them is at most {chosen.errors[worst]:.1e} from E = inf ({worst})"
    groups: dict[str, list[str]] = {}
    for entry, value in chosen.entries.items():
        group, _, key = entry.rpartition(".")
        groups.setdefault(group, []).append(f"{key} = {value!r}" if key == "scheme" else f"{key} = {value}")
    for group, words in groups.items():
        kind, _, name = group.partition(".")
        yield f"   &{kind} " + (f"name = '{name}' ... " if name else "") + "  ".join(words) + " /"
    words = [f"--set {entry}={value}" for entry, value in chosen.entries.items()]
    yield f"   ./polydem run {shlex.quote(str(outcome.request.namelist))} {' '.join(words)}"
