"""Run drawn scenes beside transformed copies whose answer is known, and print what differs.

usage: run_invariances.py PROGRAM [--seed N] [--count N] [--seconds S] [--jobs N] [--folder DIR] [--keep] [--only NAMES]
"""

import argparse
import collections
import concurrent.futures
import itertools
import os
import random
import shutil
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from always import faults
from compare import bound_of, differences
from draw import CAPABILITIES, draw
from runs import Play, play
from transforms import INVARIANCES, excepted, impossible_pairs, read_table

#: Runs with other last bits, and by how much [relative to the greatest coordinate and speed]
DISTURBED, BITS = 2, 2e-15
#: Restitutions of cut bodies agree within this
RESTITUTION = 0.04


@dataclass
class Finding:
    """Something that differs, or is wrong by itself."""

    seed: int
    invariance: str
    tags: tuple
    text: str


@dataclass
class Report:
    """What became of one scene."""

    seed: int
    tags: tuple
    #: 'counted', 'refused', 'stopped', 'no contact'
    fate: str = "counted"
    reason: str = ""
    findings: list = field(default_factory=list)
    compared: list = field(default_factory=list)
    #: Pairs of capabilities that acted on a touching body
    pairs: set = field(default_factory=set)


def disturbed(scene, dice, scale):
    """The scene with other last bits."""
    other = scene.copy()
    other.groups["output"].pop("series_interval", None)
    speed = max((np.hypot(*body.velocity) for body in scene.free), default=0.0) + scene.size/(scene.steps*scene.dt)
    for body in other.bodies:
        body.move(BITS*scale*np.array([dice.uniform(-1, 1), dice.uniform(-1, 1)]))
        if not body.fixed:
            body.velocity = body.velocity + BITS*speed*np.array([dice.uniform(-1, 1), dice.uniform(-1, 1)])
            body.spin += BITS*speed/scene.size*dice.uniform(-1, 1)
    return other


def begin(scene):
    """The play of a scene: one run, or a prelude and one that starts from its result."""
    return prelude_of(scene, [Play(scene)])


def prelude_of(scene, parts):
    """Put the prelude of a scene before a play: without stages, for some steps."""
    if not scene.start:
        return parts
    first = parts[0].scene.copy()
    for name in first.named("stage"):
        del first.groups[f"stage.{name}"]
    for name in [name for name, group in first.groups.items() if "stage" in group]:
        del first.groups[name]["stage"]
    first.put("integrate", duration=scene.prelude*first.dt)
    first.groups["output"].pop("series_interval", None)
    return [Play(first), Play(parts[0].scene, scene.start), *parts[1:]]


def touching_pairs(scene, answer):
    """Pairs of tags that act on a body that touches another one."""
    single = set().union(*scene.acts.values()) if scene.acts else set()
    guests = {"source": {int(i) for frame in answer.frames for i in frame.id} - {body.id for body in scene.bodies},
              "sink": {int(i) for i in answer.departures.get("id", ())}}
    everywhere = scene.tags - single - {"source", "sink", "periodic_x", "periodic_y", "periodic_xy", "sheared"}
    found = set()
    for frame in answer.frames:
        for one, two in frame.contacts if frame.contacts is not None else ():
            act = everywhere | scene.acts.get(int(one), set()) | scene.acts.get(int(two), set())
            act |= {tag for tag, ids in guests.items() if int(one) in ids or int(two) in ids}
            if frame.size is not None:
                a, b = frame.row(one), frame.row(two)
                apart = abs(frame.position[a] - frame.position[b])
                if int(one) not in answer.fixed and int(two) not in answer.fixed or "rows" in act:
                    across = [axis for axis in scene.periodic if apart[axis] > 0.5*frame.size[axis]]
                    if across and ("sheared" not in scene.tags or 1 in across):
                        act |= scene.tags & {"periodic_x", "periodic_y", "periodic_xy", "sheared"}
            found |= set(itertools.combinations(sorted(act), 2))
    return found


def restitution(scene, answer):
    """Speed of separation over that of approach, of body 1 from all others that are free or fixed; None without it."""
    first, last = answer.frames[0], answer.frames[-1]
    def relative(frame):
        return frame.velocity[frame.row(1)][1] - frame.velocity[frame.row(2)][1]
    return -relative(last)/relative(first)


