"""Count the halo exchange of small packings and check the counts: check_counts.py COUNT_EXCHANGE MPIEXEC...

Four ranks with n grains each have halo bodies in a strip along the inner edges; their number is known up to a factor.
"""

import csv
import math
import subprocess
import sys

GRAINS = 20000


def count(program: str, launch: list, ranks: int) -> list:
    """Rows of one call."""
    path = f"counts_{ranks}.csv"
    subprocess.run([*launch, str(ranks), program, path, str(GRAINS)], check=True)
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return [{name: word if name == "shape" else float(word) for name, word in row.items()} for row in rows]


def complaints(row: dict) -> list:
    """Failures of a row."""
    found = []
    own = row["grains"] / row["ranks"]
    if abs(row["grains"] - GRAINS) > 0.02 * GRAINS:
        found.append("wrong number of grains")
    if not own <= row["grains_most"] <= own + 2.0 or abs(row["imbalance"] - row["grains_most"] / own) > 1e-6:
        found.append("grains are not distributed evenly")
    if row["bytes"] != 48 * row["halo_bodies"] or row["bytes_most"] < 48 * row["halo_bodies_most"]:
        found.append("bytes are not those of the halo bodies")
    if row["ranks"] == 1:
        return found + (["a single rank has halo bodies"] if row["halo_bodies"] or row["messages"] else [])
    strip = (1.0 + 2.0 * row["margin"]) * math.sqrt(own)
    if not 0.5 * strip < row["halo_bodies_most"] < 4.0 * strip:
        found.append("halo bodies are not in a strip")
    if not 2 * row["ranks"] - 2 <= row["messages"] <= row["ranks"] * (row["ranks"] - 1):
        found.append("messages do not connect the ranks")
    return found


def main() -> int:
    program, launch = sys.argv[1], sys.argv[2:]
    rows = count(program, launch, 1) + count(program, launch, 4)
    wrong = [f"{row}: {what}" for row in rows for what in complaints(row)]
    if len(rows) != 20:
        wrong.append(f"{len(rows)} rows")
    for narrow, wide in zip(rows, rows[1:]):
        if narrow["margin"] < wide["margin"] and narrow["halo_bodies"] > wide["halo_bodies"]:
            wrong.append(f"{wide}: fewer halo bodies with a wider margin")
    print(*wrong, sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
