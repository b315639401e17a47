"""The table of times of a run."""

from __future__ import annotations

from ..base.emit import Table
from .trajectory import Trajectory

HEADING = ("stage", "steps", "least [us]", "mean [us]", "most [us]", "total [s]", "share [%]")


def timing_rows(trajectory: Trajectory) -> list[tuple[str, ...]]:
    """One row of texts per stage that ran, then `other` and `all`."""
    profile = trajectory.profile
    whole = profile["seconds"]
    rows = []
    for k, stage in enumerate(profile["stage"]):
        calls, total = int(profile["calls"][k]), float(profile["total"][k])
        if calls == 0:
            continue
        per_step = (profile["least"][k], total / calls, profile["most"][k])
        rows.append((stage, str(calls), *(f"{1e6 * t:.2f}" for t in per_step), f"{total:.3f}", _share(total, whole)))
    other = whole - float(sum(profile["total"]))
    rows.append(("other", "", "", "", "", f"{other:.3f}", _share(other, whole)))
    rows.append(("all", "", "", "", "", f"{whole:.3f}", _share(whole, whole)))
    return rows


def timing_table(trajectory: Trajectory, form: str = "text") -> str:
    """The table in one of the forms of `emit.FORMATS`."""
    table = Table("times", "Times of the stages", HEADING)
    for row in timing_rows(trajectory):
        table.add(*row)
    return table.written(form)


def _share(part: float, whole: float) -> str:
    return f"{100.0 * part / whole:.1f}" if whole > 0.0 else "0.0"
