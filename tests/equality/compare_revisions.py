"""The guard of a change that must not change a bit: runs of the present tree against those of an older revision.

usage: compare_revisions.py [--base REVISION] [--only PATTERN] [--list] [--keep] [--jobs N]
       compare_revisions.py --time [REPEATS]

Builds the base revision (HEAD if none is given) and the working tree in build/guard, without MPI and with it, does the
same runs with both and compares bit for bit: state hash, frames, contacts, forces on walls, ledger, counters, traces,
single steps. PATTERN is a regular expression for names of cases (--list shows them). Results of runs that differ stay
in build/guard/*/work/cases, with --keep all. --time compares the times of steps instead.
Exit code 0: all equal, 1: not.

Names that changed since the base are in guard_names.py, the cases in guard_cases.py.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import guard_python
from guard_cases import Case, generated_cases
from guard_names import BASE, PRESENT
from guard_results import differences, read_result, read_samples
from guard_runs import GuardError, Side, UnknownError, call, extract, write_bodies

ROOT = guard_python.ROOT
#: Updates of bodies in a shortened run of inputs, and the greatest number of its steps
WORK, MOST_STEPS = 1_500_000, 4000
#: Bodies of the groups &stage and &motion
STAGE, MOTION = (re.compile(rf"^\s*&{group}\b(.*?)/\s*$", re.MULTILINE | re.DOTALL)
                 for group in ("stage", "motion"))
#: Settings of the bed from which drums are packed: it need not rest, but is looser then
PATCH = {"integrate.duration": "0.15"}


@dataclass
class Outcome:
    """What the comparison of a case gave."""

    case: Case
    wrong: list = field(default_factory=list)
    notes: list = field(default_factory=list)
    verdict: str = "equal"
    steps: int = 0
    contacts: int = 0
    numbers: int = 0
    seconds: float = 0.0


def say(text):
    """A line for the reader."""
    print(text, flush=True)


def shorten(present, source, extra=None):
    """The case of a namelist of inputs, as short as its bodies are many; None if it describes no run."""
    path = present.sources / "inputs" / f"{source}.nml"
    text = path.read_text(encoding="utf-8")
    if re.search(r"^&bench\b", text, re.MULTILINE):
        return None
    settings = {"output.contacts": ".true.", "output.frames_per_segment": "4", **(extra or {})}
    if "trace_start" in text:
        settings.update({"output.trace_start": "0", "output.trace_steps": "10"})
    for body in MOTION.findall(text):
        if re.search(r"\bstart *=", body):
            settings[f"motion.{name_of(body)}.start"] = "0"
    if re.search(r"^ *name = '(drum|hopper|bed|heap)'", text, re.MULTILINE) and "packing" not in text and not extra:
        # Loose grains would fall without any contact for all of the time.
        settings["scene.speed"] = "2.0"
    code, output = present.run(["check", str(path), *present.overrides(settings)])
    found = [re.search(pattern, output) for pattern in (
        r"\nbodies +(\d+) free, (\d+) fixed", r"\nduration +(?:at most )?(\S+) s, (\d+) steps")]
    if code != 0 or None in found:
        raise GuardError(f"inputs/{source}.nml: check ended with {code}:\n{output[-2000:]}")
    bodies, steps = int(found[0][1]) + int(found[0][2]), int(found[1][2])
    fewer = min(steps, MOST_STEPS, max(20, WORK // bodies))
    duration = float(found[1][1]) * fewer / steps
    settings.update({**durations(text, duration), "output.frame_interval": f"{duration / 5:.8g}"})
    return Case(f"{'packed' if extra else 'inputs'}/{source}", settings, source)


def name_of(body):
    """The name of an instance of a group."""
    return re.search(r"name *= *'(\w+)'", body)[1]


def durations(text, duration):
    """Overrides that make a run take a time: that of the run, or of its stages, each with its share."""
    stages = [re.sub("!.*", "", body) for body in STAGE.findall(text)]
    found = {} if stages else {"integrate.duration": f"{duration:.8g}"}
    for body in stages:
        stage = f"stage.{name_of(body)}"
        if re.search(r"until *= *'(?!duration)", body):
            found.update({f"{stage}.longest": f"{duration / len(stages):.8g}", f"{stage}.at_limit": "next",
                          f"{stage}.check": "10", f"{stage}.hold": "0"})
        else:
            found[f"{stage}.duration"] = f"{duration / len(stages):.8g}"
    return found


def list_cases(present):
    """All cases: the namelists of the present tree, and those that are generated."""
    folder = present.sources / "inputs"
    sources = sorted(str(path.relative_to(folder).with_suffix("")) for path in folder.rglob("*.nml"))
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        cases = list(pool.map(lambda source: shorten(present, source), sources))
    cases += [shorten(present, source, {"scene.packing": "results/patch"}) for source in sources
              if re.fullmatch(r"drum(_\d+)?", source)]
    manual = (folder / "entries.md").read_text(encoding="utf-8")
    return [case for case in cases if case is not None] + generated_cases(manual)


def prepare(side):
    """The bed from which drums are packed, by each revision itself."""
    result = side.work / "results" / "patch"
    shutil.rmtree(result, ignore_errors=True)
    words = side.overrides({**PATCH, "output.folder": "results/patch"})
    path = side.sources / side.names.place("inputs") / side.names.place("patch")
    code, output = side.run(["run", str(path), *words])
    if code != 0:
        raise GuardError(f"{path} ended with {code}:\n{output[-2000:]}")


def compare(case, base, present, keep):
    """Do a case with both revisions and compare what they leave."""
    began = time.monotonic()
    outcome = Outcome(case)
    try:
        (folder, code, output), (other, other_code, other_output) = (side.run_case(case) for side in (base, present))
        whole = case.whole and not case.attempts
        if case.replay:
            expected, found = read_samples(folder, base.names), read_samples(other, present.names)
        else:
            expected, found = (read_result(place, side.names, whole, case.ranks or 1)
                               for place, side in ((folder, base), (other, present)))
        if code != other_code:
            outcome.wrong.append(f"exit code {code} became {other_code}: {other_output.strip()[-300:]}")
        wrong, outcome.notes = differences(expected, found, base.names)
        outcome.wrong += wrong
        describe(outcome, code, expected, output)
    except UnknownError as error:
        outcome.verdict = "skipped"
        outcome.notes.append(f"skipped {case.name}: the base has {error}")
        return outcome
    except (GuardError, OSError, KeyError, ValueError, subprocess.TimeoutExpired) as error:
        outcome.wrong.append(f"{type(error).__name__}: {error}")
    if outcome.wrong:
        outcome.verdict = "DIFFERENT"
    elif not keep:
        for side in (base, present):
            shutil.rmtree(side.work / "cases" / case.name, ignore_errors=True)
    outcome.seconds = time.monotonic() - began
    return outcome


def describe(outcome, code, expected, output):
    """Fill in how much was compared."""
    outcome.numbers = sum(value.size for value in expected.values())
    outcome.steps = int(expected.get("counter profile steps", 0))
    outcome.contacts = int(expected.get("counter profile contacts", 0))
    if code != 0:
        outcome.verdict = "refused" if code == 2 else f"ended with {code}"
    elif not expected:
        outcome.wrong.append(f"the base left nothing to compare: {output[-300:]}")


def report(outcomes, seconds):
    """The table of all groups, and all that differs; the exit code."""
    say(f"\n{'group':10} {'cases':>6} {'equal':>6} {'stopped':>8} {'refused':>8} {'skipped':>8} {'different':>10} "
        f"{'steps':>9} {'contacts':>11} {'numbers':>11}")
    groups = {}
    for outcome in outcomes:
        groups.setdefault(outcome.case.name.split("/")[0], []).append(outcome)
    groups["all"] = outcomes
    for name, group in groups.items():
        counts = [sum(outcome.verdict.startswith(word) for outcome in group)
                  for word in ("equal", "ended", "refused", "skipped", "DIFFERENT")]
        sums = [sum(getattr(outcome, what) for outcome in group) for what in ("steps", "contacts", "numbers")]
        say(f"{name:10} {len(group):6} {counts[0]:6} {counts[1]:8} {counts[2]:8} {counts[3]:8} {counts[4]:10} "
            f"{sums[0]:9} {sums[1]:11} {sums[2]:11}")
    notes = sorted({note for outcome in outcomes for note in outcome.notes})
    if notes:
        say("\nnot compared: " + "; ".join(notes))
    different = [outcome for outcome in outcomes if outcome.wrong]
    for outcome in different:
        say(f"\nDIFFERENT {outcome.case.name}")
        for sentence in outcome.wrong[:8]:
            say(f"    {sentence}")
        if len(outcome.wrong) > 8:
            say(f"    and {len(outcome.wrong) - 8} more")
    verdict = f"{len(different)} differ" if different else "no bit differs"
    say(f"\n{len(outcomes)} cases in {seconds:.0f} s: {verdict}")
    return int(bool(different))


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("usage: ")[1].split("\n\n")[0], add_help=True)
    parser.add_argument("--base", default="HEAD")
    parser.add_argument("--only", default="")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--keep", action="store_true")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--time", type=int, nargs="?", const=9, default=0)
    arguments = parser.parse_args()
    folder = ROOT / "build" / "guard"
    has_mpi = shutil.which("mpirun") is not None and shutil.which("mpifort") is not None
    began = time.monotonic()
    try:
        revision = call(["git", "-C", ROOT, "rev-parse", "--short", f"{arguments.base}^{{commit}}"]).strip()
        base = Side(BASE, folder / revision / "source", folder / revision, has_mpi)
        present = Side(PRESENT, ROOT, folder / "present", has_mpi)
        extract(ROOT, revision, base.sources)
        base.build(say, frozen=True)
        present.build(say, frozen=False)
        with ThreadPoolExecutor(arguments.jobs) as pool:
            list(pool.map(prepare, (base, present)))
        write_bodies(base, present)
        if arguments.time:
            from guard_times import SOURCES, compare_times
            packed = [shorten(present, source, {"scene.packing": "results/patch"}) for source in SOURCES]
            return compare_times(base, present, arguments.time, say, packed)
        cases = [case for case in list_cases(present) if re.search(arguments.only, case.name)]
        if arguments.list or not cases:
            say("\n".join(case.name for case in cases) or f"no case has a name like {arguments.only}")
            return int(not cases)
        return compare_all(cases, base, present, arguments, began)
    except GuardError as error:
        say(f"compare_revisions: {error}")
        return 1


def compare_all(cases, base, present, arguments, began):
    """Do all cases, each line as soon as it is known; the exit code."""
    if not base.has_mpi:
        say("no MPI here: runs of several processes are left out")
        cases = [case for case in cases if case.ranks is None and not any(case.attempts)]
    say(f"built and prepared in {time.monotonic() - began:.0f} s; {len(cases)} cases")
    outcomes = []
    with ThreadPoolExecutor(arguments.jobs) as pool:
        for outcome in pool.map(lambda case: compare(case, base, present, arguments.keep), cases):
            outcomes.append(outcome)
            say(f"{outcome.verdict:12} {outcome.case.name:55} {outcome.steps:6} steps {outcome.contacts:9} contacts "
                f"{outcome.seconds:6.1f} s{''.join(f'  {sentence[:150]}' for sentence in outcome.wrong[:1])}")
    return report(outcomes, time.monotonic() - began)


if __name__ == "__main__":
    sys.exit(main())