def examine(program, seed, only, folder, keep):
    """All invariances of the scene of a seed."""
    scene = draw(seed, impossible_pairs())
    report = Report(seed, tuple(sorted(scene.tags)))
    home = Path(folder)/f"seed_{seed}"
    shutil.rmtree(home, ignore_errors=True)
    try:
        look(program, scene, report, only, home)
    finally:
        if not keep:
            shutil.rmtree(home, ignore_errors=True)
    return report


def look(program, scene, report, only, home):
    def find(name, text):
        report.findings.append(Finding(report.seed, name, report.tags, text))

    answer = play(program, begin(scene), home/"scene")
    if answer.crashed or answer.refused and not answer.reason:
        find("scene", f"ended with code {answer.code}: {answer.reason}")
        report.fate = "crashed"
        return
    if answer.code != 0:
        report.fate, report.reason = ("refused" if answer.refused else "stopped"), answer.reason
        return
    if not any(len(frame.contacts) for frame in answer.frames):
        report.fate = "no contact"
        return
    report.pairs = touching_pairs(scene, answer)
    for name, text in faults(scene, answer):
        find(name, text)
    dice = random.Random(report.seed)
    bound = None
    table = read_table("exceptions")
    for name, function in INVARIANCES.items():
        own = random.Random(f"{report.seed} {name}")
        if only and name not in only or excepted(scene, name, table):
            continue
        case = function(scene, own)
        if case is None or (scene.kind == "impact") != case.impact and name not in ("far_wall", "units", "order"):
            continue
        if name != "split_continue":
            # The series costs a third of a run, and only checks of a run alone need it.
            for part in case.parts:
                part.scene.groups["output"].pop("series_interval", None)
        other = play(program, prelude_of(scene, case.parts), home/name)
        report.compared.append(name)
        if other.code != 0:
            word = "crashed" if other.crashed else "refused" if other.refused else "stopped"
            find(name, f"{word}: {other.reason}")
            continue
        if case.impact:
            one, two = restitution(scene, answer), restitution(scene, other)
            if abs(one - two) > RESTITUTION:
                find(name, f"restitution {two:.3f} instead of {one:.3f}")
            continue
        if bound is None and not case.exact:
            scale = max(abs(piece).max() for body in scene.bodies for piece in body.pieces) + scene.size
            others = [play(program, begin(disturbed(scene, dice, scale)), home/f"disturbed_{k}") for k in range(DISTURBED)]
            bound = bound_of(scene, answer, others)
        text = differences(scene, answer, case, other, bound)
        if text:
            find(name, text)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=0.0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--keep", action="store_true")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    folder = options.folder or Path(tempfile.mkdtemp(prefix="invariances_"))
    folder.mkdir(parents=True, exist_ok=True)
    only = set(filter(None, options.only.split(",")))
    program = options.program.resolve()
    began, reports = time.monotonic(), []
    with concurrent.futures.ProcessPoolExecutor(options.jobs) as pool:
        futures = [pool.submit(examine, program, seed, only, folder, options.keep)
                   for seed in range(options.seed, options.seed + options.count)]
        for future in futures:
            report = future.result()
            reports.append(report)
            for finding in report.findings:
                print(f"{finding.seed:6} {finding.invariance:16} {finding.text}\n{'':24}{' '.join(finding.tags)}", flush=True)
    summary(reports)
    print(f"{time.monotonic() - began:.0f} s")
    if not options.keep and not options.folder:
        shutil.rmtree(folder, ignore_errors=True)
    return int(any(report.findings for report in reports))


def summary(reports):
    fates = collections.Counter(report.fate for report in reports)
    print(f"{len(reports)} scenes: " + ", ".join(f"{n} {fate}" for fate, n in fates.most_common()))
    reasons = collections.Counter((report.fate, report.reason[:110]) for report in reports if report.reason)
    for (fate, reason), n in reasons.most_common(40):
        print(f"  {n:4} {fate}: {reason}")
    found = collections.Counter(finding.invariance for report in reports for finding in report.findings)
    compared = collections.Counter(name for report in reports for name in report.compared)
    for name in dict.fromkeys((*INVARIANCES, *found)):
        print(f"  {name:18} {compared[name] or len(reports):5} compared {found[name]:5} differ")


if __name__ == "__main__":
    sys.exit(main())
