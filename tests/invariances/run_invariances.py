"""Run drawn scenes beside copies whose answer is known, and print what differs.

usage: run_invariances.py PROGRAM [--seed N] [--count N] [--seconds S] [--most N] [--only NAME,...] [--jobs N]
                          [--folder FOLDER] [--keep] [--pairs FILE] [--mpi PROGRAM]

The Python of .venv runs it if that of the command lacks h5py. Exit code 1: something differs.
"""

import argparse
import collections
import concurrent.futures
import itertools
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PYTHON = ROOT/".venv"/"bin"/"python"
#: How many scenes each pair of capabilities should act in
ENOUGH = 20


def options():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=Path)
    parser.add_argument("--seed", type=int, default=1, help="seed of the first scene")
    parser.add_argument("--count", type=int, default=1, help="number of scenes")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="no scene begins later")
    parser.add_argument("--most", type=int, default=0, help="most invariances of a scene; 0: all")
    parser.add_argument("--only", default="", help="names of invariances")
    parser.add_argument("--jobs", type=int, default=1, help="scenes at the same time")
    parser.add_argument("--folder", type=Path, help="where runs are")
    parser.add_argument("--keep", action="store_true", help="keep all runs")
    parser.add_argument("--pairs", type=Path, help="CSV file of pairs of capabilities and their numbers of scenes")
    parser.add_argument("--mpi", type=Path, help="program with MPI, for runs of several ranks")
    return parser.parse_args()


def reports_of(choice, given):
    """Reports in the order of the seeds, as they come."""
    from examine import examine

    end = time.monotonic() + given.seconds
    seeds = iter(range(given.seed, given.seed + given.count))
    with concurrent.futures.ProcessPoolExecutor(given.jobs) as pool:
        waiting = collections.deque(pool.submit(examine, seed, choice)
                                    for seed in itertools.islice(seeds, 2*given.jobs))
        while waiting:
            yield waiting.popleft().result()
            if time.monotonic() < end:
                waiting.extend(pool.submit(examine, seed, choice) for seed in itertools.islice(seeds, 1))


def main():
    from examine import Choice

    given = options()
    folder = given.folder or Path(tempfile.mkdtemp(prefix="invariances_"))
    folder.mkdir(parents=True, exist_ok=True)
    choice = Choice(given.program.resolve(), folder.resolve(), given.mpi and given.mpi.resolve(), given.keep,
                    frozenset(filter(None, given.only.split(","))), given.most)
    reports = []
    for report in reports_of(choice, given):
        reports.append(report)
        for finding in report.findings:
            print(f"{finding.seed:7} {finding.invariance:16} {finding.text}\n{'':24} {' '.join(finding.tags)}",
                  flush=True)
    print_summary(reports)
    if given.pairs:
        write_pairs(given.pairs, reports)
    if given.keep:
        print(f"runs: {folder}")
    elif not given.folder:
        shutil.rmtree(folder, ignore_errors=True)
    return int(any(report.findings for report in reports))


def print_summary(reports):
    """What became of the scenes, how often each invariance was tried, and which pairs are rare."""
    from transforms import INVARIANCES

    fates = collections.Counter(report.fate for report in reports)
    print(f"{len(reports)} scenes: " + ", ".join(f"{n} {fate}" for fate, n in fates.most_common()))
    reasons = collections.Counter((report.fate, report.reason) for report in reports if report.reason)
    for (fate, reason), n in reasons.most_common():
        print(f"{n:7} {fate}: {reason}")
    found = collections.Counter(finding.invariance for report in reports for finding in report.findings)
    compared = collections.Counter(name for report in reports for name in report.compared)
    print(f"{'invariance':18} {'tried':>7} {'differ':>7}")
    for name in dict.fromkeys((*INVARIANCES, *found)):
        print(f"{name:18} {compared[name] if name in INVARIANCES else fates['counted']:7} {found[name]:7}")
    counts = pair_counts(reports)
    rare = [pair for pair, n in counts.items() if n < ENOUGH]
    print(f"{len(counts)} pairs of capabilities are possible, {len(rare)} acted on a touching body in fewer than "
          f"{ENOUGH} scenes")


def pair_counts(reports):
    """Number of scenes in which two capabilities acted on one touching body, by pair that is possible."""
    from capabilities import CAPABILITIES, alternatives
    from tables import impossible_pairs

    impossible = impossible_pairs()
    counts = collections.Counter(pair for report in reports for pair in report.pairs)
    return {pair: counts[pair] for pair in itertools.combinations(sorted(CAPABILITIES), 2)
            if frozenset(pair) not in impossible and not alternatives(pair)}


def write_pairs(path, reports):
    """Write the number of scenes of each pair, the rarest first."""
    counts = pair_counts(reports)
    lines = [f"{one},{two},{n}\n" for (one, two), n in sorted(counts.items(), key=lambda item: item[::-1])]
    path.write_text("one,other,scenes\n" + "".join(lines), encoding="utf-8")


if __name__ == "__main__":
    try:
        import h5py  # noqa: F401
    except ImportError:
        if Path(sys.executable) == PYTHON or not PYTHON.exists():
            sys.exit(f"{sys.executable} lacks h5py; ./polydem test makes an environment that has it")
        os.execv(PYTHON, [str(PYTHON), *sys.argv])
    sys.exit(main())
