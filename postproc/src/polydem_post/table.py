"""The table of times of a run, for people, manuals, papers and spreadsheets."""

from __future__ import annotations

from .trajectory import Trajectory

#: How a table can be written
FORMATS = ("text", "markdown", "latex", "csv")

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
    """The table in one of FORMATS."""
    rows = timing_rows(trajectory)
    if form == "csv":
        return "\n".join(",".join(row) for row in [HEADING, *rows])
    if form == "markdown":
        rule = ("---", *("---:" for _ in HEADING[1:]))
        return "\n".join("| " + " | ".join(row) + " |" for row in [HEADING, rule, *rows])
    if form == "latex":
        return _latex(rows)
    widths = [max(len(row[k]) for row in [HEADING, *rows]) for k in range(len(HEADING))]
    return "\n".join(_aligned(row, widths) for row in [HEADING, *rows])


def _aligned(row: tuple[str, ...], widths: list[int]) -> str:
    cells = [row[0].ljust(widths[0])] + [cell.rjust(width) for cell, width in zip(row[1:], widths[1:])]
    return "  ".join(cells).rstrip()


def _latex(rows: list[tuple[str, ...]]) -> str:
    """A table of the package booktabs."""
    heading = (text.replace("us]", r"$\mu$s]").replace("%", r"\%") for text in HEADING)
    lines = [r"\begin{tabular}{l" + "r" * (len(HEADING) - 1) + "}", r"\toprule"]
    lines += [" & ".join(heading) + r" \\", r"\midrule"]
    lines += [" & ".join(row) + r" \\" for row in rows]
    lines += [r"\bottomrule", r"\end{tabular}"]
    return "\n".join(lines)


def _share(part: float, whole: float) -> str:
    return f"{100.0 * part / whole:.1f}" if whole > 0.0 else "0.0"
