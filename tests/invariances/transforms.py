"""The invariances: each makes of a scene another one whose answer is known, or says that it does not apply.

A function gets the scene and dice, and gives a `Case`, or None. Whole capabilities that break an invariance for a reason
stand in the table of exceptions of README.md, and nowhere else.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from runs import Play
from scene import Body, Map

#: What has a rectangle that stays where it is
RECTANGLES = {"source", "sink", "sample", "until_count", "until_solid_fraction"}
#: Where the page has the table of exceptions
PAGE = Path(__file__).with_name("README.md")


@dataclass
class Case:
    """A play, and how its answer follows from that of the scene."""

    parts: list
    #: Change of coordinates and units
    change: Map = field(default_factory=Map)
    #: Identifier in the scene -> identifiers in the other one; others are the same
    ids: dict = field(default_factory=dict)
    #: Velocity that all bodies have beside [m/s], in the units of the other scene
    drift: np.ndarray = field(default_factory=lambda: np.zeros(2))
    #: Bodies that are in the other scene only
    extra: set = field(default_factory=set)
    #: Steps of the scene before the last run of the play began
    before: int = 0
    #: Number of copies, by which energies are multiplied
    copies: int = 1
    #: Whether all bits are the same, up to powers of two
    exact: bool = False
    #: Whether only places and velocities relative to a body are the same
    relative: bool = False
    #: Tolerance relative to size and speed that is allowed, where a run goes on without its history
    loose: float = 0.0
    #: Angles by which bodies have turned before a run that starts from a frame
    turned: dict = None
    #: Whether energies are the same, and means over the sample
    energies: bool = True
    #: Compared by restitution, not by poses
    impact: bool = False


def read_table(name):
    """Rows of a table of the page: the capabilities of its first column, and the words of the second."""
    table = PAGE.read_text(encoding="utf-8").split(f"<!-- {name} -->")[1].split(f"<!-- /{name} -->")[0]
    rows = re.findall(r"^\| `([\w +]+)` \| ([\w, ]+) \| .+ \|$", table, re.MULTILINE)
    if len(rows) != table.count("\n|") - 2:
        raise ValueError(f"README.md: the table of {name} was not understood")
    return [(frozenset(tags.split(" + ")), word) for tags, words in rows for word in words.split(", ")]


def impossible_pairs():
    """Pairs of capabilities that no scene has."""
    return {tags | {word} for tags, word in read_table("impossible")}


def excepted(scene, name, table):
    """Whether the table says that a scene need not have an invariance."""
    return any(other == name and tags <= scene.tags for tags, other in table)


# Coordinates and units
def quarter_turn(scene, dice):
    change = Map(matrix=np.array([[0.0, -1.0], [1.0, 0.0]]))
    return Case([Play(scene.mapped(change))], change)


def mirror(scene, dice):
    change = Map(matrix=np.diag(dice.choice(([-1.0, 1.0], [1.0, -1.0]))))
    return Case([Play(scene.mapped(change))], change)


def units(scene, dice):
    length, mass, time = (2.0**dice.randint(-5, 5) for _ in range(3))
    change = Map(length=length, mass=mass, time=time)
    return Case([Play(scene.mapped(change))], change, exact=True)


def moving_frame(scene, dice):
    """Everything moves beside; walls that span a periodic axis cannot move along it, nor walls along their load."""
    drift = np.array([dice.uniform(-1, 1), dice.uniform(-1, 1)])
    if "long_wall" in scene.tags:
        drift[scene.periodic] = 0.0
    for name in scene.named("load"):
        drift["xy".index(scene.get(f"load.{name}", "direction"))] = 0.0
    if not drift.any():
        return None
    other = scene.copy()
    for body in other.free:
        body.velocity = body.velocity + drift
    if any(body.fixed for body in other.bodies):
        # It comes last: the motions before it keep their pivots.
        other.put("motion.frame", kind="translation", velocity=list(drift))
    return Case([Play(other)], drift=drift, relative="stress_controlled" in scene.tags, energies=False)


# The cell
def border(scene, dice):
    """The border of the cell lies elsewhere. A sheared cell is at rest in its middle, which moves, too."""
    if not scene.periodic:
        return None
    other = scene.copy()
    by = np.zeros(2)
    size = np.array(scene.get("cell", "size"))
    for axis in scene.periodic:
        by[axis] = dice.uniform(0, 1)*size[axis]
    low = np.array(scene.get("cell", "low")) + by
    other.put("cell", low=list(low))
    rate = scene.get("cell", "shear_rate", 0.0)
    drift = np.array([-rate*by[1], 0.0])
    profile = scene.get("cell", "profile", False)
    if rate and (RECTANGLES - {"source"}) & scene.tags:
        # Rectangles would move relative to the bodies.
        by[1], drift, low[1] = 0.0, np.zeros(2), scene.get("cell", "low")[1]
        other.put("cell", low=list(low))
    if rate and "shear_ramp" in scene.tags:
        if profile or {"drag", "local_damping"} & scene.tags:
            return None
        drift = np.zeros(2)
    inside = dice.random() < 0.5
    for body in other.bodies:
        if not profile and not body.fixed:
            body.velocity = body.velocity + drift
        if inside and not (body.fixed and body.reach > 0.4*size[scene.periodic[0]]):
            fold(body, low, size, scene.periodic, 0.0 if profile or "shear_ramp" in scene.tags else rate*size[1])
    for name in scene.named("source"):
        ends = [np.array(scene.get(f"source.{name}", key)) for key in ("low", "high")]
        for axis in scene.periodic:
            cells = -np.floor((ends[0][axis] - low[axis])/size[axis])*size[axis]
            ends[0][axis] += cells
            ends[1][axis] += cells
        other.put(f"source.{name}", low=list(ends[0]), high=list(ends[1]))
    return Case([Play(other)], drift=drift, relative="stress_controlled" in scene.tags,
                energies="sheared" not in scene.tags)


def fold(body, low, size, axes, jump):
    """Put a body into the cell, with the velocity of the border."""
    for axis in axes:
        cells = -np.floor((body.centre[axis] - low[axis])/size[axis])
        by = np.zeros(2)
        by[axis] = cells*size[axis]
        body.move(by)
        if axis == 1:
            body.velocity = body.velocity + np.array([cells*jump, 0.0])


def copies_2x2(scene, dice):
    return copies(scene, (2, 2))


def copies_3x1(scene, dice):
    return copies(scene, (1, 3) if scene.periodic == [1] else (3, 1))


def copies(scene, numbers):
    """A cell of several copies; along axes that are not periodic there is one."""
    if not scene.periodic:
        return None
    numbers = [n if axis in scene.periodic else 1 for axis, n in enumerate(numbers)]
    n = numbers[0]*numbers[1]
    size, rate = np.array(scene.get("cell", "size")), scene.get("cell", "shear_rate", 0.0)
    profile = scene.get("cell", "profile", False)
    sheared = rate != 0.0 and numbers[1] > 1
    if sheared and (RECTANGLES & scene.tags or scene.prelude and "shear_ramp" in scene.tags):
        return None
    other = scene.copy()
    jump = 0.0 if "shear_ramp" in scene.tags else rate*size[1]
    drift = np.array([-0.5*(numbers[1] - 1)*jump, 0.0])
    if "shear_ramp" in scene.tags and (profile or {"drag", "local_damping"} & scene.tags) and sheared:
        return None
    other.put("cell", size=list(size*numbers))
    first = max(body.id for body in scene.bodies)
    ids, free, offsets = {body.id: [] for body in scene.bodies}, [], []
    other.bodies = []
    for m in range(n):
        i, j = m % numbers[0], m//numbers[0]
        offsets.append(np.array([i, j])*size)
        for body in scene.bodies:
            if m > 0 and is_long(scene, body):
                continue
            new = body_copy(body, body.id + m*first)
            new.move(offsets[-1])
            if not body.fixed and not profile:
                new.velocity = new.velocity + np.array([j*jump, 0.0]) + drift
            other.bodies.append(new)
            ids[body.id].append(new.id)
            free.append(new.id)
    for name in scene.named("wall"):
        other.put(f"wall.{name}", bodies=[k for body in scene.groups[f"wall.{name}"]["bodies"] for k in ids[body]])
    for name in scene.named("load"):
        load = other.groups[f"load.{name}"]
        for key in ("force", "stress", "mass"):
            if key in load:
                load[key] *= n
        load["damping_ratio"] *= np.sqrt(n)
    for group in other.groups.values():
        if group.get("until") == "departed":
            group["above"] *= n
    for kind in ("source", "sink"):
        for name in scene.named(kind):
            group = other.groups.pop(f"{kind}.{name}")
            for m, by in enumerate(offsets):
                moved = {**group, "low": list(np.array(group["low"]) + by), "high": list(np.array(group["high"]) + by)}
                other.put(f"{kind}.{name}_{m}", **moved)
    if not scale_cell(other, numbers):
        return None
    return Case([Play(other)], ids=ids, drift=drift, copies=n, relative="stress_controlled" in scene.tags,
                energies=not sheared)


def body_copy(body, identifier):
    return Body(identifier, [piece.copy() for piece in body.pieces], body.fixed, body.velocity.copy(), body.spin,
                body.density, body.material)


def is_long(scene, body):
    """Whether a fixed body spans the cell."""
    return "long_wall" in scene.acts.get(body.id, ())


def scale_cell(scene, numbers):
    """Mass and damping of a cell that obeys a stress; false if one mass does not do for both axes."""
    obeys = scene.get("cell", "obeys", "none")
    if obeys == "none":
        return True
    factors = {"x": numbers[1]/numbers[0], "y": numbers[0]/numbers[1]}
    if obeys == "xy" and numbers[0] != numbers[1]:
        return False
    factor = factors[obeys[0]]
    scene.put("cell", mass=scene.get("cell", "mass")*factor,
              damping_ratio=scene.get("cell", "damping_ratio")*np.sqrt(factor))
    return True


# Order, and what is far away
def corners(scene, dice):
    other = scene.copy()
    for body in other.bodies:
        body.pieces = [np.roll(piece, dice.randint(1, len(piece) - 1), axis=0) for piece in body.pieces]
    return Case([Play(other)])


def order(scene, dice):
    """Other identifiers, bodies and groups in another order; motions, stages and materials keep theirs."""
    other = scene.copy()
    old = [body.id for body in other.bodies]
    new = old[:]
    dice.shuffle(new)
    ids = dict(zip(old, new))
    for body in other.bodies:
        body.id = ids[body.id]
    dice.shuffle(other.bodies)
    for body in other.bodies:
        dice.shuffle(body.pieces)
    for name in other.named("wall"):
        other.put(f"wall.{name}", bodies=[ids[k] for k in other.groups[f"wall.{name}"]["bodies"]])
    kept = [name for name in other.groups if name.startswith(("motion.", "stage.", "material."))]
    names = [name for name in other.groups if name not in kept]
    dice.shuffle(names)
    other.groups = {name: other.groups[name] for name in (*kept, *names)}
    return Case([Play(other)], ids={k: [ids[k]] for k in old})


def far_body(scene, dice, fixed=False):
    if len(scene.periodic) == 2:
        return None
    other = scene.copy()
    away = np.zeros(2)
    axis = 1 - scene.periodic[0] if scene.periodic else dice.choice((0, 1))
    away[axis] = dice.choice((-1, 1))*dice.uniform(5, 20)
    model = scene.free[0]
    new = body_copy(model, max(body.id for body in scene.bodies) + 1)
    new.fixed, new.velocity, new.spin = fixed, np.zeros(2), 0.0
    new.move(away)
    other.bodies.append(new)
    return Case([Play(other)], extra={new.id}, energies=fixed)


def far_wall(scene, dice):
    return far_body(scene, dice, fixed=True)


# Cuts
def cut_body(scene, dice):
    """The body that falls is cut into columns or layers of one width."""
    if scene.kind == "any" or len(scene.bodies[0].pieces) > 1:
        return None
    other = scene.copy()
    columns, layers = dice.choice(((2, 1), (4, 1), (8, 1), (1, 2), (1, 3), (2, 2), (3, 2)))
    other.bodies[0].pieces = cut(other.bodies[0].pieces[0], columns, layers)
    return Case([Play(other)], impact=True)


def cut_wall(scene, dice):
    """What lies below is cut: a floor into several fixed bodies, a free body into pieces."""
    if scene.kind == "any":
        return None
    other = scene.copy()
    n = dice.choice((2, 3))
    if other.bodies[1].fixed:
        pieces = cut(other.bodies[1].pieces[0], n, 1)
        other.bodies[1:] = [Body(2 + k, [piece], fixed=True) for k, piece in enumerate(pieces)]
    else:
        other.bodies[1].pieces = cut(other.bodies[1].pieces[0], n, 1)
    return Case([Play(other)], impact=True)


def cut(rectangle, columns, layers):
    """Equal parts of a rectangle along the axes."""
    low, high = rectangle.min(axis=0), rectangle.max(axis=0)
    xs, ys = np.linspace(low[0], high[0], columns + 1), np.linspace(low[1], high[1], layers + 1)
    return [np.array([[xs[i], ys[j]], [xs[i + 1], ys[j]], [xs[i + 1], ys[j + 1]], [xs[i], ys[j + 1]]])
            for i in range(columns) for j in range(layers)]


# Runs in parts
def split_checkpoint(scene, dice):
    return split(scene, dice, "checkpoint")


def split_frame(scene, dice):
    return split(scene, dice, "frame")


def split(scene, dice, how):
    """The run ends at a step, and another one goes on from its result."""
    if scene.start or "until" in scene.tags:
        return None
    step = scene.every*dice.randint(3, scene.steps//scene.every - 3)
    periods = [scene.get(name, "interval") for name in scene.groups if name.startswith(("source.", "sink."))]
    if any(step % period for period in periods):
        fitting = [k for k in range(scene.every, scene.steps, scene.every) if not any(k % p for p in periods)]
        if not fitting:
            return None
        step = dice.choice(fitting)
    first, second = scene.copy(), scene.copy()
    shorten(first, 0, step)
    shorten(second, step, scene.steps)
    forget(second, step)
    # Motions and the turn of gravity are functions of another time.
    moved = "turning" in scene.tags or bool(scene.named("motion"))
    return Case([Play(first), Play(second, how)], before=step, exact=how == "checkpoint" and not moved,
                loose=0.01 if how == "frame" else 0.0, energies=False)


def shorten(scene, begin, end):
    """Keep the steps from `begin` to `end` of the stages, or of the duration."""
    scene.steps = end - begin
    names = scene.named("stage")
    if not names:
        scene.put("integrate", duration=(end - begin)*scene.dt)
        return
    at = 0
    for name in names:
        stage = scene.groups[f"stage.{name}"]
        steps = round(stage["duration"]/scene.dt)
        here = min(at + steps, end) - max(at, begin)
        at += steps
        if here > 0:
            stage["duration"] = here*scene.dt
            continue
        del scene.groups[f"stage.{name}"]
        for other in [other for other, group in scene.groups.items() if group.get("stage") == name]:
            del scene.groups[other]


def forget(scene, step):
    """What has happened at a step is not said again; gravity has turned so far."""
    time = step*scene.dt
    for name in scene.named("wall"):
        wall = scene.groups[f"wall.{name}"]
        if "vanish_at" not in wall:
            continue
        wall["vanish_at"] -= time
        if wall["vanish_at"] <= 0:
            del scene.groups[f"wall.{name}"]
    angle = 2*np.pi*scene.get("forces", "turn_rate", 0.0)*time
    if angle:
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        for group in scene.groups.values():
            if "gravity" in group:
                group["gravity"] = list(turn @ np.array(group["gravity"]))


def split_continue(scene, dice):
    """The run ends early, and goes on by --continue."""
    if scene.start:
        return None
    first = scene.copy()
    names = scene.named("stage")
    if any("stage" in group for group in scene.groups.values()):
        return None
    if names:
        for name in names[1:]:
            del first.groups[f"stage.{name}"]
    else:
        shorten(first, 0, scene.every*dice.randint(3, scene.steps//scene.every - 3))
    return Case([Play(first), Play(scene.copy(), "continue")], exact=True)


def stage_boundary(scene, dice):
    """A stage becomes two that are alike."""
    other = scene.copy()
    names = scene.named("stage")
    used = {group.get("stage") for group in scene.groups.values()}
    free = [name for name in names if name not in used and "duration" in scene.groups[f"stage.{name}"]]
    if names and not free:
        return None
    chosen = dice.choice(free) if names else None
    stage = scene.groups[f"stage.{chosen}"] if names else {"duration": scene.steps*scene.dt}
    steps = round(stage["duration"]/scene.dt)
    first = dice.randint(1, steps - 1)
    halves = {"stage.half": {**stage, "duration": first*scene.dt},
              "stage.other_half": {**stage, "duration": (steps - first)*scene.dt}}
    groups = {}
    for name, group in other.groups.items():
        if name == f"stage.{chosen}":
            groups.update(halves)
        else:
            groups[name] = group
    if not names:
        groups.update(halves)
        groups["integrate"].pop("duration")
    other.groups = groups
    return Case([Play(other)], exact=True)


#: All invariances, by name
INVARIANCES = {function.__name__: function for function in (
    border, copies_2x2, copies_3x1, quarter_turn, mirror, moving_frame, units, corners, order, far_body, far_wall,
    cut_body, cut_wall, split_checkpoint, split_frame, split_continue, stage_boundary)}
