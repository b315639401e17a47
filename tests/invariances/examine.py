"""All invariances of one scene."""

import itertools
import random
import shutil
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from always import faults, impact
from compare import bound_of, differences
from draw import draw
from runs import Play, play
from tables import excepted, impossible_pairs, read_table
from transforms import INVARIANCES

#: A step that is too long is noticed at checks, which another run may have at other steps
UNSTABLE = "of the stable step"
#: Runs with other last bits, and by how much [relative to the greatest coordinate and speed]
DISTURBED, BITS = 2, 2e-15


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

    def find(self, name, text):
        self.findings.append(Finding(self.seed, name, self.tags, text))


def sparse(scene):
    """Let a scene have rows of the series at frames only, or none if it has no sample."""
    output = scene.groups["output"]
    if "sample" in scene.tags or len(scene.periodic) == 2:
        output["series_interval"] = output["frame_interval"]
    else:
        output.pop("series_interval", None)


def disturbed(scene, dice, scale):
    """The scene with other last bits."""
    other = scene.copy()
    sparse(other)
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
        if name.startswith("sink."):
            del first.groups[name]
        else:
            del first.groups[name]["stage"]
    first.put("integrate", duration=scene.prelude*first.dt)
    first.groups["output"].pop("series_interval", None)
    return [Play(first), Play(parts[0].scene, scene.start), *parts[1:]]


def touching_pairs(scene, answer):
    """Pairs of capabilities that act on a body that touches others: on itself, or on those that it touches."""
    single = set().union(*scene.acts.values()) if scene.acts else set()
    guests = {"source": {int(i) for frame in answer.frames for i in frame.id} - {body.id for body in scene.bodies},
              "sink": {int(i) for i in answer.departures.get("id", ())}}
    cells = scene.tags & {"periodic_x", "periodic_y", "periodic_xy", "sheared"}
    everywhere = scene.tags - single - guests.keys() - cells
    found = set()
    for frame in answer.frames:
        acts = {}
        for one, two in frame.contacts if frame.contacts is not None else ():
            ends = int(one), int(two)
            act = set().union(*(scene.acts.get(k, set()) for k in ends))
            act |= {tag for tag, ids in guests.items() if ids & set(ends)}
            if frame.size is not None and (not answer.fixed & set(ends) or "rows" in act):
                apart = abs(frame.position[frame.row(one)] - frame.position[frame.row(two)])
                across = [axis for axis in scene.periodic if apart[axis] > 0.5*frame.size[axis]]
                if across and ("sheared" not in cells or 1 in across):
                    act |= cells
            for k in set(ends) - answer.fixed:
                acts.setdefault(k, set(everywhere)).update(act)
        found |= {pair for act in acts.values() for pair in itertools.combinations(sorted(act), 2)}
    return found


@dataclass(frozen=True)
class Choice:
    """What is tried of a scene, and where."""

    program: Path
    folder: Path
    #: The program with MPI, if runs of several ranks are tried
    parallel: Path = None
    keep: bool = False
    #: Names of invariances; empty: all
    only: frozenset = frozenset()
    #: How many invariances are tried; 0: all
    most: int = 0


def examine(seed, choice):
    """Try the invariances of the scene of a seed."""
    scene = draw(seed, impossible_pairs())
    report = Report(seed, tuple(sorted(scene.tags)))
    home = choice.folder/f"seed_{seed}"
    shutil.rmtree(home, ignore_errors=True)
    try:
        look(scene, report, choice, home)
    finally:
        if not choice.keep:
            shutil.rmtree(home, ignore_errors=True)
    return report


def look(scene, report, choice, home):
    """Run a scene, judge its answer, and compare it with those of its copies."""
    answer = play([choice.program], begin(scene), home/"scene")
    if answer.crashed or (answer.refused and not answer.reason):
        report.fate = "crashed"
        report.find("scene", f"ended with code {answer.code}: {answer.reason}")
        return
    if answer.code != 0:
        report.fate, report.reason = ("refused" if answer.refused else "stopped"), answer.reason
        return
    if not any(len(frame.contacts) for frame in answer.frames):
        report.fate = "no contact"
        return
    report.pairs = touching_pairs(scene, answer)
    if answer.degenerate:
        # Not drawn, but a word of the table of exceptions
        scene.tags.add("no_direction")
    for name, text in faults(scene, answer):
        report.find(name, text)
    Beside(scene, answer, report, choice, home).try_all()


class Beside:
    """The copies of a scene."""

    def __init__(self, scene, answer, report, choice, home):
        self.scene, self.answer, self.report, self.choice, self.home = scene, answer, report, choice, home
        #: How far the answer is certain; found when it is needed
        self.bound = None

    def try_all(self):
        """Try the invariances that the scene has, or some of them."""
        table = read_table("exceptions")
        names = list(INVARIANCES)
        random.Random(f"{self.report.seed} order").shuffle(names)
        for name in names:
            if self.choice.most and len(self.report.compared) >= self.choice.most:
                return
            if name == "ranks" and self.choice.parallel is None:
                continue
            if (self.choice.only and name not in self.choice.only) or excepted(self.scene, name, table):
                continue
            case = INVARIANCES[name](self.scene, random.Random(f"{self.report.seed} {name}"))
            if case is not None:
                self.try_one(name, case)

    def try_one(self, name, case):
        if name != "split_continue":
            # The series costs a third of a run, and only checks of a run alone need it.
            for part in case.parts:
                sparse(part.scene)
        command = [self.choice.program] if case.ranks == 0 else ["mpirun", "-n", str(case.ranks), self.choice.parallel]
        other = play(command, prelude_of(self.scene, case.parts), self.home/name)
        text = ""
        if other.code != 0 and UNSTABLE in other.message:
            return
        if other.code != 0:
            word = "crashed" if other.crashed else "refused" if other.refused else "stopped"
            text = f"{word}: {other.reason}"
        elif case.impact:
            text = impact(case.parts[-1].scene, other)
        else:
            if self.bound is None and not case.exact:
                self.bound = self.find_bound()
            text = differences(self.scene, self.answer, case, other, self.bound)
        if text is not None:
            self.report.compared.append(name)
        if text:
            self.report.find(name, text)

    def find_bound(self):
        """Run the scene with other last bits."""
        scene = self.scene
        scale = max(abs(piece).max() for body in scene.bodies for piece in body.pieces) + scene.size
        others = [play([self.choice.program], begin(disturbed(scene, random.Random(f"{self.report.seed} {k}"), scale)),
                       self.home/f"disturbed_{k}") for k in range(DISTURBED)]
        return bound_of(scene, self.answer, others)
