"""Rows of the table of `./polydem verify` that come from Python: columns and numbers as in verification_table.f90."""

import os
import subprocess
from dataclasses import astuple, dataclass

HEADINGS = ("benchmark", "quantity", "expected", "got", "error", "tolerance", "seconds", "verdict")


@dataclass(frozen=True)
class Row:
    """One quantity of one benchmark; the numbers are text."""

    benchmark: str
    quantity: str
    expected: str
    got: str
    error: str
    tolerance: str
    #: Processor time [s]
    seconds: str
    #: 'good' or 'MISSED'
    verdict: str


def number(value):
    """A number with six significant digits in its shortest form."""
    if value == 0:
        return "0"
    return f"{value:#.6g}" if 0.1 <= abs(value) < 1e6 else f"{value:.4E}"


def expect_zero(benchmark, quantity, got, tolerance, seconds):
    """Row of a quantity that should vanish up to a tolerance; NaN is a miss."""
    verdict = "good" if abs(got) <= tolerance else "MISSED"
    return Row(benchmark, quantity, "0", number(got), f"{abs(got):.1E}", f"{tolerance:.1E}", f"{seconds:.2f}", verdict)


def print_row(row):
    """Print a row in the columns of the program `verify`."""
    print(f"{row.benchmark:5s} {row.quantity:72s} {row.expected:12s} {row.got:12s} {row.error:8s} "
          f"{row.tolerance:9s} {row.seconds:>7s} {row.verdict}", flush=True)


def revision():
    """The revision of the sources, with -dirty if they have changed since."""
    here = os.path.dirname(os.path.abspath(__file__))
    command = ["git", "-C", here, "describe", "--always", "--dirty", "--exclude=*"]
    asked = subprocess.run(command, capture_output=True, text=True, check=False)
    return f"revision {asked.stdout.strip()}" if asked.returncode == 0 else "an unknown revision"


def write_rows(rows, folder, behind):
    """Write table.csv and table.md into a folder, or append to the existing tables."""
    os.makedirs(folder, exist_ok=True)
    cells = [astuple(row) for row in rows]
    csv = [f'{row[0]},"{row[1]}",{",".join(row[2:])}' for row in cells]
    markdown = [f"| {' | '.join(row)} |" for row in cells]
    if not behind:
        csv.insert(0, ",".join(HEADINGS))
        markdown = ["# Verification", "", f"Sources of {revision()}.", "",
                    "| " + " | ".join(HEADINGS).replace("seconds", "s") + " |",
                    "|---|---|--:|--:|--:|--:|--:|---|", *markdown]
    for name, lines in (("table.csv", csv), ("table.md", markdown)):
        with open(os.path.join(folder, name), "a" if behind else "w", encoding="utf-8") as file:
            file.write("\n".join(lines) + "\n")
